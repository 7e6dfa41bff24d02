"""The Ruckig back end against the library's own calls, textbook times and dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig

from planner.backends import Ruckig
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, JointPositionLimit, LimitsUnsatisfiable
from planner.kinematics import forward_kinematics, tool_speeds
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    Motion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import Joint, load_robot
from planner.robots.payload import Payload
from planner.spatial import Pose
from tests.planner.backends.ruckig.ruckig_problems import (
    assert_within_limits,
    durations_of,
    line,
    one_joint,
    passing,
    shortest_time,
    with_durations,
)
from tests.planner.problems_of_tests import problem_of

ARM = load_robot("kuka_kr16_l6_2")
START = np.array([0.0, -1.57, 1.57, 0.0, 0.5, 0.0])
TOOL = forward_kinematics(ARM, START[None])[0]
VIA, BESIDE = (TOOL.position + np.array(way) for way in ((0.05, 0.05, 0.0), (0.0, 0.1, 0.0)))


def ruckig_between(
    problem: PlanningProblem, segment: int, synchronization: ruckig.Synchronization
) -> ruckig.Trajectory:
    robot = problem.robot
    target = ruckig.InputParameter(robot.dof)
    target.current_position = list(problem.waypoints[segment].position)
    target.target_position = list(problem.waypoints[segment + 1].position)
    target.max_velocity, target.max_acceleration = (
        robot.limit("velocity").tolist(),
        robot.limit("acceleration").tolist(),
    )
    target.max_jerk = robot.limit("jerk").tolist()
    target.synchronization = synchronization
    result = ruckig.Trajectory(robot.dof)
    assert ruckig.Ruckig(robot.dof).calculate(target, result) == ruckig.Result.Working
    return result


@pytest.mark.parametrize("synchronization", ["phase", "time"])
@pytest.mark.parametrize("scale", [1e-4, 1e-2, 0.3, 1.0])
@pytest.mark.parametrize("robot_id", ["ngv_refuelling_arm", "three_dof_arm"])
def test_stopping_is_what_the_library_computes(robot_id: str, scale: float, synchronization: str) -> None:
    """One call moves all joints by the library's own synchronisation; by phase, the positions agree all the way."""
    problem = problem_of(robot_id, 5, 4, scale)
    result = plan(problem, Ruckig(synchronization=synchronization))
    assert_within_limits(result)
    for segment, duration in enumerate(durations_of(result)):
        peer = ruckig_between(problem, segment, getattr(ruckig.Synchronization, synchronization.title()))
        assert duration == pytest.approx(peer.duration, rel=1e-8)
        if synchronization == "phase":
            for share in np.linspace(0.0, 1.0, 41):
                at = result.trajectory.departures[segment] + share * duration
                own = result.trajectory.evaluate(np.array([at]), [0])[0][0]
                assert own == pytest.approx(peer.at_time(share * peer.duration)[0], abs=1e-7 * max(scale, 1e-2))


@pytest.mark.parametrize("travel", [1e-5, 1e-3, 0.05, 0.4, 3.0])
@pytest.mark.parametrize(("v", "a", "j"), [(1.0, 3.0, 20.0), (2.0, 1.0, 500.0), (0.1, 10.0, 5.0)])
def test_a_single_joint_takes_the_time_of_the_textbook(travel: float, v: float, a: float, j: float) -> None:
    robot = one_joint(velocity=v, acceleration=a, jerk=j)
    expected = shortest_time(travel, v, a, j)
    assert plan(line(robot, 0.0, travel), Ruckig()).trajectory.duration == pytest.approx(expected, rel=1e-9)
    assert plan(line(robot, 0.0, travel), Ruckig(synchronization="time")).trajectory.duration == pytest.approx(
        expected, rel=1e-8
    )


def test_time_synchronisation_bends_straight_lines_and_phase_does_not() -> None:
    """library-pitfalls.md, 12."""
    problem = problem_of("ngv_refuelling_arm", 5, 2)
    start, end = (np.array(waypoint.position) for waypoint in problem.waypoints)
    bends = {}
    for synchronization in ("phase", "time"):
        trajectory = plan(problem, Ruckig(synchronization=synchronization)).trajectory
        (position,) = trajectory.evaluate(np.linspace(0.0, trajectory.duration, 501), [0])
        along = (position - start) @ (end - start) / ((end - start) @ (end - start))
        bends[synchronization] = np.abs(position - start - along[:, None] * (end - start)).max()
    assert bends["phase"] < 1e-12
    assert bends["time"] > 0.01


@pytest.mark.parametrize("synchronization", ["phase", "time"])
@pytest.mark.parametrize("factor", [1.0 + 1e-9, 1.3, 5.0, 1e4])
def test_asked_durations_of_stops_are_exact(synchronization: str, factor: float) -> None:
    """At 1e4 times the duration, the library's own minimum duration fails (library-pitfalls.md, 11)."""
    problem = problem_of("ngv_refuelling_arm", 9, 4)
    requested = durations_of(plan(problem, Ruckig(synchronization=synchronization))) * factor
    result = plan(
        with_durations(problem, dict(enumerate(requested.tolist(), start=1))), Ruckig(synchronization=synchronization)
    )
    assert durations_of(result) == pytest.approx(requested, rel=1e-9)
    assert_within_limits(result)


def test_a_failing_call_of_the_library_has_no_name() -> None:
    """library-pitfalls.md, 11: too long a motion raises a ValueError; a jerk of zero passes the validation only."""
    target, output = ruckig.InputParameter(1), ruckig.Trajectory(1)
    target.target_position, target.max_velocity, target.max_acceleration, target.max_jerk = [1.0], [1.0], [2.0], [10.0]
    target.minimum_duration = 1e4
    with pytest.raises(ValueError, match="-101"):
        ruckig.Ruckig(1).calculate(target, output)
    target.minimum_duration, target.max_jerk = None, [0.0]
    assert ruckig.Ruckig(1).validate_input(target)
    with pytest.raises(ruckig.RuckigError):
        ruckig.Ruckig(1).calculate(target, output)
    # Ours: the same duration, as a pass through a waypoint too.
    robot = one_joint(velocity=1.0, acceleration=2.0, jerk=10.0)
    problem = with_durations(passing(line(robot, 0.0, 1.0, 2.0)), {1: 1e4})
    assert durations_of(plan(problem, Ruckig()))[0] == pytest.approx(1e4, rel=1e-12)


@pytest.mark.large_only
def test_the_library_leaves_the_box_and_its_extrema_miss_it() -> None:
    """See library-pitfalls.md, 10: where accelerations are not 0, its `position_extrema` do not even show it."""
    target, output = ruckig.InputParameter(1), ruckig.Trajectory(1)
    target.max_velocity, target.max_acceleration, target.max_jerk = [1.0], [3.0], [20.0]
    target.current_velocity, target.current_acceleration = [-0.795618399727763], [-0.9328288493890713]
    target.target_position = [0.6317071082430643]
    target.target_velocity, target.target_acceleration = [0.5718468425401111], [0.45931089285988813]
    target.min_position = [-0.1]
    assert ruckig.Ruckig(1).calculate(target, output) == ruckig.Result.Working
    lowest = min(output.at_time(t)[0][0] for t in np.linspace(0.0, output.duration, 2001))
    assert lowest < -0.2
    assert output.position_extrema[0].min > lowest + 0.05
    robot = load_robot("kuka_kr16_2")
    lower, upper = robot.limit("lower"), robot.limit("upper")
    shares = ([0.5] * 6, [1.0] * 6, [0.9] * 6, [0.999] * 6, [0.02] * 6, [0.0] * 6, [0.3] * 6)
    positions = np.clip(lower + np.array(shares) * (upper - lower), lower, upper)
    waypoints = tuple(JointWaypoint(position=tuple(position.tolist())) for position in positions)
    result = plan(passing(PlanningProblem(robot, waypoints)), Ruckig())
    assert_within_limits(result)


def test_a_motion_may_begin_and_end_in_motion() -> None:
    problem = passing(problem_of("ngv_refuelling_arm", 3, 4, 0.5))
    options = {
        "initial_velocity": (0.5, -0.4, 0.3, 1.0, -1.0, 2.0),
        "initial_acceleration": (1.0, 1.0, -2.0, 5.0, 5.0, -5.0),
        "final_velocity": (-0.2, 0.4, 0.3, 1.0, 1.0, -2.0),
    }
    result = plan(problem, Ruckig(**options))
    assert_within_limits(result)
    ends = np.array([0.0, result.trajectory.duration])
    _, velocity, acceleration = result.trajectory.evaluate(ends, [0, 1, 2])
    assert velocity == pytest.approx(np.array([options["initial_velocity"], options["final_velocity"]]), abs=1e-9)
    assert acceleration == pytest.approx(np.array([options["initial_acceleration"], [0.0] * 6]), abs=1e-8)
    assert result.trajectory.duration != pytest.approx(plan(problem, Ruckig()).trajectory.duration, rel=1e-3)


def test_a_line_with_the_motion_along_it_stays_straight() -> None:
    problem = problem_of("ngv_refuelling_arm", 3, 2, 0.5)
    start, end = (np.array(waypoint.position) for waypoint in problem.waypoints)
    speed = tuple((0.1 * (end - start)).tolist())
    result = plan(problem, Ruckig(initial_velocity=speed))
    assert_within_limits(result)
    (position,) = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 101), [0])
    along = (position - start) @ (end - start) / ((end - start) @ (end - start))
    assert np.abs(position - start - along[:, None] * (end - start)).max() < 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("motion", "named"),
    [
        (LinearMotion(), "the line to waypoint 2"),
        (CircularMotion(Pose(VIA)), "the circle to waypoint 2"),
        (PolylineMotion([Pose(VIA)], 0.01), "the polyline to waypoint 2"),
        (SplineMotion([Pose(VIA, TOOL.rotation)]), "the spline to waypoint 2"),
    ],
)
def test_motions_of_the_tool_begin_and_end_at_rest_and_say_what_helps(motion: Motion, named: str) -> None:
    """Passed at a speed, they are refused by name; beside a joint motion, with a stop between, they are planned."""
    there = JointWaypoint(START)
    back = PoseWaypoint(Pose(BESIDE, TOOL.rotation), motion=motion)
    away = JointWaypoint(START - 0.2)
    begins, ends = Ruckig(initial_velocity=(0.05,) * 6), Ruckig(final_velocity=(0.05,) * 6)
    passed = replace(there, transition=ThroughTransition())
    for backend, waypoints, side in (
        (begins, (away, passed, back), "before"),
        (ends, (away, there, back), "after"),
    ):
        with pytest.raises(InvalidProblem) as invalid:
            plan(PlanningProblem(ARM, waypoints), backend)
        ((_, message),) = invalid.value.faults
        expected = f"{named} begins and ends at rest; add a joint motion {side} it, with a stop between them"
        assert message == expected
    assert_within_limits(plan(PlanningProblem(ARM, (away, there, back)), begins))
    assert_within_limits(plan(PlanningProblem(ARM, (there, back, away)), ends))


def test_a_blend_begins_and_ends_at_rest() -> None:
    blended = JointWaypoint(START + 0.1, transition=BlendTransition(0.02))
    problem = PlanningProblem(ARM, (JointWaypoint(START), blended, JointWaypoint(START - 0.1)))
    with pytest.raises(InvalidProblem, match="the blend at waypoint 1 begins and ends at rest"):
        plan(problem, Ruckig(initial_velocity=(0.05,) * 6))


def test_motion_at_the_ends_is_held_against_robot_waypoints_and_limits() -> None:
    problem = problem_of("three_dof_arm", 3, 3)
    with pytest.raises(InvalidProblem) as invalid:
        plan(problem, Ruckig(initial_velocity=(0.1,), final_velocity=(0.1, 0.2)))
    assert [field for field, _ in invalid.value.faults] == [
        ("backend", "initial_velocity"),
        ("backend", "final_velocity"),
    ]
    first, *rest = problem.waypoints
    resting = replace(problem, waypoints=(replace(first, dwell=1.0), *rest))
    with pytest.raises(InvalidProblem) as invalid:
        plan(resting, Ruckig(initial_velocity=(0.1, 0.0, 0.0)))
    assert invalid.value.faults[0][0] == ("waypoints", 0, "dwell")

    velocity = float(problem.robot.limit("velocity")[1])
    acceleration, jerk = float(problem.robot.limit("acceleration")[1]), float(problem.robot.limit("jerk")[1])
    # The gain in speed while the acceleration falls to zero: a^2 / (2 j).
    nearly = velocity - 0.9 * acceleration**2 / (2.0 * jerk)
    for backend, value in (
        (Ruckig(initial_velocity=(0.0, velocity * 1.01, 0.0)), velocity * 1.01),
        (Ruckig(final_velocity=(0.0, -velocity * 1.01, 0.0)), -velocity * 1.01),
        (Ruckig(initial_acceleration=(0.0, acceleration * 1.01, 0.0)), acceleration * 1.01),
        (
            Ruckig(initial_velocity=(0.0, nearly, 0.0), initial_acceleration=(0.0, acceleration, 0.0)),
            nearly + acceleration**2 / (2.0 * jerk),
        ),
    ):
        with pytest.raises(LimitsUnsatisfiable) as refusal:
            plan(problem, backend)
        assert (refusal.value.joint, refusal.value.value) == (problem.robot.joint_names[1], pytest.approx(value))
        (remedy,) = refusal.value.remedies
        assert plan(problem, remedy.applied_to_backend(backend)).certificate.satisfied


def test_running_into_a_position_limit_is_refused() -> None:
    robot = load_robot("kuka_kr16_2")
    near = (robot.limit("upper") - 0.01).tolist()
    waypoints = JointWaypoint(position=tuple(near)), JointWaypoint(position=(0.0, -1.0, 1.0, 0.0, 0.0, 0.0))
    problem = PlanningProblem(robot, waypoints)
    with pytest.raises(JointPositionLimit) as refusal:
        plan(problem, Ruckig(initial_velocity=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    assert refusal.value.joint == robot.joint_names[0]
    (remedy,) = refusal.value.remedies
    assert (remedy.field, remedy.value) == (("backend", "initial_velocity"), None)
    assert plan(problem, Ruckig()).certificate.satisfied


def test_an_acceleration_out_of_a_position_limit_is_refused_by_its_own_name() -> None:
    robot = load_robot("kuka_kr16_2")
    at_limit = (float(robot.limit("upper")[0]), -1.0, 1.0, 0.0, 0.0, 0.0)
    waypoints = tuple(JointWaypoint(position=position) for position in (at_limit, (0.0, -1.0, 1.0, 0.0, 0.0, 0.0)))
    backend = Ruckig(initial_acceleration=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(JointPositionLimit) as refusal:
        plan(PlanningProblem(robot, waypoints), backend)
    (remedy,) = refusal.value.remedies
    assert (remedy.field, remedy.value) == (("backend", "initial_acceleration"), None)


@pytest.mark.long_table
@pytest.mark.parametrize("transition", ["stop", "through"])
@pytest.mark.parametrize("synchronization", ["phase", "time"])
def test_tool_speed_and_torque_limits_are_kept(transition: str, synchronization: str) -> None:
    problem = replace(problem_of("kuka_kr16_l6_2", 19, 4), payload=Payload(6.0, (0.0, 0.0, 0.1)))
    problem = passing(problem) if transition == "through" else problem
    free = plan(problem, Ruckig(synchronization=synchronization))
    torque = next(check for check in free.certificate.checks if check.quantity == "torque")
    limit = np.array(problem.robot.limit("torque")) * min(1.0, torque.ratio or 1.0) * 0.8
    slower = plan(
        replace(problem, limits=Limits(torque=tuple(limit.tolist()), tcp_linear_velocity=0.5)),
        Ruckig(synchronization=synchronization),
    )
    assert_within_limits(slower)
    times = np.linspace(0.0, slower.trajectory.duration, 4001)
    states = slower.trajectory.evaluate(times)
    used = (np.abs(inverse_dynamics(slower.path.robot, *states)) / limit).max()
    speed = tool_speeds(slower.path.robot, *states[:2])[0].max() / 0.5
    assert max(used, speed) <= 1.0
    assert max(used, speed) > 0.9
    assert slower.trajectory.duration > free.trajectory.duration


@pytest.mark.parametrize("synchronization", ["phase", "time"])
def test_missing_limits_are_not_made_up_where_others_set_the_time(synchronization: str) -> None:
    """Without velocity or acceleration limits, other joints set the time.

    Without a jerk limit, accelerations jump, as the plan says.
    """
    expected = {
        (np.inf, 2.0, 20.0): shortest_time(1.0, 1e6, 2.0, 20.0),
        (0.7, np.inf, 20.0): shortest_time(1.0, 0.7, 1e6, 20.0),
        (np.inf, np.inf, 20.0): 4.0 * np.cbrt(1.0 / 40.0),
        (np.inf, 2.0, np.inf): 2.0 * np.sqrt(1.0 / 2.0),
        (0.7, 2.0, np.inf): 1.0 / 0.7 + 0.7 / 2.0,
        (0.7, np.inf, np.inf): 2.0 / 0.7,
    }
    for (v, a, j), duration in expected.items():
        robot, backend = one_joint(velocity=v, acceleration=a, jerk=j), Ruckig(synchronization=synchronization)
        result = plan(line(robot, 0.0, 1.0), backend)
        assert result.trajectory.duration == pytest.approx(duration, rel=1e-8)
        assert result.certificate.continuity == ("C1" if np.isfinite(a) and np.isinf(j) else "C2")
        through = plan(passing(line(robot, 0.0, 1.0, 2.0)), backend)
        assert through.trajectory.duration <= 2.0 * duration * (1.0 + 1e-8)


def test_nothing_that_sets_a_time_is_refused_until_a_duration_is_asked() -> None:
    robot = load_robot("three_dof_arm")
    unlimited = replace(robot, joints=tuple(Joint(joint.name, joint.kind) for joint in robot.joints))
    problem = line(unlimited, 0.0, 1.0)
    for backend in (Ruckig(), Ruckig(synchronization="time")):
        with pytest.raises(LimitsUnsatisfiable) as refusal:
            plan(problem, backend)
        assert refusal.value.remedies[0].field == ("waypoints", 1, "duration")
        assert plan(with_durations(problem, {1: 2.0}), backend).trajectory.duration == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize("transition", ["stop", "through"])
@pytest.mark.parametrize("synchronization", ["phase", "time"])
def test_a_duration_too_short_is_refused_with_a_remedy_that_works(transition: str, synchronization: str) -> None:
    problem = problem_of("ngv_refuelling_arm", 13, 4)
    problem = with_durations(passing(problem) if transition == "through" else problem, {2: 0.05})
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(problem, Ruckig(synchronization=synchronization))
    assert (refusal.value.segment, refusal.value.value) == (1, 0.05)
    assert refusal.value.joint in problem.robot.joint_names
    (remedy,) = refusal.value.remedies
    result = plan(with_durations(problem, {2: remedy.value}), Ruckig(synchronization=synchronization))
    assert durations_of(result)[1] == pytest.approx(remedy.value, rel=1e-9)
