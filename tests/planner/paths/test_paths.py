"""Lines, circles, blends and passed waypoints: the path of the tool, refusals, and remedies that work."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.corpus.tracing import reach
from planner.backends import BACKENDS, Cubic, Quintic, Trapezoidal
from planner.errors import (
    ConfigurationChange,
    InfeasibleDuration,
    InvalidProblem,
    JointPositionLimit,
    PlanningError,
    SingularPath,
    UnreachableWaypoint,
)
from planner.kinematics import FloatArray, Pose, all_solutions
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    Frame,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.spatial import rotation_from_rpy

if TYPE_CHECKING:
    from collections.abc import Sequence

KINDS = ("cubic", "quintic", "trapezoidal")
DATA: dict[str, pin.Data] = {}
HOME = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("kuka_kr16_l6_2")


def tool(robot: Robot, q: Sequence[float] | FloatArray) -> pin.SE3:
    """Return the tool's pose by Pinocchio alone."""
    if robot.id not in DATA:
        DATA[robot.id] = robot.model.createData()
    data = DATA[robot.id]
    pin.framesForwardKinematics(robot.model, data, np.array(q))
    return pin.SE3(data.oMf[robot.tool_frame_id])


def shifted(robot: Robot, shift: Sequence[float], turn: Sequence[float] = (0.0, 0.0, 0.0)) -> Pose:
    """Return the pose at HOME, moved in the base frame and turned in the tool's."""
    home = tool(robot, HOME)
    return Pose(home.translation + np.array(shift), home.rotation @ rotation_from_rpy(*turn))


def planned(robot: Robot, waypoints: Sequence[AnyWaypoint], kind: str = "cubic", limits: Limits | None = None) -> Plan:
    return plan(PlanningProblem(robot, tuple(waypoints), limits=limits or Limits()), BACKENDS[kind]())


def dense(result: Plan, count: int = 1001) -> tuple[FloatArray, list[pin.SE3]]:
    """Return dense times (N,) and poses of the tool."""
    times = np.linspace(0.0, result.trajectory.duration, count)
    robot = result.path.robot
    return times, [tool(robot, q) for q in result.trajectory.evaluate(times, [0])[0]]


@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_motion_is_a_straight_line_with_one_turn_about_one_axis(robot: Robot, kind: str) -> None:
    end = shifted(robot, (0.1, -0.4, 0.1), (0.3, -0.2, 0.4))
    result = planned(robot, [JointWaypoint(position=HOME), PoseWaypoint(pose=end, motion=LinearMotion())], kind)
    start = tool(robot, HOME)
    way, turn = end.position - start.translation, pin.log3(start.rotation.T @ end.rotation)
    for pose in dense(result)[1]:
        offset = pose.translation - start.translation
        share = offset @ way / (way @ way)
        assert np.linalg.norm(offset - share * way) <= 1e-4
        due = start.rotation @ pin.exp3(share * turn)
        assert np.linalg.norm(pin.log3(due.T @ pose.rotation)) <= 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_a_finer_tolerance_is_kept_too(robot: Robot, kind: str) -> None:
    motion = LinearMotion(tolerance_position=1e-7, tolerance_orientation=1e-6)
    end = shifted(robot, (0.0, -0.3, 0.1))
    result = planned(robot, [JointWaypoint(position=HOME), PoseWaypoint(pose=end, motion=motion)], kind)
    start = tool(robot, HOME)
    way = (end.position - start.translation) / np.linalg.norm(end.position - start.translation)
    for pose in dense(result)[1]:
        assert np.linalg.norm(np.cross(pose.translation - start.translation, way)) <= 1e-7


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turned", [False, True])
def test_a_circular_motion_goes_through_its_via_pose_on_one_circle(robot: Robot, kind: str, turned: bool) -> None:
    start, end = tool(robot, HOME), shifted(robot, (0.0, -0.3, 0.1), (0.2, 0.0, 0.3))
    via = shifted(robot, (0.05, -0.2, 0.2), (0.4, 0.1, 0.0))
    via = via if turned else Pose(via.position)
    waypoints = [JointWaypoint(position=HOME), PoseWaypoint(pose=end, motion=CircularMotion(via))]
    result = planned(robot, waypoints, kind)
    # The centre as the least-squares solution of equal distances, within the plane of the three points.
    a, b, c = start.translation, via.position, end.position
    normal = np.cross(b - a, c - a)
    center = np.linalg.lstsq(
        np.array([b - a, c - a, normal]), np.array([(b @ b - a @ a) / 2, (c @ c - a @ a) / 2, normal @ a]), rcond=None
    )[0]
    radius = np.linalg.norm(a - center)
    poses = dense(result)[1]
    for pose in poses:
        assert abs((pose.translation - a) @ normal / np.linalg.norm(normal)) <= 1e-4
        assert abs(np.linalg.norm(pose.translation - center) - radius) <= 1e-4
    nearest = min(poses, key=lambda pose: float(np.linalg.norm(pose.translation - b)))
    assert np.linalg.norm(nearest.translation - b) < 1e-3
    if via.rotation is not None:
        assert np.linalg.norm(pin.log3(nearest.rotation.T @ via.rotation)) < 5e-3


def test_tool_speed_along_a_line_is_limited_and_reached(robot: Robot) -> None:
    end = PoseWaypoint(pose=shifted(robot, (0.0, -0.4, 0.1)), motion=LinearMotion())
    for kind in KINDS:
        limits = Limits(tcp_linear_velocity=0.2)
        result = planned(robot, [JointWaypoint(position=HOME), end], kind, limits)
        times, poses = dense(result)
        speed = np.linalg.norm(np.diff([pose.translation for pose in poses], axis=0), axis=1) / np.diff(times)
        assert 0.19 < speed.max() <= 0.2


CORNERS = ("linear-linear", "linear-joint", "joint-linear", "joint-joint", "circular-linear")


@pytest.mark.long_table
@pytest.mark.parametrize("motions", CORNERS)
@pytest.mark.parametrize("radius", [0.002, 0.05, 0.5])
@pytest.mark.parametrize("kind", KINDS)
def test_a_blend_stays_within_its_radius_and_moves_on(robot: Robot, kind: str, radius: float, motions: str) -> None:
    via = Pose(shifted(robot, (0.05, -0.1, 0.05)).position)
    known = {"linear": {"motion": LinearMotion()}, "joint": {}, "circular": {"motion": CircularMotion(via)}}
    before, after = (known[name] for name in motions.split("-"))
    corner = shifted(robot, (0.0, -0.2, 0.0))
    waypoints = [
        JointWaypoint(position=HOME),
        PoseWaypoint(pose=corner, transition=BlendTransition(radius), **before),
        PoseWaypoint(pose=shifted(robot, (0.0, -0.2, -0.2)), **after),
    ]
    result = planned(robot, waypoints, kind)
    stopping = planned(robot, [replace(waypoint, **STOP) for waypoint in waypoints], kind)
    reference = [pose.translation for pose in dense(stopping, 2001)[1]]
    nearest = np.inf
    for pose in dense(result, 401)[1]:
        distance = float(np.linalg.norm(pose.translation - corner.position))
        nearest = min(nearest, distance)
        if distance > radius:  # on the way of the motions without a blend
            assert np.linalg.norm(np.array(reference) - pose.translation, axis=1).min() < 2e-3
    assert 0.0 < nearest <= radius
    assert np.abs(result.trajectory.evaluate(result.trajectory.arrivals[1:2], [1])[0]).max() > 0.0


STOP: dict[str, StopTransition] = {"transition": StopTransition()}


@pytest.mark.parametrize("kind", KINDS)
def test_passing_a_waypoint_between_a_joint_motion_and_a_line(robot: Robot, kind: str) -> None:
    waypoints = [
        JointWaypoint(position=HOME),
        PoseWaypoint(pose=shifted(robot, (0.0, -0.3, 0.1)), transition=ThroughTransition()),
        PoseWaypoint(pose=shifted(robot, (0.0, -0.3, -0.2)), motion=LinearMotion(), transition=ThroughTransition()),
        JointWaypoint(position=HOME),
    ]
    result = planned(robot, waypoints, kind)
    for k in (1, 2):
        position, velocity = result.trajectory.evaluate(result.trajectory.arrivals[k : k + 1], [0, 1])
        assert position[0] == pytest.approx(result.path.positions[k], abs=1e-9)
        assert np.abs(velocity).max() > 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_a_line_in_two_parts_is_passed_at_speed_and_as_fast_as_one(robot: Robot, kind: str) -> None:
    half, whole = shifted(robot, (0.0, -0.2, 0.05)), shifted(robot, (0.0, -0.4, 0.1))
    start, end = JointWaypoint(position=HOME), PoseWaypoint(pose=whole, motion=LinearMotion())
    passed = PoseWaypoint(pose=half, motion=LinearMotion(), transition=ThroughTransition())
    one, two = planned(robot, [start, end], kind), planned(robot, [start, passed, end], kind)
    assert two.trajectory.duration <= 1.05 * one.trajectory.duration


@pytest.mark.long_table
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("radius", [1e-6, 1e-4])
def test_a_tiny_blend_costs_little_more_than_stopping(robot: Robot, kind: str, radius: float) -> None:
    """One case was a division by zero, another took half a minute."""
    waypoints = [
        JointWaypoint(position=HOME),
        PoseWaypoint(pose=shifted(robot, (0, -0.4, 0)), motion=LinearMotion(), transition=BlendTransition(radius)),
        PoseWaypoint(pose=shifted(robot, (0, -0.4, -0.3)), motion=LinearMotion()),
    ]
    stopping = planned(robot, [replace(waypoint, **STOP) for waypoint in waypoints], kind)
    assert planned(robot, waypoints, kind).trajectory.duration < 2.0 * stopping.trajectory.duration


def test_a_corner_cannot_be_passed_and_both_remedies_work(robot: Robot) -> None:
    waypoints = [
        JointWaypoint(position=HOME),
        PoseWaypoint(pose=shifted(robot, (0, -0.2, 0)), motion=LinearMotion(), transition=ThroughTransition()),
        PoseWaypoint(pose=shifted(robot, (0, -0.2, -0.2)), motion=LinearMotion()),
    ]
    with pytest.raises(InvalidProblem) as refusal:
        planned(robot, waypoints)
    assert refusal.value.faults[0][0] == ("waypoints", 1, "transition")
    assert [remedy.value for remedy in refusal.value.remedies] == [BlendTransition(0.01), StopTransition()]
    for remedy in refusal.value.remedies:
        assert plan(remedy.applied_to(PlanningProblem(robot, tuple(waypoints)))).certificate.satisfied


def fraction_followed(error: PlanningError) -> float:
    assert error.path_point is not None
    return error.path_point.fraction


def refused(robot: Robot, waypoints: Sequence[AnyWaypoint], error: type[PlanningError]) -> PlanningError:
    """Return the refusal, after applying every one of its remedies successfully."""
    with pytest.raises(error) as refusal:
        planned(robot, waypoints)
    assert refusal.value.segment == 0
    assert refusal.value.waypoint == 1
    point = refusal.value.path_point
    assert point is not None
    assert tool(robot, point.position).translation == pytest.approx(point.pose.position, abs=1e-9)
    assert refusal.value.remedies
    for remedy in refusal.value.remedies:
        assert plan(remedy.applied_to(PlanningProblem(robot, tuple(waypoints)))).certificate.satisfied
    return refusal.value


def test_a_line_to_another_branch_is_a_configuration_change(robot: Robot) -> None:
    end = shifted(robot, (0.0, -0.2, 0.1))
    solutions = all_solutions(robot, end, InverseKinematicsOptions(), np.array(HOME))
    other = solutions[-1]
    waypoints = [JointWaypoint(position=HOME), JointWaypoint(position=tuple(other.tolist()), motion=LinearMotion())]
    error = refused(robot, waypoints, ConfigurationChange)
    assert error.joint in robot.joint_names
    assert fraction_followed(error) == 1.0


@pytest.mark.large_only
def test_a_line_just_past_the_wrist_singularity_is_singular(robot: Robot) -> None:
    """With axis 5 at zero, axes 4 and 6 coincide: 0.01 mrad past it, axis 4 would have to turn at once."""
    near = np.array((0.0, -1.2, 1.4, 0.0, 0.3, 0.0))
    start, end = (tool(robot, (*near[:4], tilt, near[5])) for tilt in (0.3, -0.3))
    aside = rotation_from_rpy(0.0, 0.0, 1e-5)
    position = reach(robot, Pose(start.translation, aside @ start.rotation), near)
    assert position is not None
    waypoints = [
        JointWaypoint(position=tuple(position.tolist())),
        PoseWaypoint(pose=Pose(end.translation, aside @ end.rotation), motion=LinearMotion()),
    ]
    error = refused(robot, waypoints, SingularPath)
    assert fraction_followed(error) == pytest.approx(0.5, abs=0.05)


def test_a_line_beyond_a_joint_limit_names_joint_limit_and_place(robot: Robot) -> None:
    """Axis 1 may turn by 185 degrees, and half a circle around the back needs more."""
    start = np.array(HOME)
    start[0] = 3.0
    home = tool(robot, start)
    side = np.cross([0.0, 0.0, 1.0], home.translation)
    side /= np.linalg.norm(side)
    for sign in (1.0, -1.0):
        waypoints = [
            JointWaypoint(position=tuple(start)),
            PoseWaypoint(pose=Pose(home.translation + sign * 0.8 * side, home.rotation), motion=LinearMotion()),
        ]
        try:
            planned(robot, waypoints)
        except JointPositionLimit:
            break
    error = refused(robot, waypoints, JointPositionLimit)
    assert error.joint == robot.joint_names[0]
    joint = robot.joints[0]
    assert error.limit in {joint.lower, joint.upper}
    assert error.value == pytest.approx(error.limit, abs=1e-6)
    assert 0.0 < fraction_followed(error) < 1.0


def test_a_line_through_the_hole_in_the_workspace_leaves_what_can_be_reached() -> None:
    """The arm of document 002 cannot come nearer than 70 mm to its shoulder."""
    robot = load_robot("three_dof_arm")
    ends = (Pose(np.array([0.15, 0.03, 0.02])), Pose(np.array([-0.15, 0.03, 0.02])))
    waypoints = [PoseWaypoint(pose=ends[0]), PoseWaypoint(pose=ends[1], motion=LinearMotion())]
    error = refused(robot, waypoints, UnreachableWaypoint)
    there = ends[0].position + fraction_followed(error) * (ends[1].position - ends[0].position)
    assert np.linalg.norm(there) == pytest.approx(0.07, abs=1e-3)


@pytest.mark.parametrize("frame", ["tool", "base"])
def test_a_relative_line_out_of_reach_has_remedies_too(robot: Robot, frame: Frame) -> None:
    home = tool(robot, HOME)
    away = 3.0 * home.translation / np.linalg.norm(home.translation)
    x, y, z = away if frame == "base" else home.rotation.T @ away
    far = RelativeWaypoint(frame=frame, move=CartesianMove((x, y, z)))
    for waypoint in (far, replace(far, motion=LinearMotion())):
        waypoints = [JointWaypoint(position=HOME), waypoint]
        with pytest.raises(UnreachableWaypoint) as refusal:
            planned(robot, waypoints)
        assert refusal.value.waypoint == 1
        assert [remedy.field for remedy in refusal.value.remedies] == [("waypoints", 1, "move")]
        mended = refusal.value.remedies[0].applied_to(PlanningProblem(robot, tuple(waypoints))).waypoints
        assert planned(robot, [mended[0], replace(mended[1], motion=JointMotion())]).certificate.satisfied


def test_three_points_on_a_line_are_no_circle(robot: Robot) -> None:
    via = shifted(robot, (0.0, -0.1, 0.0))
    end = PoseWaypoint(pose=shifted(robot, (0.0, -0.3, 0.0)), motion=CircularMotion(via))
    with pytest.raises(InvalidProblem) as refusal:
        planned(robot, [JointWaypoint(position=HOME), end])
    assert refusal.value.faults[0][0] == ("waypoints", 1, "motion", "via")


@pytest.mark.long_table
@pytest.mark.parametrize("backend", [Cubic(), Quintic(), Trapezoidal(), Trapezoidal(acceleration_time=0.4)])
def test_durations_along_a_line_are_kept_or_refused_with_one_that_works(
    robot: Robot, backend: Cubic | Quintic | Trapezoidal
) -> None:
    end = PoseWaypoint(pose=shifted(robot, (0.0, -0.4, 0.1)), motion=LinearMotion())
    problem = PlanningProblem(robot, (JointWaypoint(position=HOME), replace(end, duration=4.0)))
    assert plan(problem, backend).trajectory.duration == pytest.approx(4.0, abs=1e-12)
    shortest = plan(replace(problem, waypoints=(problem.waypoints[0], end)), backend).trajectory.duration
    short = replace(problem, waypoints=(problem.waypoints[0], replace(end, duration=0.5 * shortest)))
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(short, backend)
    needed = refusal.value.remedies[0].value
    assert needed == pytest.approx(shortest, rel=1e-3)
    assert plan(
        replace(problem, waypoints=(problem.waypoints[0], replace(end, duration=needed))), backend
    ).certificate.satisfied


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "quintic"])
def test_durations_of_segments_that_are_passed(robot: Robot, kind: str) -> None:
    """All are given, some are given, or too short: the remedies, applied together, work."""
    waypoints = [
        JointWaypoint(position=HOME),
        PoseWaypoint(pose=shifted(robot, (0, -0.2, 0)), motion=LinearMotion(), transition=BlendTransition(0.05)),
        PoseWaypoint(pose=shifted(robot, (0, -0.2, -0.2)), motion=LinearMotion(), transition=BlendTransition(0.05)),
        JointWaypoint(position=HOME),
    ]
    for durations in ((3.0, 2.5, 3.0), (3.0, None, None), (None, 4.0, None)):
        requested = [waypoints[0], *(replace(w, duration=d) for w, d in zip(waypoints[1:], durations, strict=True))]
        lasted = np.diff(planned(robot, requested, kind).trajectory.arrivals)
        for got, wanted in zip(lasted, durations, strict=True):
            assert wanted is None or got == pytest.approx(wanted, abs=1e-9)
    short = [waypoints[0], *(replace(w, duration=0.2) for w in waypoints[1:])]
    with pytest.raises(InfeasibleDuration) as refusal:
        planned(robot, short, kind)
    problem = PlanningProblem(robot, tuple(short))
    for remedy in refusal.value.remedies:
        problem = remedy.applied_to(problem)
    assert plan(problem, BACKENDS[kind]()).certificate.satisfied


def test_a_dwell_needs_a_stop_and_the_ends_are_stops(robot: Robot) -> None:
    end = shifted(robot, (0.0, -0.2, 0.0))
    waypoints = (
        JointWaypoint(position=HOME, transition=ThroughTransition(), motion=LinearMotion()),
        PoseWaypoint(pose=end, transition=ThroughTransition(), dwell=1.0),
        JointWaypoint(position=HOME, transition=BlendTransition(0.1)),
    )
    with pytest.raises(InvalidProblem) as refusal:
        planned(robot, waypoints)
    assert {field for field, _ in refusal.value.faults} == {
        ("waypoints", 0, "motion"),
        ("waypoints", 0, "transition"),
        ("waypoints", 1, "dwell"),
        ("waypoints", 2, "transition"),
    }
