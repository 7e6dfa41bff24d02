"""The Ruckig back end against the library's own calls, brute force and dense samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi
import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import Ruckig
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, JointPositionLimit, LimitsUnsatisfiable
from planner.kinematics import tool_speeds
from planner.plan import Plan, plan
from planner.problem import JointWaypoint, Limits, Payload, PlanningProblem, ThroughTransition
from planner.robots import Joint, Robot, load_robot
from tests.planner.problems import ARMS, problem_of

RATES = ("velocity", "acceleration", "jerk")


def passing(problem: PlanningProblem) -> PlanningProblem:
    """The same waypoints, the inner ones passed without stopping."""
    first, *inner, last = problem.waypoints
    inner = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
    return replace(problem, waypoints=(first, *inner, last))


def with_durations(problem: PlanningProblem, durations: dict[int, Any]) -> PlanningProblem:
    """By waypoint."""
    waypoints = [replace(w, duration=durations.get(i, w.duration)) for i, w in enumerate(problem.waypoints)]
    return replace(problem, waypoints=tuple(waypoints))


def durations_of(result: Plan) -> np.ndarray:
    return result.trajectory.arrivals[1:] - result.trajectory.departures[:-1]


def one_joint(**limits: float) -> Robot:
    """The first joint of an arm with these limits, the others with wide ones; none of them has position limits."""
    robot = load_robot("three_dof_arm")
    wide = {"velocity": 1e3, "acceleration": 1e4, "jerk": 1e6}
    own = [Joint(joint.name, joint.kind, **(limits if i == 0 else wide)) for i, joint in enumerate(robot.joints)]
    return replace(robot, joints=tuple(own))


def line(robot: Robot, *angles: float, **options: Any) -> PlanningProblem:
    """The first joint to these angles; the others stand still."""
    waypoints = tuple(JointWaypoint(position=(angle, 0.0, 0.0)) for angle in angles)
    return PlanningProblem(robot, waypoints, Ruckig(**options))


def assert_within_limits(result: Plan) -> None:
    """By 20,000 samples, and the state that is due at the waypoints; not by the certificate."""
    trajectory, limits = result.trajectory, result.path.limits
    times = np.linspace(0.0, trajectory.duration, 20001)
    position, *rates = trajectory.evaluate(times, [0, 1, 2, 3])
    segments = trajectory.segments[trajectory.locate(times)[0]]
    assert (position >= limits.lower - 1e-9).all()
    assert (position <= limits.upper + 1e-9).all()
    for quantity, values in zip(RATES, rates, strict=True):
        assert (np.abs(values) / getattr(limits, quantity)[segments]).max() <= 1.0 + 2e-9, quantity
    met = trajectory.evaluate(trajectory.arrivals, [0])[0]
    assert np.abs(met - result.path.positions).max() <= 1e-9
    assert result.certificate.continuity == "C2"


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
    """At once for all joints, by its own synchronisation; and the same positions all the way where it is by phase."""
    problem = replace(problem_of(robot_id, "ruckig", 5, 4, scale), backend=Ruckig(synchronization=synchronization))
    result = plan(problem)
    assert_within_limits(result)
    for segment, duration in enumerate(durations_of(result)):
        peer = ruckig_between(problem, segment, getattr(ruckig.Synchronization, synchronization.title()))
        assert duration == pytest.approx(peer.duration, rel=1e-8)
        if synchronization == "phase":
            for share in np.linspace(0.0, 1.0, 41):
                at = result.trajectory.departures[segment] + share * duration
                own = result.trajectory.evaluate(np.array([at]), [0])[0][0]
                assert own == pytest.approx(peer.at_time(share * peer.duration)[0], abs=1e-7 * max(scale, 1e-2))


def shortest_time(d: float, v: float, a: float, j: float) -> float:
    """S, jerk-limited from rest to rest, by bisection on the cruise speed; the ramps by the two cases of a textbook."""

    def ramp(speed: float) -> float:
        return 2.0 * np.sqrt(speed / j) if speed <= a**2 / j else speed / a + a / j

    low, high = 0.0, v
    for _ in range(200):
        middle = (low + high) / 2.0
        low, high = (middle, high) if middle * ramp(middle) <= d else (low, middle)
    return 2.0 * ramp(low) + (d - low * ramp(low)) / low


@pytest.mark.parametrize("travel", [1e-5, 1e-3, 0.05, 0.4, 3.0])
@pytest.mark.parametrize(("v", "a", "j"), [(1.0, 3.0, 20.0), (2.0, 1.0, 500.0), (0.1, 10.0, 5.0)])
def test_a_single_joint_takes_the_time_of_the_textbook(travel: float, v: float, a: float, j: float) -> None:
    robot = one_joint(velocity=v, acceleration=a, jerk=j)
    expected = shortest_time(travel, v, a, j)
    assert plan(line(robot, 0.0, travel)).trajectory.duration == pytest.approx(expected, rel=1e-9)
    assert plan(line(robot, 0.0, travel, synchronization="time")).trajectory.duration == pytest.approx(
        expected, rel=1e-8
    )


def test_time_synchronisation_bends_straight_lines_and_phase_does_not() -> None:
    """library-pitfalls.md, 12."""
    problem = problem_of("ngv_refuelling_arm", "ruckig", 5, 2)
    start, end = (np.array(waypoint.position) for waypoint in problem.waypoints)
    bends = {}
    for synchronization in ("phase", "time"):
        trajectory = plan(replace(problem, backend=Ruckig(synchronization=synchronization))).trajectory
        (position,) = trajectory.evaluate(np.linspace(0.0, trajectory.duration, 501), [0])
        along = (position - start) @ (end - start) / ((end - start) @ (end - start))
        bends[synchronization] = np.abs(position - start - along[:, None] * (end - start)).max()
    assert bends["phase"] < 1e-12
    assert bends["time"] > 0.01


@pytest.mark.parametrize("synchronization", ["phase", "time"])
@pytest.mark.parametrize("factor", [1.0 + 1e-9, 1.3, 5.0, 1e4])
def test_asked_durations_of_stops_are_exact(synchronization: str, factor: float) -> None:
    """1e4 times: the library's own minimum duration fails there (library-pitfalls.md, 11)."""
    problem = replace(problem_of("ngv_refuelling_arm", "ruckig", 9, 4), backend=Ruckig(synchronization=synchronization))
    asked = durations_of(plan(problem)) * factor
    result = plan(with_durations(problem, dict(enumerate(asked.tolist(), start=1))))
    assert durations_of(result) == pytest.approx(asked, rel=1e-9)
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
    assert durations_of(plan(problem))[0] == pytest.approx(1e4, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-4, 0.03, 1.0])
@pytest.mark.parametrize("robot_id", ARMS)
def test_passing_waypoints_keeps_all_limits_and_is_never_slower_than_stopping(robot_id: str, scale: float) -> None:
    for seed in range(3):
        stops = problem_of(robot_id, "ruckig", seed, 6, scale)
        result, stopping = plan(passing(stops)), plan(replace(stops, backend=Ruckig(synchronization="time")))
        assert_within_limits(result)
        assert result.trajectory.duration <= stopping.trajectory.duration * (1.0 + 1e-9)
        # No motion is faster than full speed all the way.
        travels = np.abs(np.diff(result.path.positions, axis=0))
        assert result.trajectory.duration > (travels / stops.robot.limit("velocity")).max(axis=1).sum()
        peak = max(check.ratio or 0.0 for check in result.certificate.checks if check.quantity != "position")
        assert peak == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("end", "gain"), [(2.0, 0.2), (1.4, 0.2), (0.9, 0.0)])
def test_passing_one_waypoint_is_as_fast_as_brute_force_finds(end: float, gain: float) -> None:
    """One joint, by way of 1 rad; every velocity and acceleration there, on a grid, by single calls of the library."""
    v, a, j = 1.5, 3.0, 20.0
    problem = line(one_joint(velocity=v, acceleration=a, jerk=j), 0.0, 1.0, end)
    target, output, library = ruckig.InputParameter(1), ruckig.Trajectory(1), ruckig.Ruckig(1)
    target.max_velocity, target.max_acceleration, target.max_jerk = [v], [a], [j]
    best = np.inf
    for speed in np.linspace(-v, v, 61):
        for surge in np.linspace(-a, a, 61):
            if abs(speed) + surge**2 / (2.0 * j) > v:
                continue
            total = 0.0
            for travel, at_start in ((1.0, False), (end - 1.0, True)):
                rates = [float(speed)], [float(surge)]
                rest = [0.0], [0.0]
                target.target_position = [travel]
                target.current_velocity, target.current_acceleration = rates if at_start else rest
                target.target_velocity, target.target_acceleration = rest if at_start else rates
                assert library.calculate(target, output) == ruckig.Result.Working
                total += output.duration
            best = min(best, total)
    found = plan(passing(problem)).trajectory.duration
    assert best * 0.99 < found <= best * 1.002
    assert 1.0 - found / plan(problem).trajectory.duration >= gain


def least_duration(problem: PlanningProblem, pieces: int) -> float:
    """S, of a motion through the waypoints with some pieces of constant jerk in each segment, by CasADi and IPOPT.

    Its limits hold at the Bezier points of each piece, so that it is one that can be driven: no shorter than the best.
    """
    robot, q = problem.robot, np.array([waypoint.position for waypoint in problem.waypoints])
    (segments, joints), count = np.diff(q, axis=0).shape, (len(q) - 1) * pieces
    opti = casadi.Opti()
    times = opti.variable(1, segments)
    p, v, a = (opti.variable(joints, count + 1) for _ in range(3))
    h = casadi.repmat(casadi.reshape(casadi.repmat(times / pieces, pieces, 1), 1, count), joints, 1)
    p0, p1, v0, v1, a0, a1 = p[:, :-1], p[:, 1:], v[:, :-1], v[:, 1:], a[:, :-1], a[:, 1:]
    opti.subject_to(v1 == v0 + h * (a0 + a1) / 2.0)
    opti.subject_to(p1 == p0 + h * v0 + h**2 * (2.0 * a0 + a1) / 6.0)
    opti.subject_to(p[:, ::pieces] == q.T)
    for end in (0, -1):
        opti.subject_to(v[:, end] == 0.0)
        opti.subject_to(a[:, end] == 0.0)
    velocity, acceleration, jerk = (robot.limit(quantity)[:, None] for quantity in RATES)
    bounded = [(v, velocity), (v0 + h * a0 / 2.0, velocity), (a, acceleration)]
    for value, limit in bounded:
        wide = np.tile(limit, (1, value.shape[1]))
        opti.subject_to(opti.bounded(-wide.ravel("F"), casadi.vec(value), wide.ravel("F")))
    opti.subject_to(casadi.vec(a1 - a0 - h * jerk) <= 0.0)
    opti.subject_to(casadi.vec(a0 - a1 - h * jerk) <= 0.0)
    lower, upper = (np.tile(robot.limit(side)[:, None], (1, count)).ravel("F") for side in ("lower", "upper"))
    for inner in (p0 + h * v0 / 3.0, p1 - h * v1 / 3.0):
        opti.subject_to(opti.bounded(lower, casadi.vec(inner), upper))
    opti.minimize(casadi.sum2(times))
    opti.set_initial(times, 1.0)
    opti.set_initial(p, np.hstack([np.repeat(q[:-1], pieces, axis=0).T, q[-1:].T]))
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 500})
    return float(opti.solve().value(casadi.sum2(times)))


@pytest.mark.parametrize(
    ("robot_id", "seed", "scale"),
    [
        ("kuka_kr16_l6_2", 2, 1.0),
        ("kuka_kr16_l6_2", 101, 1.0),
        ("kuka_kr16_l6_2", 1, 0.3),
        ("ngv_refuelling_arm", 4, 1.0),
        ("date_sorting_arm", 5, 0.1),
    ],
)
def test_passing_waypoints_is_as_fast_as_an_independent_optimiser(robot_id: str, seed: int, scale: float) -> None:
    """Some of these were 0.8 to 1.4 % slower, where joints could not wait for others but for ranges of durations."""
    problem = problem_of(robot_id, "ruckig", seed, 6, scale)
    robot = replace(problem.robot, joints=tuple(replace(joint, torque=np.inf) for joint in problem.robot.joints))
    problem = replace(problem, robot=robot)
    found = plan(passing(problem)).trajectory.duration
    assert 0.97 < found / least_duration(problem, 24) < 1.004


def test_the_library_leaves_the_box_and_its_extrema_miss_it() -> None:
    """library-pitfalls.md, 10; where accelerations are not 0, its `position_extrema` do not even show it."""
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
    result = plan(passing(PlanningProblem(robot, waypoints, Ruckig())))
    assert_within_limits(result)


@settings(max_examples=max(50, settings.default.max_examples // 20))
@given(seed=st.integers(0, 2**32), data=st.data())
def test_passing_with_any_durations_keeps_its_promises(seed: int, data: st.DataObject) -> None:
    """Asked durations are kept, or refused with others that are kept; whether the ends are at rest or not."""
    count = data.draw(st.integers(3, 5))
    stops = problem_of(data.draw(st.sampled_from(ARMS)), "ruckig", seed, count, 10.0 ** data.draw(st.floats(-4.0, 0.0)))
    shares = data.draw(
        st.lists(st.sampled_from([None, 0.7, 0.9, 1.0, 1.7, 6.0]), min_size=count - 1, max_size=count - 1)
    )
    asked = {
        k + 1: s * t for k, (s, t) in enumerate(zip(shares, durations_of(plan(stops)), strict=True)) if s is not None
    }
    problem = with_durations(passing(stops), asked)
    if data.draw(st.booleans()):
        share = st.lists(st.floats(-0.1, 0.1), min_size=stops.robot.dof, max_size=stops.robot.dof)
        own = {
            "initial_velocity": np.array(data.draw(share)) * stops.robot.limit("velocity"),
            "initial_acceleration": np.array(data.draw(share)) * stops.robot.limit("acceleration"),
            "final_velocity": np.array(data.draw(share)) * stops.robot.limit("velocity"),
        }
        problem = replace(problem, backend=Ruckig(**{name: tuple(rates.tolist()) for name, rates in own.items()}))
    try:
        result = plan(problem)
    except JointPositionLimit:
        return
    except InfeasibleDuration as refusal:
        assert refusal.remedies
        changed = {int(remedy.change.split("/")[2]): remedy.value for remedy in refusal.remedies}
        asked |= changed
        result = plan(with_durations(problem, changed))
    assert_within_limits(result)
    for waypoint, duration in asked.items():
        if duration is not None:
            assert durations_of(result)[waypoint - 1] == pytest.approx(duration, rel=1e-9)


def test_a_motion_may_begin_and_end_in_motion() -> None:
    problem = passing(problem_of("ngv_refuelling_arm", "ruckig", 3, 4, 0.5))
    options = {
        "initial_velocity": (0.5, -0.4, 0.3, 1.0, -1.0, 2.0),
        "initial_acceleration": (1.0, 1.0, -2.0, 5.0, 5.0, -5.0),
        "final_velocity": (-0.2, 0.4, 0.3, 1.0, 1.0, -2.0),
    }
    result = plan(replace(problem, backend=Ruckig(**options)))
    assert_within_limits(result)
    ends = np.array([0.0, result.trajectory.duration])
    _, velocity, acceleration = result.trajectory.evaluate(ends, [0, 1, 2])
    assert velocity == pytest.approx(np.array([options["initial_velocity"], options["final_velocity"]]), abs=1e-9)
    assert acceleration == pytest.approx(np.array([options["initial_acceleration"], [0.0] * 6]), abs=1e-8)
    assert result.trajectory.duration != pytest.approx(plan(problem).trajectory.duration, rel=1e-3)


def test_a_line_with_the_motion_along_it_stays_straight() -> None:
    problem = problem_of("ngv_refuelling_arm", "ruckig", 3, 2, 0.5)
    start, end = (np.array(waypoint.position) for waypoint in problem.waypoints)
    speed = tuple((0.1 * (end - start)).tolist())
    result = plan(replace(problem, backend=Ruckig(initial_velocity=speed)))
    assert_within_limits(result)
    (position,) = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 101), [0])
    along = (position - start) @ (end - start) / ((end - start) @ (end - start))
    assert np.abs(position - start - along[:, None] * (end - start)).max() < 1e-9


def test_motion_at_the_ends_is_held_against_robot_waypoints_and_limits() -> None:
    problem = problem_of("three_dof_arm", "ruckig", 3, 3)
    with pytest.raises(InvalidProblem) as invalid:
        plan(replace(problem, backend=Ruckig(initial_velocity=(0.1,), final_velocity=(0.1, 0.2))))
    assert [pointer for pointer, _ in invalid.value.faults] == ["/backend/initial_velocity", "/backend/final_velocity"]
    first, *rest = problem.waypoints
    resting = replace(problem, waypoints=(replace(first, dwell=1.0), *rest))
    with pytest.raises(InvalidProblem) as invalid:
        plan(replace(resting, backend=Ruckig(initial_velocity=(0.1, 0.0, 0.0))))
    assert invalid.value.faults[0][0] == "/waypoints/0/dwell"

    velocity = float(problem.robot.limit("velocity")[1])
    acceleration, jerk = float(problem.robot.limit("acceleration")[1]), float(problem.robot.limit("jerk")[1])
    # What is still gained in speed while the acceleration runs out: a^2 / (2 j).
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
            plan(replace(problem, backend=backend))
        assert (refusal.value.joint, refusal.value.value) == (problem.robot.joint_names[1], pytest.approx(value))
        (remedy,) = refusal.value.remedies
        mended = replace(backend, **{remedy.change.split("/")[2]: remedy.value})
        assert plan(replace(problem, backend=mended)).certificate.satisfied


def test_running_into_a_position_limit_is_refused() -> None:
    robot = load_robot("kuka_kr16_2")
    near = (robot.limit("upper") - 0.01).tolist()
    waypoints = JointWaypoint(position=tuple(near)), JointWaypoint(position=(0.0, -1.0, 1.0, 0.0, 0.0, 0.0))
    problem = PlanningProblem(robot, waypoints, Ruckig(initial_velocity=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    with pytest.raises(JointPositionLimit) as refusal:
        plan(problem)
    assert refusal.value.joint == robot.joint_names[0]
    (remedy,) = refusal.value.remedies
    assert (remedy.change, remedy.value) == ("/backend/initial_velocity", None)
    assert plan(replace(problem, backend=Ruckig())).certificate.satisfied


def test_an_acceleration_out_of_a_position_limit_is_refused_by_its_own_name() -> None:
    robot = load_robot("kuka_kr16_2")
    at_limit = (float(robot.limit("upper")[0]), -1.0, 1.0, 0.0, 0.0, 0.0)
    waypoints = tuple(JointWaypoint(position=position) for position in (at_limit, (0.0, -1.0, 1.0, 0.0, 0.0, 0.0)))
    backend = Ruckig(initial_acceleration=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(JointPositionLimit) as refusal:
        plan(PlanningProblem(robot, waypoints, backend))
    (remedy,) = refusal.value.remedies
    assert (remedy.change, remedy.value) == ("/backend/initial_acceleration", None)


@pytest.mark.parametrize("transition", ["stop", "through"])
@pytest.mark.parametrize("synchronization", ["phase", "time"])
def test_tool_speed_and_torque_limits_are_kept(transition: str, synchronization: str) -> None:
    problem = replace(problem_of("kuka_kr16_l6_2", "ruckig", 19, 4), payload=Payload(6.0, (0.0, 0.0, 0.1)))
    problem = replace(problem, backend=Ruckig(synchronization=synchronization))
    problem = passing(problem) if transition == "through" else problem
    free = plan(problem)
    torque = next(check for check in free.certificate.checks if check.quantity == "torque")
    limit = np.array(problem.robot.limit("torque")) * min(1.0, torque.ratio or 1.0) * 0.8
    slower = plan(replace(problem, limits=Limits(torque=tuple(limit.tolist()), tcp_linear_velocity=0.5)))
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
    """No velocity or acceleration limit: the time of the others. No jerk limit: the acceleration jumps, as is said."""
    expected = {
        (np.inf, 2.0, 20.0): shortest_time(1.0, 1e6, 2.0, 20.0),
        (0.7, np.inf, 20.0): shortest_time(1.0, 0.7, 1e6, 20.0),
        (np.inf, np.inf, 20.0): 4.0 * np.cbrt(1.0 / 40.0),
        (np.inf, 2.0, np.inf): 2.0 * np.sqrt(1.0 / 2.0),
        (0.7, 2.0, np.inf): 1.0 / 0.7 + 0.7 / 2.0,
        (0.7, np.inf, np.inf): 2.0 / 0.7,
    }
    for (v, a, j), duration in expected.items():
        robot = one_joint(velocity=v, acceleration=a, jerk=j)
        result = plan(line(robot, 0.0, 1.0, synchronization=synchronization))
        assert result.trajectory.duration == pytest.approx(duration, rel=1e-8)
        assert result.certificate.continuity == ("C1" if np.isfinite(a) and np.isinf(j) else "C2")
        through = plan(passing(line(robot, 0.0, 1.0, 2.0, synchronization=synchronization)))
        assert through.trajectory.duration <= 2.0 * duration * (1.0 + 1e-8)


def test_nothing_that_sets_a_time_is_refused_until_a_duration_is_asked() -> None:
    robot = load_robot("three_dof_arm")
    unlimited = replace(robot, joints=tuple(Joint(joint.name, joint.kind) for joint in robot.joints))
    for problem in (line(unlimited, 0.0, 1.0), line(unlimited, 0.0, 1.0, synchronization="time")):
        with pytest.raises(LimitsUnsatisfiable) as refusal:
            plan(problem)
        assert refusal.value.remedies[0].change == "/waypoints/1/duration"
        assert plan(with_durations(problem, {1: 2.0})).trajectory.duration == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize("transition", ["stop", "through"])
@pytest.mark.parametrize("synchronization", ["phase", "time"])
def test_a_duration_too_short_is_refused_with_a_remedy_that_works(transition: str, synchronization: str) -> None:
    problem = replace(
        problem_of("ngv_refuelling_arm", "ruckig", 13, 4), backend=Ruckig(synchronization=synchronization)
    )
    problem = with_durations(passing(problem) if transition == "through" else problem, {2: 0.05})
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(problem)
    assert (refusal.value.segment, refusal.value.value) == (1, 0.05)
    assert refusal.value.joint in problem.robot.joint_names
    (remedy,) = refusal.value.remedies
    result = plan(with_durations(problem, {2: remedy.value}))
    assert durations_of(result)[1] == pytest.approx(remedy.value, rel=1e-9)


def test_waypoints_on_the_way_cost_hardly_anything() -> None:
    """Alone in its direction, a joint passes them nearly as if they were not there."""
    problem = passing(line(one_joint(velocity=2.0, acceleration=4.0, jerk=40.0), *np.linspace(0.0, 2.0, 6).tolist()))
    trajectory = plan(problem).trajectory
    assert trajectory.duration == pytest.approx(shortest_time(2.0, 2.0, 4.0, 40.0), rel=1.5e-2)
    assert all(a < b for a, b in pairwise(trajectory.arrivals))
