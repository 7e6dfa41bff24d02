"""Polylines and splines of the tool, against scipy's splines and rotations, and dense inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from benchmarks.corpus.tracing import tool_at, trace
from planner.backends import BackEnd, Ruckig, Toppra, Trapezoidal
from planner.errors import InvalidProblem, UnreachableWaypoint
from planner.kinematics.forward import tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.paths import solve_path
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.transitions import BlendTransition
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_paths import NoPath
from planner.tool_motions.pose_splines import PoseSpline
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, ToolMotion, follow_motion
from planner.waypoints.solve import solve_waypoints

HOME = np.array((0.3, -1.2, 1.4, 0.2, 0.6, 0.1))
SPEED = 0.15
STEP = 1e-6


def random_poses(seed: int, count: int = 6, size: float = 0.5) -> list[Pose]:
    rng = np.random.default_rng(seed)
    turns = [rotation_from_rpy(*rng.uniform(-0.6, 0.6, 3)) for _ in range(count)]
    return [Pose(size * rng.uniform(-1.0, 1.0, 3), turn) for turn in turns]


def polyline(poses: list[Pose], blend: float) -> Polyline:
    return Polyline.through(poses[0], poses[1:-1], poses[-1], blend)


def spline(poses: list[Pose]) -> PoseSpline:
    return PoseSpline.through(poses[0], poses[1:-1], poses[-1])


def rotvec(rotations: FloatArray) -> FloatArray:
    vectors: FloatArray = Rotation.from_matrix(rotations).as_rotvec()
    return vectors


def is_c2_with_its_twist(path: Polyline | PoseSpline) -> None:
    """Assert that twists are differences of poses, and that they and their differences do not jump at breakpoints."""
    for u in np.linspace(0.01, 0.99, 60):
        positions, rotations = path.poses(np.array([u - STEP, u + STEP]))
        twist = path.twist(u)
        size = np.abs(twist).max()
        assert np.abs((positions[1] - positions[0]) / (2.0 * STEP) - twist[:3]).max() < 1e-4 * size
        if rotations is not None:
            turned = rotvec((rotations[1] @ rotations[0].T)[None])[0]
            assert np.abs(turned / (2.0 * STEP) - twist[3:]).max() < 1e-3 * size
    for u in path.breakpoints[1:-1]:
        before, here, after = (path.twist(u + at) for at in (-STEP, 0.0, STEP))
        jump = np.abs((after - here) - (here - before)) / STEP
        assert jump.max() < 2e-3 * np.abs((after - before) / STEP).max() + 20.0  # third derivatives by the step


@pytest.mark.parametrize("seed", range(3))
def test_a_polyline_is_straight_but_for_its_corners_and_goes_at_one_speed(seed: int) -> None:
    poses, blend = random_poses(seed), 0.04
    path = polyline(poses, blend)
    is_c2_with_its_twist(path)
    u = np.linspace(0.0, 1.0, 4001)
    positions, rotations = path.poses(u)
    assert rotations is not None
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert np.linalg.norm([path.twist(x)[:3] for x in u[::50]], axis=1) == pytest.approx(steps.sum(), rel=3e-5)
    corners = np.array([pose.position for pose in poses[1:-1]])
    near = np.linalg.norm(positions[:, None] - corners, axis=2)
    assert (near.min(axis=0) < blend).all()
    met = np.zeros(len(u), dtype=bool)
    for start, end in pairwise(poses):
        way = end.position - start.position
        share = (positions - start.position) @ way / (way @ way)
        away = np.linalg.norm(positions - start.position - share[:, None] * way, axis=1)
        own = (near.min(axis=1) > blend) & (away < 1e-9) & (share > -1e-9) & (share < 1.0 + 1e-9)
        wanted = Slerp([0.0, 1.0], Rotation.from_matrix([start.rotation, end.rotation]))(np.clip(share[own], 0.0, 1.0))
        assert (wanted.inv() * Rotation.from_matrix(rotations[own])).magnitude().max() < 1e-9
        met |= own
    assert (met | (near.min(axis=1) <= blend * (1.0 + 1e-9))).all()


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2.0, 2.5])
def test_the_length_of_a_cut_corner_in_closed_form(angle: float) -> None:
    """The chord between its ends follows from the mean cosine of the direction to it, integrated by scipy."""
    poses = [Pose([-1.0, 0.0, 0.0]), Pose([0.0, 0.0, 0.0]), Pose([np.cos(angle), np.sin(angle), 0.0])]
    blend = 0.2
    mean = quad(lambda x: np.cos(angle * (3.0 * x**2 - 2.0 * x**3) - angle / 2.0), 0.0, 1.0, epsabs=1e-13)[0]
    length = 2.0 * (1.0 - blend) + 2.0 * blend * np.cos(angle / 2.0) / mean
    path = polyline(poses, blend)
    assert np.linalg.norm(path.twist(0.5)) == pytest.approx(length, rel=1e-12)
    middle = path.pose(0.5).position
    assert middle @ [np.cos(angle / 2.0), np.sin(angle / 2.0), 0.0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_spline_is_that_of_scipy_at_one_speed(seed: int) -> None:
    poses = random_poses(seed)
    path = spline(poses)
    is_c2_with_its_twist(path)
    points = np.array([pose.position for pose in poses])
    chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    quaternions = Rotation.from_matrix([pose.rotation for pose in poses]).as_quat(canonical=True)
    for k in range(1, len(quaternions)):
        quaternions[k] *= np.sign(quaternions[k] @ quaternions[k - 1])
    truth = CubicSpline(chords, np.hstack([points, quaternions]), bc_type="natural")

    def speed(t: float) -> float:
        return float(np.linalg.norm(truth(t, 1)[:3]))

    parts = [quad(speed, a, b, epsabs=1e-11)[0] for a, b in pairwise(chords)]
    assert path.breakpoints == pytest.approx(np.cumsum([0.0, *parts]) / sum(parts), abs=1e-8)
    for k, t in enumerate(np.linspace(0.1, 0.9, 5)):
        at = chords[k] + t * (chords[k + 1] - chords[k])
        u = (sum(parts[:k]) + quad(speed, chords[k], at, epsabs=1e-11)[0]) / sum(parts)
        pose, wanted = path.pose(u), truth(at)
        assert np.abs(pose.position - wanted[:3]).max() < 1e-7
        assert (Rotation.from_quat(wanted[3:]).inv() * Rotation.from_matrix(pose.rotation)).magnitude() < 1e-6
        assert np.linalg.norm(path.twist(u)[:3]) == pytest.approx(sum(parts), rel=1e-7)


def test_open_rotations_are_filled_in_and_repeated_poses_left_out() -> None:
    start, end = (
        Pose([0.0, 0.0, 0.0], np.eye(3)),
        Pose([1.0, 1.0, 0.0], Rotation.from_rotvec([0.0, 0.0, 1.0]).as_matrix()),
    )
    corner, again = Pose([1.0, 0.0, 0.0]), Pose(start.position, start.rotation)
    for path in (polyline([start, again, corner, end], 0.01), spline([start, again, corner, corner, end])):
        middle = path.pose(0.5)
        assert rotvec(np.array([middle.rotation]))[0] == pytest.approx([0.0, 0.0, 0.5], abs=1e-3)
    position_only = polyline([Pose(pose.position) for pose in (start, corner, end)], 0.1)
    assert position_only.pose(0.3).rotation is None
    assert len(position_only.twist(0.3)) == 3


def test_poses_through_which_there_is_no_path() -> None:
    a, b = Pose([0.0, 0.0, 0.0], np.eye(3)), Pose([1.0, 0.0, 0.0], np.eye(3))
    turned = Pose(a.position, rotation_from_rpy(0.0, 0.0, 1.0))
    for poses, message in (
        ([a, b, a], "turns back"),
        ([a, turned, b], "turn where it is"),
        ([a, a, a], "are equal to"),
        ([Pose(a.position), b, Pose([1.0, 1.0, 0.0])], "orientation is given"),
    ):
        for make in (lambda poses: polyline(poses, 0.1), spline):
            with pytest.raises(NoPath, match=message) as refusal:
                make(poses)
            assert refusal.value.field[0] == "poses"


def around(robot: Robot, home: FloatArray, size: float = 1.0) -> list[Pose]:
    """Return four corners beside the pose at a joint position, with a turning tool, and that pose again."""
    pose = tool_at(robot, home)
    moves = [
        ((0.0, -0.2, 0.0), (0.2, 0.0, 0.0)),
        ((0.1, -0.2, -0.1), (0.0, 0.0, 0.0)),
        ((0.1, -0.4, -0.1), (0.0, 0.3, 0.0)),
    ]
    moves += [((0.0, -0.4, 0.1), (0.0, 0.0, 0.0)), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))]
    return [
        Pose(pose.position + size * np.array(shift), pose.rotation @ rotation_from_rpy(*turn)) for shift, turn in moves
    ]


MOTIONS = {"polyline": lambda poses: PolylineMotion(poses, 0.03), "spline": SplineMotion}
BACK_ENDS: list[BackEnd] = [Trapezoidal(), Toppra(), Ruckig()]


def planned(kind: str, backend: BackEnd) -> Plan:
    """Plan a motion around the corners and back to the start, at a constant speed."""
    robot = load_robot("kuka_kr16_l6_2")
    *poses, end = around(robot, HOME)
    goal = PoseWaypoint(end, motion=MOTIONS[kind](poses))
    return plan(PlanningProblem(robot, [JointWaypoint(HOME), goal], Limits(tcp_linear_velocity=SPEED)), backend)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("backend", BACK_ENDS, ids=lambda backend: backend.kind)
def test_a_closed_way_is_driven_at_one_speed_from_end_to_end(kind: str, backend: BackEnd) -> None:
    """The speed by differences of Pinocchio's poses is constant except at the start and the end."""
    made = planned(kind, backend)
    assert made.certificate.satisfied
    assert {"path_position_deviation", "path_orientation_deviation"} <= {
        check.quantity for check in made.certificate.checks
    }
    times = np.linspace(0.0, made.trajectory.duration, 801)
    tools = [tool_at(made.path.robot, q).position for q in made.trajectory.evaluate(times, [0])[0]]
    speeds = np.linalg.norm(np.diff(tools, axis=0), axis=1) / np.diff(times)
    assert speeds.max() <= SPEED * (1.0 + 1e-6)
    assert np.mean(speeds > 0.98 * SPEED) > 0.95
    assert np.linalg.norm(tools[-1] - tools[0]) < 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("arm", ["kuka_kr16_l6_2", "panda", "three_dof_arm"])
def test_the_joints_are_where_dense_inverse_kinematics_lead(kind: str, arm: str) -> None:
    """The truth is a chain of joint positions by Pinocchio's Jacobians alone; for a Panda it is the tool only."""
    robot = load_robot(arm)
    home = {"panda": np.array((0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5)), "three_dof_arm": np.array((0.2, -0.4, 1.5))}.get(
        arm, HOME
    )
    poses = around(robot, home, 0.5 if arm == "panda" else 0.3 if arm == "three_dof_arm" else 1.0)
    if robot.is_position_only:
        poses = [Pose(pose.position) for pose in poses]
    start = tool_at(robot, home)
    start = Pose(start.position) if robot.is_position_only else start
    goal = PoseWaypoint(poses[-1], motion=MOTIONS[kind](poses[:-1]))
    solved = solve_path(PlanningProblem(robot, [JointWaypoint(home), goal])).waypoints[1]
    assert solved.tool_motion is not None
    truth = polyline([start, *poses], 0.03) if kind == "polyline" else spline([start, *poses])
    u = np.linspace(0.0, 1.0, 201)
    joints = solved.tool_motion.curve.evaluate(u, [0])[0]
    for share, q in zip(u.tolist(), joints, strict=True):
        wanted, reached = truth.pose(share), tool_at(robot, q)
        assert np.linalg.norm(wanted.position - reached.position) < 5e-5
        if wanted.rotation is not None:
            assert np.linalg.norm(rotvec((wanted.rotation.T @ reached.rotation)[None])) < 5e-4
    if arm != "panda":
        chain = trace(robot, [truth.pose(share) for share in u.tolist()], home)
        assert chain is not None
        assert np.abs(joints - chain).max() < 1e-3


@pytest.mark.parametrize("motion", [PolylineMotion, SplineMotion])
def test_a_remote_pose_on_the_way_is_out_of_reach_and_a_way_without_one_is_a_fault(
    motion: type[CartesianMotion],
) -> None:
    robot = load_robot("kuka_kr16_l6_2")
    more = {"blend": 0.05} if motion is PolylineMotion else {}
    *_, end = around(robot, HOME)
    shifts = ((3.0, 3.0, 0.0), (3.0, -3.0, 0.0), (0.0, 0.1, 0.0))
    *far, near = (Pose(end.position + np.array(shift)) for shift in shifts)
    for poses, error in ((far, UnreachableWaypoint), ([near], InvalidProblem)):
        goal = PoseWaypoint(end, motion=motion(poses=poses, **more))  # type: ignore[call-arg]
        with pytest.raises(error) as refusal:
            plan(PlanningProblem(robot, [JointWaypoint(HOME), goal]), Trapezoidal())
    assert refusal.value.faults[0].field[:3] == ("waypoints", 1, "motion")


def test_a_polyline_between_blends_goes_on_at_speed() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    *poses, end = around(robot, HOME)
    blend = BlendTransition(0.02)
    aside = Pose(end.position + np.array([0.0, 0.0, 0.1]), end.rotation)
    ways: list[AnyWaypoint] = [
        JointWaypoint(HOME),
        PoseWaypoint(aside, motion=LinearMotion(), transition=blend),
        PoseWaypoint(end, motion=PolylineMotion(poses, 0.03), transition=blend),
        PoseWaypoint(aside, motion=LinearMotion()),
    ]
    made = plan(PlanningProblem(robot, ways, Limits(tcp_linear_velocity=SPEED)), Trapezoidal())
    assert made.certificate.satisfied
    (group,) = made.path.groups
    assert len(group.path_knots) == 8  # two for each corner
    velocities = made.trajectory.evaluate(made.trajectory.arrivals[1:3], [1])[0]
    assert (np.abs(velocities).max(axis=1) > 0.01).all()


@pytest.mark.long_table
@pytest.mark.parametrize(("size", "radius"), [(3e-4, None), (3e-4, 2e-4), (0.05, 0.03), (0.05, None)])
def test_ways_that_wander_about_their_ends_are_certified(size: float, radius: float | None) -> None:
    """By distance alone, the tool could be anywhere on a path as small as its tolerance, or as a blend."""
    robot, rng = load_robot("kuka_kr16_l6_2"), np.random.default_rng(7)
    home = tool_at(robot, HOME)
    for make in MOTIONS.values():
        poses = [
            Pose(home.position + size * rng.uniform(-1.0, 1.0, 3), home.rotation @ rotation_from_rpy(*turn))
            for turn in rng.uniform(-0.3, 0.3, (8, 3))
        ]
        ways: list[AnyWaypoint] = [JointWaypoint(HOME), PoseWaypoint(poses[-2], motion=make(poses[:-2]))]
        if radius is not None:
            ways[1] = PoseWaypoint(poses[-2], motion=make(poses[:-2]), transition=BlendTransition(radius))
            ways.append(PoseWaypoint(poses[-1], motion=LinearMotion()))
        checks = plan(PlanningProblem(robot, ways), Trapezoidal()).certificate.checks
        assert max(check.ratio for check in checks if check.quantity.startswith("path_")) < 0.5  # type: ignore[type-var]


@pytest.mark.parametrize("motion", [lambda via: PolylineMotion(via, 0.01), SplineMotion], ids=["polyline", "spline"])
def test_what_leads_out_of_reach_is_followed_from_one_start_only(
    motion: Callable[[list[Pose]], CartesianMotion], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From every solution of a redundant arm at the pose before, the refusal took 10 to 20 s."""
    robot, home = load_robot("panda"), np.array([0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5])
    start = tool_pose(robot, home)
    beyond = Pose(start.position + np.array([0.6, 0.1, 0.1]), start.rotation)
    assert np.linalg.norm(beyond.position - [0.0, 0.0, 0.333]) > 0.855 + 0.1034  # the maker's reach, and the hand's
    end = Pose(start.position + np.array([0.02, -0.1, 0.05]), start.rotation)
    waypoints = (JointWaypoint(tuple(home + 0.1)), PoseWaypoint(start), PoseWaypoint(end, motion=motion([beyond])))
    followed = []

    def follow(requested: RequestedMotion, position: FloatArray) -> ToolMotion | RefusedMotion:
        followed.append(position)
        return follow_motion(requested, position)

    monkeypatch.setattr("planner.waypoints.choice.follow_motion", follow)
    with pytest.raises(UnreachableWaypoint, match="leaves what panda can reach"):
        solve_waypoints(robot, waypoints, InverseKinematicsOptions())
    assert len(followed) == 1
