"""Seams on a workpiece that a positioner moves, checked against arm and positioner as two models in the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.certificate.clearance import certify_clearance
from planner.dynamics import SegmentDynamics
from planner.errors import Collision, InvalidProblem
from planner.kinematics.costs import tilts
from planner.plots.view import drawn_tool_poses, stick_model
from planner.problems.regions import Region
from planner.robots import ExternalAxis, load_robot
from planner.scene import CollisionChecker
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from planner.tool_motions.redundancy.flattest import flattest_solutions
from tests.planner.robots.two_branches import TwoBranches, se3

TORCH = Pose.from_rpy([0.1, 0.0, 0.3], [0.0, 0.6, 0.0])
TILT = ExternalAxis(
    "tilt", "revolute", (0, 1, 0), Pose([1.1, 0.0, 0.4], np.eye(3)), -1.6, 1.6, 1.0, 2.0, torque=2000.0,
    mass=120.0, center_of_mass=(0.0, 0.1, 0.05), inertia=(5.0, 0.0, 0.0, 5.0, 0.0, 5.0),
)  # fmt: skip
TURN = ExternalAxis(
    "turn", "revolute", (0, 0, 1), Pose([0.0, 0.0, 0.15], np.eye(3)), -20.0, 20.0, 2.0, 4.0, torque=500.0,
    mass=60.0, center_of_mass=(0.05, 0.0, 0.1), inertia=(2.0, 0.0, 0.0, 2.0, 0.0, 3.0),
)  # fmt: skip
CELL = TwoBranches(
    load_robot("kuka_kr16_2").derived(tool=TORCH), [TILT, TURN], Pose([0.0, 0.0, 0.1], rotation_from_rpy(0.3, 0.0, 0.0))
)
"""An arm with a torch beside a two-axis positioner, whose workpiece is a plate that is tilted on the table."""

RADIUS, HEIGHT, SPEED = 0.2, 0.05, 0.02
HOME = planner.JointWaypoint([0.0, 0.0, 0.0, -1.5, 1.5, 0.0, 0.5, 0.0])


def on_seam(angle: float) -> Pose:
    """Return the pose of the torch on the circular seam, in the workpiece's frame."""
    position = [RADIUS * np.cos(angle), RADIUS * np.sin(angle), HEIGHT]
    return Pose(position, rotation_from_rpy(np.pi, 0.0, np.pi))


def seam_plan(backend: object, scene: planner.Scene | None = None, end: float = 1.999 * np.pi) -> planner.Plan:
    """Plan the seam while the table turns against it."""
    waypoints = [
        HOME,
        planner.PoseWaypoint(on_seam(0.0), external={"turn": 0.0, "tilt": 0.4}),
        planner.PoseWaypoint(
            on_seam(end),
            motion=planner.CircularMotion(via=on_seam(end / 2.0)),
            limits=planner.Limits(tcp_linear_velocity=SPEED),
            external={"turn": -end, "tilt": 0.4},
        ),
    ]
    return planner.plan(planner.PlanningProblem(CELL.robot, waypoints, scene=scene), backend)  # type: ignore[arg-type]


def off_seam(placement: pin.SE3) -> tuple[float, float]:
    """Return the distance of the torch from the circle, m, and its angle from the torch's orientation there, rad."""
    x, y, z = placement.translation
    distance = float(np.hypot(np.hypot(x, y) - RADIUS, z - HEIGHT))
    return distance, float(np.linalg.norm(pin.log3(np.asarray(on_seam(0.0).rotation).T @ placement.rotation)))


def speeds_between(placements: list[pin.SE3], step: float) -> FloatArray:
    points = np.array([placement.translation for placement in placements])
    return np.linalg.norm(np.diff(points, axis=0), axis=1) / step


@pytest.mark.parametrize("backend", [planner.Toppra(), planner.Ruckig()])
def test_a_seam_is_welded_at_constant_speed_relative_to_the_workpiece(backend: planner.BackEnd) -> None:
    made = seam_plan(backend)
    start, end = made.trajectory.arrivals[1], made.trajectory.duration
    q, v, a = made.trajectory.evaluate(np.linspace(start, end, 400), [0, 1, 2])
    away = np.array([off_seam(CELL.tool_in_workpiece(row)) for row in q])
    assert away[:, 0].max() <= 1e-4
    assert away[:, 1].max() <= 1e-3
    between = np.linspace(start + 1.0, end - 1.0, 600)
    placements = [CELL.tool_in_workpiece(row) for row in made.trajectory.evaluate(between, [0])[0]]
    speeds = speeds_between(placements, float(between[1] - between[0]))
    assert speeds.max() <= SPEED * (1.0 + 1e-6)
    assert speeds.min() >= 0.995 * SPEED
    assert np.ptp(q[:, 0]) > 6.0  # the table turns under the torch
    torques = np.array([CELL.torques(*state) for state in zip(q, v, a, strict=True)])
    assert (np.abs(torques) <= CELL.robot.limit("torque")).all()
    deviations = {check.quantity: check for check in made.certificate.checks if "deviation" in check.quantity}
    assert deviations["path_position_deviation"].peak >= away[:, 0].max() - 1e-9
    (check,) = (check for check in made.certificate.checks if check.quantity == "torque")
    whole = made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 1000), [0, 1, 2])
    shares = np.abs([CELL.torques(*state) for state in zip(*whole, strict=True)]) / CELL.robot.limit("torque")
    assert check.ratio == pytest.approx(shares.max(), rel=2e-2)
    assert check.ratio >= shares.max() - 1e-9


def test_fixed_axes_go_evenly_so_that_a_torch_stands_still_over_a_flat_seam() -> None:
    """The table turns the seam under the torch: the arm hardly moves, to the tolerance of the path."""
    robot, end = TwoBranches(CELL.arm, CELL.axes, Pose([0.0, 0.0, 0.1], np.eye(3))).robot, 2.5
    poses = [Pose(on_seam(angle).position, rotation_from_rpy(np.pi, 0.0, np.pi + angle)) for angle in (0.0, end)]
    motion = planner.CircularMotion(via=Pose(on_seam(end / 2.0).position))
    waypoints = [
        HOME,
        planner.PoseWaypoint(poses[0], external={"turn": 0.0, "tilt": 0.0}),
        planner.PoseWaypoint(poses[1], motion=motion, external={"turn": -end, "tilt": 0.0}),
    ]
    made = planner.plan(planner.PlanningProblem(robot, waypoints), planner.Toppra())
    times = np.linspace(made.trajectory.arrivals[1], made.trajectory.duration, 200)
    (q,) = made.trajectory.evaluate(times, [0])
    assert np.ptp(q[:, 0]) == pytest.approx(end)
    assert np.ptp(q[:, 1:], axis=0).max() < 1e-3


def on_saddle(share: float) -> Pose:
    """Return the pose of the torch on the seam of a pipe on a pipe."""
    angle = 1.9 * np.pi * share
    position = [0.2 * np.cos(angle), 0.2 * np.sin(angle), 0.05 + 0.04 * np.cos(2.0 * angle)]
    return Pose(position, rotation_from_rpy(np.pi, 0.1 * np.sin(2.0 * angle), np.pi + angle))


@pytest.mark.parametrize("kind", [planner.SplineMotion, planner.PolylineMotion])
def test_a_saddle_is_welded_at_constant_speed_while_the_axes_go_evenly(kind: type) -> None:
    """Both axes move in proportion, and the torch passes every pose of the seam."""
    poses = [on_saddle(share) for share in np.linspace(0.0, 1.0, 40)]
    motion = kind(poses=poses[1:-1], **({"blend": 1e-3} if kind is planner.PolylineMotion else {}))
    ends = {"turn": 0.0, "tilt": 0.0}, {"turn": -1.9 * np.pi, "tilt": 0.1}
    waypoints = [
        HOME,
        planner.PoseWaypoint(poses[0], external=ends[0]),
        planner.PoseWaypoint(
            poses[-1], motion=motion, external=ends[1], limits=planner.Limits(tcp_linear_velocity=SPEED)
        ),
    ]
    made = planner.plan(planner.PlanningProblem(CELL.robot, waypoints), planner.Toppra())
    start, end = made.trajectory.arrivals[1], made.trajectory.duration
    (q,) = made.trajectory.evaluate(np.linspace(start, end, 1500), [0])
    np.testing.assert_allclose(q[:, 1] / 0.1, q[:, 0] / (-1.9 * np.pi), atol=1e-6)
    placements = [CELL.tool_in_workpiece(row) for row in q]
    points = np.array([placement.translation for placement in placements])
    for pose in poses[::7] if kind is planner.SplineMotion else poses[:: len(poses) - 1]:
        nearest = int(np.linalg.norm(points - pose.position, axis=1).argmin())
        assert np.linalg.norm(points[nearest] - pose.position) < 1e-4 + SPEED * (end - start) / 1500
        assert np.linalg.norm(pin.log3(np.asarray(pose.rotation).T @ placements[nearest].rotation)) < 2e-3
    between = np.linspace(start + 1.0, end - 1.0, 600)
    inner = [CELL.tool_in_workpiece(row) for row in made.trajectory.evaluate(between, [0])[0]]
    if kind is planner.SplineMotion:  # a chord across a corner is shorter than the way
        assert speeds_between(inner, float(between[1] - between[0])).min() >= 0.995 * SPEED


def test_the_torque_of_the_positioner_limits_the_motion() -> None:
    """The table with its overhanging plate takes longer with a weak drive, which is used up to its limit."""
    weak = TwoBranches(
        CELL.arm, [TILT, ExternalAxis(**{**vars(TURN), "torque": 10.0})], CELL.workpiece
    ).robot  # fmt: skip
    goal = planner.JointWaypoint([3.0, 0.3, *HOME.position[2:]])
    strong, slow = (
        planner.plan(planner.PlanningProblem(robot, [HOME, goal]), planner.Toppra()) for robot in (CELL.robot, weak)
    )
    assert slow.trajectory.duration > 1.03 * strong.trajectory.duration
    q, v, a = slow.trajectory.evaluate(np.linspace(0.0, slow.trajectory.duration, 2000), [0, 1, 2])
    torques = np.abs([CELL.torques(*state)[0] for state in zip(q, v, a, strict=True)])
    assert 0.98 * 10.0 <= torques.max() <= 10.0 * (1.0 + 1e-6)


def test_a_plate_on_the_positioner_that_would_hit_a_post_is_refused() -> None:
    plate = planner.AttachedObject("plate", [planner.Box([0.9, 0.3, 0.02])], link="workpiece")
    scenes = [
        planner.Scene([planner.SceneObject("post", [planner.Box([0.05, 0.05, 2.0])], Pose([1.1, y, 0.0]))], [plate])
        for y in (0.35, 0.7)
    ]
    trajectory = seam_plan(planner.Toppra(), None, 0.5 * np.pi).trajectory
    near, clear = (CollisionChecker(CELL.robot, scene) for scene in scenes)
    with pytest.raises(Collision, match="plate") as refused:
        certify_clearance(near, trajectory)
    assert "post" in str(refused.value)
    report = certify_clearance(clear, trajectory)
    assert report is not None
    assert report.scene is not None
    assert report.scene.lower > 0.0


def test_waypoints_on_moving_objects_are_refused_with_a_positioner() -> None:
    riding = planner.PoseWaypoint(on_seam(0.0), on="crate")
    with pytest.raises(InvalidProblem, match="workpiece, which moves"):
        planner.plan(planner.PlanningProblem(CELL.robot, [HOME, riding]))


def test_pictures_stand_in_the_world() -> None:
    """The stick model and the tool are where arm and positioner have them in the frame in which both stand."""
    q = np.array([[1.0, 0.5, 0.2, -1.3, 1.4, 0.3, 0.5, 0.1], [-2.0, -0.4, 0.1, -1.5, 1.2, 0.2, -0.6, 0.4]])
    points, rotations = drawn_tool_poses(SegmentDynamics.unchanged(CELL.robot), np.zeros(2, dtype=int), q)
    for row, point, rotation in zip(q, points, rotations, strict=True):
        tool, sticks = CELL.tool(row), stick_model(CELL.robot, row)
        np.testing.assert_allclose(point, tool.translation, atol=1e-12)
        np.testing.assert_allclose(rotation, tool.rotation, atol=1e-12)
        np.testing.assert_allclose(sticks[-1], tool.translation, atol=1e-12)
        np.testing.assert_allclose(sticks[0], CELL.links(row)[-1].act(CELL.workpiece.position), atol=1e-12)


def test_another_machine_keeps_clear_of_the_workpiece_in_the_world() -> None:
    """The clearance proved between a turning part and a ball that slides past is that of dense samples."""
    turned = CELL.robot.derived(mounting=Pose([0.3, -0.2, 0.1], rotation_from_rpy(0.2, 0.3, 0.4)))
    part = planner.AttachedObject("part", [planner.Sphere(0.05)], Pose([0.5, 0.1, 0.2]), "workpiece")
    goal = [2.0, 0.5, 0.4, -1.3, 1.3, 0.2, 0.4, 0.0]
    trajectory = planner.plan(planner.PlanningProblem(turned, [HOME, goal]), planner.Trapezoidal()).trajectory
    from_, velocity = np.array([2.3, -0.6, 0.6]), np.array([-0.1, 0.3, -0.1])
    mover = planner.Mover.of_trajectory("cell", turned, trajectory, planner.Scene(attached=[part]))
    ball = planner.Mover.sliding("ball", [planner.Sphere(0.1)], Pose(from_), velocity, duration=trajectory.duration)
    links = {shape.link for shape in turned.collision_shapes}
    allowed = [(f"cell/{link}", "ball/ball") for link in sorted(links)]  # only the part is measured
    found = planner.clearance_between(mover, ball, allowed_pairs=allowed).clearance
    times, mounting, least = np.linspace(0.0, trajectory.duration, 400), se3(turned.mounting), np.inf
    for time, q in zip(times, trajectory.evaluate(times, [0])[0], strict=True):
        at = (mounting * CELL.links(q)[-1] * se3(CELL.workpiece)).act(part.pose.position)
        least = min(least, float(np.linalg.norm(at - from_ - time * velocity)) - 0.15)
    assert found.upper == pytest.approx(least, abs=2e-3)
    assert found.lower == pytest.approx(least, abs=2e-3)
    assert found.pair == ("cell/part", "ball/ball")


@pytest.mark.parametrize("turn", [4.0, -6.0, 7.0])
def test_continuous_table_makes_the_turn_that_is_asked_for_along_a_line(turn: float) -> None:
    """Also by more than half a turn, where a shorter way leads to the same pose."""
    table = ExternalAxis("table", "continuous", (0, 0, 1), origin=Pose([0.6, 0.0, 0.2], np.eye(3)))
    robot = load_robot("ur5e").derived(id="turning", positioner=[table])
    down = np.diag([1.0, -1.0, -1.0])
    start, end = (
        planner.PoseWaypoint(Pose([0.05, y, 0.12], down), external={"table": angle}, motion=motion)
        for y, angle, motion in ((0.0, 0.0, planner.JointMotion()), (0.02, turn, planner.LinearMotion()))
    )
    plan = planner.plan(planner.PlanningProblem(robot, [start, end]))
    positions = plan.trajectory(plan.trajectory.sample_times(0.01))
    assert positions[[0, -1], 0] == pytest.approx([0.0, turn], abs=1e-9)
    assert (np.diff(positions[:, 0]) * np.sign(turn) >= -1e-12).all()
    reached = planner.forward_kinematics(robot, positions)
    assert np.array([pose.position[[0, 2]] for pose in reached]) == pytest.approx(
        np.array([[0.05, 0.12]] * len(reached)), abs=2e-4
    )


def on_cone(angle: float, lean: float = 0.6) -> Pose:
    """Return the pose of the torch on a circle around a cone, whose surface leans outwards."""
    normal = np.array([np.sin(lean) * np.cos(angle), np.sin(lean) * np.sin(angle), np.cos(lean)])
    along = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return Pose(
        [0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.05], np.array([along, np.cross(-normal, along), -normal]).T
    )


def cone_plan(robot: planner.Robot, **more: object) -> planner.Plan:
    waypoints = [
        HOME,
        planner.PoseWaypoint(on_cone(0.0)),
        planner.PoseWaypoint(
            on_cone(2.6),
            motion=planner.SplineMotion([on_cone(angle) for angle in np.linspace(0.0, 2.6, 30)[1:-1]]),
            limits=planner.Limits(tcp_linear_velocity=SPEED),
            **more,  # type: ignore[arg-type]
        ),
    ]
    options = planner.InverseKinematicsOptions(prefer="weld_flat")
    return planner.plan(planner.PlanningProblem(robot, waypoints, inverse_kinematics=options), planner.Ruckig())


def tilts_in_world(cell: TwoBranches, positions: FloatArray) -> FloatArray:
    """Return the angles, rad, between the axis of the torch and the vertical, with both machines in the world."""
    return np.array([np.arccos(np.clip(-cell.tool(q).rotation[2, 2], -1.0, 1.0)) for q in positions])


def test_a_positioner_holds_the_workpiece_flat_along_a_seam() -> None:
    cell = TwoBranches(CELL.arm, CELL.axes, Pose([0.0, 0.0, 0.1], np.eye(3)))
    made = cone_plan(cell.robot)
    assert made.certificate.satisfied
    start, end = made.trajectory.arrivals[1], made.trajectory.duration
    (q,) = made.trajectory.evaluate(np.linspace(start, end, 200), [0])
    assert tilts_in_world(cell, q).max() < np.radians(0.2)
    between = np.linspace(start + 1.0, end - 1.0, 400)
    placements = [cell.tool_in_workpiece(row) for row in made.trajectory.evaluate(between, [0])[0]]
    speeds = speeds_between(placements, float(between[1] - between[0]))
    assert np.ptp(speeds) <= 0.005 * SPEED


@pytest.mark.parametrize("lower", [-20.0, 2.0])
def test_a_table_without_positions_around_0_holds_the_workpiece_as_flat(lower: float) -> None:
    robot = CELL.arm.derived(positioner=[TILT, replace(TURN, lower=lower)])
    pose = Pose(on_seam(1.0).position, on_seam(1.0).rotation @ rotation_from_rpy(0.3, 0.1, 0.0))
    options = planner.InverseKinematicsOptions(prefer="weld_flat")
    found = flattest_solutions(robot, pose, Region(), options, np.append(3.0, HOME.position[1:]))
    assert tilts(robot, np.array([q for q, _ in found])).min() < np.radians(0.1)


@pytest.mark.large_only
def test_a_workpiece_that_cannot_be_flat_is_as_flat_as_it_can_be() -> None:
    """The axis tilts by up to 0.3 rad and the surface by 0.6 rad, so 0.3 rad are left at best."""
    axes = [replace(TILT, lower=-0.3, upper=0.3), TURN]
    cell = TwoBranches(CELL.arm, axes, Pose([0.0, 0.0, 0.1], np.eye(3)))
    made = cone_plan(cell.robot)
    (q,) = made.trajectory.evaluate(np.linspace(made.trajectory.arrivals[1], made.trajectory.duration, 100), [0])
    found = tilts_in_world(cell, q)
    assert found.min() >= 0.3 - 1e-6
    assert found.mean() < 0.34


def test_flat_welding_leaves_fixed_axes_and_needs_a_positioner() -> None:
    cell = TwoBranches(CELL.arm, CELL.axes, Pose([0.0, 0.0, 0.1], np.eye(3)))
    made = cone_plan(cell.robot, external={"turn": -2.6, "tilt": -0.5})
    assert made.path.positions[-1][:2] == pytest.approx([-2.6, -0.5])
    with pytest.raises(InvalidProblem) as refused:
        planner.plan(
            planner.PlanningProblem(
                CELL.arm, [HOME.position[2:]], inverse_kinematics=planner.InverseKinematicsOptions(prefer="weld_flat")
            )
        )
    assert refused.value.faults[0].field == ("inverse_kinematics", "prefer")
    assert "positioner" in str(refused.value)


@pytest.mark.parametrize("seed", [2, 70, 304])
def test_a_rail_goes_where_the_arm_can_follow_a_line(seed: int) -> None:
    """The smallest steps of all joints lead to a limit on these lines, so they were refused."""
    rail = ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0, mass=60.0)
    robot, rng = load_robot("kuka_kr16_2").derived(external_axes=[rail]), np.random.default_rng(seed)
    start = np.array([rng.uniform(0.3, 2.7), *(np.array([0.3, -1.2, 1.4, 0.2, 0.6, 0.1]) + rng.uniform(-0.6, 0.6, 6))])
    before = planner.tool_pose(robot, start)
    assert before.rotation is not None
    way = rng.uniform(-1.0, 1.0, 3) * np.array([1.5, 0.8, 0.6])
    turn = rotation_from_rpy(*rng.uniform(-1.2, 1.2, 3))
    goal = planner.PoseWaypoint(Pose(before.position + way, before.rotation @ turn), motion=planner.LinearMotion())
    made = planner.plan(planner.PlanningProblem(robot, [planner.JointWaypoint(start), goal]), planner.Quintic())
    assert made.certificate.satisfied
    for q in made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 50), [0])[0]:
        placement = pin.updateFramePlacement(*_placed(robot, q), robot.tool_frame_id)
        u = float((placement.translation - before.position) @ way / (way @ way))
        assert np.linalg.norm(placement.translation - before.position - u * way) <= 1e-4
        written = before.rotation @ pin.exp3(u * pin.log3(turn))
        assert np.linalg.norm(pin.log3(written.T @ placement.rotation)) <= 1.5e-3


def _placed(robot: planner.Robot, q: FloatArray) -> tuple[pin.Model, pin.Data]:
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return robot.model, data


@pytest.mark.large_only
def test_an_arm_with_seven_joints_welds_flat() -> None:
    """It has no closed form: its solutions are tracked along the seam."""
    axes = [replace(TILT, origin=Pose([0.55, 0.0, 0.0], np.eye(3))), replace(TURN, origin=Pose([0, 0, 0.1], np.eye(3)))]
    cell = TwoBranches(load_robot("fr3"), axes, Pose([0.0, 0.0, 0.0], np.eye(3)))
    ridge = [Pose([0.05, y, 0.1], rotation_from_rpy(np.pi + 5.0 * y, 0.0, 0.0)) for y in (-0.1, 0.1)]
    waypoints = [
        planner.JointWaypoint([0.0, 0.0, 0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.0]),
        planner.PoseWaypoint(ridge[0]),
        planner.PoseWaypoint(ridge[1], motion=planner.LinearMotion()),
    ]
    options = planner.InverseKinematicsOptions(prefer="weld_flat")
    made = planner.plan(planner.PlanningProblem(cell.robot, waypoints, inverse_kinematics=options), planner.Ruckig())
    (q,) = made.trajectory.evaluate(np.linspace(made.trajectory.arrivals[1], made.trajectory.duration, 100), [0])
    assert tilts_in_world(cell, q).max() < np.radians(0.5)
