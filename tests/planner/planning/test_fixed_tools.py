"""Rims of a part that an arm holds under a fixed tool, checked against Pinocchio's model of the arm in the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.dynamics import SegmentDynamics
from planner.errors import Collision, InvalidProblem
from planner.plots.view import drawn_tool_poses, stick_model
from planner.robots import load_robot
from planner.scene.carried import put_down, segment_scenes
from planner.scene.scene import Handling
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.planner.robots.held_parts import HeldPart
from tests.planner.robots.two_branches import se3

PART = planner.Payload(2.5, (0.0, 0.0, 0.09))
CELL = HeldPart(
    load_robot("kuka_kr16_2").with_payload(PART),
    Pose.from_rpy([1.25, 0.3, 0.9], [0.0, -np.pi / 2.0, 0.0]),
    Pose([0.0, 0.0, 0.12], np.eye(3)),
)
"""An arm that presses a plate on a grinding belt."""

HALF, SPEED = 0.08, 0.05
HOME = planner.JointWaypoint([0.0, 0.5, 0.0, 1.5, -1.5, 0.0])
TURNED = rotation_from_rpy(np.pi, 0.0, np.pi)
AT_SPEED = planner.Limits(tcp_linear_velocity=SPEED)


def on_face(x: float, y: float, tilt: float = 0.0) -> Pose:
    """Return a pose of the tool on the face of the part, in the part's frame."""
    return Pose([x, y, 0.0], TURNED @ rotation_from_rpy(tilt, 0.0, 0.0))


def rim(backend: planner.BackEnd, scene: planner.Scene | None = None) -> planner.Plan:
    """Plan a line, a half circle and a spline on the face of the part."""
    waypoints = [
        HOME,
        planner.PoseWaypoint(on_face(HALF, -HALF)),
        planner.PoseWaypoint(on_face(HALF, 0.0, 0.1), motion=planner.LinearMotion(), limits=AT_SPEED),
        planner.PoseWaypoint(
            on_face(-HALF, 0.0, 0.1), motion=planner.CircularMotion(via=Pose([0.0, HALF, 0.0])), limits=AT_SPEED
        ),
        planner.PoseWaypoint(
            on_face(HALF, -HALF),
            motion=planner.SplineMotion(poses=[on_face(-0.04, -0.05), on_face(0.04, -0.06)]),
            limits=AT_SPEED,
        ),
    ]
    return planner.plan(planner.PlanningProblem(CELL.robot, waypoints, scene=scene), backend)


def sampled(made: planner.Plan, segment: int, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    arrivals, departures = made.trajectory.arrivals, made.trajectory.departures
    times = np.linspace(departures[segment], arrivals[segment + 1], count)
    q, v, a = made.trajectory.evaluate(times, [0, 1, 2])
    return q, v, a


@pytest.mark.parametrize("backend", [planner.Toppra(), pytest.param(planner.Ruckig(), marks=pytest.mark.large_only)])
def test_the_fixed_tool_goes_along_paths_on_the_part_at_constant_speed(backend: planner.BackEnd) -> None:
    made = rim(backend)
    assert made.certificate.satisfied
    q, v, _ = sampled(made, 1, 200)  # the line, while the tool tilts
    places = [CELL.tool_in_part(row) for row in q]
    points = np.array([place.translation for place in places])
    np.testing.assert_allclose(points[:, [0, 2]], [[HALF, 0.0]] * len(points), atol=1e-4)
    shares = (points[:, 1] + HALF) / HALF
    for place, share in zip(places, shares, strict=True):
        assert np.linalg.norm(pin.log3(np.asarray(on_face(0.0, 0.0, 0.1 * share).rotation).T @ place.rotation)) < 1e-3
    q, v, _ = sampled(made, 2, 200)  # the half circle
    points = np.array([CELL.tool_in_part(row).translation for row in q])
    np.testing.assert_allclose(np.hypot(*points[:, :2].T), HALF, atol=1e-4)
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-4)
    speeds = np.array([np.linalg.norm(CELL.rates(*state)[0]) for state in zip(q, v, strict=True)])
    assert speeds.max() <= SPEED * (1.0 + 1e-6)
    assert speeds[40:-40].min() >= 0.995 * SPEED
    q, v, _ = sampled(made, 3, 200)  # the spline
    points = np.array([CELL.tool_in_part(row).translation for row in q])
    for passed in ((-0.04, -0.05), (0.04, -0.06)):
        assert np.linalg.norm(points[:, :2] - passed, axis=1).min() < 2e-3
    speeds = np.array([np.linalg.norm(CELL.rates(*state)[0]) for state in zip(q, v, strict=True)])
    assert speeds.max() <= SPEED * (1.0 + 1e-6)
    (check,) = (check for check in made.certificate.checks if check.quantity == "tcp_linear_velocity")
    assert check.method == "bounded"
    assert check.peak >= speeds.max() - 1e-9


def test_the_torques_of_the_arm_with_the_part_are_proved() -> None:
    made = rim(planner.Toppra())
    (check,) = (check for check in made.certificate.checks if check.quantity == "torque")
    states = (state for segment in range(4) for state in zip(*sampled(made, segment, 500), strict=True))
    shares = np.abs([CELL.torques(*state) for state in states]) / CELL.robot.limit("torque")
    assert check.ratio is not None
    assert check.ratio >= shares.max() - 1e-9
    assert check.ratio == pytest.approx(shares.max(), rel=2e-2)


def test_a_part_that_would_hit_the_grinder_is_refused() -> None:
    """The part swings on a joint motion through a post, and is far from one that stands elsewhere."""
    part = planner.AttachedObject(
        "part", [planner.Box([0.2, 0.2, 0.06])], Pose([0.0, 0.0, -0.03]), "workpiece", ["link_6"]
    )
    turned = planner.JointWaypoint([*HOME.position[:5], -1.0])
    q = np.array([*HOME.position[:5], -0.5])
    at = CELL.part(q).translation
    for aside, is_free in ((0.0, False), (1.0, True)):
        post = planner.SceneObject("post", [planner.Sphere(0.05)], Pose(at + np.array([0.0, 0.0, aside])))
        problem = planner.PlanningProblem(CELL.robot, [HOME, turned], scene=planner.Scene([post], [part]))
        if is_free:
            clearance = planner.plan(problem, planner.Trapezoidal()).certificate.clearance
            assert clearance is not None
            assert clearance.scene is not None
            assert clearance.scene.lower > 0.1
        else:
            with pytest.raises(Collision, match="post"):
                planner.plan(problem, planner.Trapezoidal())


def test_the_arm_takes_its_part_with_the_link_of_the_workpiece() -> None:
    """From there on the part moves with the arm; the fixed tool takes and carries nothing."""
    plate = planner.SceneObject("plate", [planner.Box([0.2, 0.2, 0.06])], _at(CELL.part(np.array(HOME.position))))
    there = planner.JointWaypoint([*HOME.position[:5], -0.4])
    for link, q in (("workpiece", np.array(there.position)), (None, None)):
        taking = planner.JointWaypoint(HOME.position, attach=[planner.Attach("plate", link, ["link_6"])])
        problem = planner.PlanningProblem(CELL.robot, [taking, there], scene=planner.Scene([plate]))
        if q is None:
            of_tool = planner.Scene(attached=[planner.AttachedObject("plate", plate.shapes)])
            for each in (problem, replace(problem, waypoints=[HOME, there], scene=of_tool)):
                with pytest.raises(InvalidProblem, match="must name the link that carries 'plate', such as 'workp"):
                    planner.plan(each)
            continue
        done, where = [Handling(taking.attach), Handling()], np.array([HOME.position, q])
        (scene,) = segment_scenes(CELL.robot, planner.Scene([plate]), done, where)
        (held,) = scene.attached
        assert planner.plan(problem).certificate.satisfied
        np.testing.assert_allclose(np.asarray(held.pose.position), 0.0, atol=1e-12)
        np.testing.assert_allclose(put_down(CELL.robot, held, q).pose.position, CELL.part(q).translation, atol=1e-9)


def _at(placement: pin.SE3) -> Pose:
    return Pose(placement.translation, placement.rotation)


def test_waypoints_on_moving_objects_are_refused_with_a_fixed_tool() -> None:
    with pytest.raises(InvalidProblem, match="workpiece, which moves"):
        planner.plan(planner.PlanningProblem(CELL.robot, [HOME, planner.PoseWaypoint(on_face(0.0, 0.0), on="crate")]))


def test_pictures_stand_in_the_world() -> None:
    """The tool is drawn where it stands, and the arm from the part to its foot."""
    q = np.array([[1.0, 0.5, 0.2, 1.3, -1.4, 0.3], [-2.0, -0.4, 0.1, 1.5, -1.2, 0.2]])
    points, rotations = drawn_tool_poses(SegmentDynamics.unchanged(CELL.robot), np.zeros(2, dtype=int), q)
    for row, point, rotation in zip(q, points, rotations, strict=True):
        np.testing.assert_allclose(point, CELL.fixed_tool.position, atol=1e-12)
        np.testing.assert_allclose(rotation, se3(CELL.fixed_tool).rotation, atol=1e-12)
        sticks = stick_model(CELL.robot, row)
        np.testing.assert_allclose(sticks[[0, -1]], [CELL.part(row).translation, np.zeros(3)], atol=1e-12)
