"""The Ruckig back end through waypoints, against brute force, another optimiser and dense samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import casadi
import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import Ruckig, Toppra
from planner.backends.ruckig.state_to_state import Synchronization
from planner.backends.ruckig.via_groups import least_stopping_time
from planner.errors import InfeasibleDuration, JointPositionLimit
from planner.kinematics import tool_speeds
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import PlanningProblem
from tests.planner.backends.ruckig.ruckig_problems import (
    RATES,
    assert_within_limits,
    durations_of,
    line,
    one_joint,
    passing,
    shortest_time,
    with_durations,
)
from tests.planner.problems_of_tests import ARMS, problem_of


@pytest.mark.long_table
@pytest.mark.parametrize("scale", [1e-4, 0.03, 1.0])
@pytest.mark.parametrize("robot_id", ARMS)
def test_passing_waypoints_keeps_all_limits_and_is_never_slower_than_stopping(robot_id: str, scale: float) -> None:
    for seed in range(3):
        stops = problem_of(robot_id, seed, 6, scale)
        result, stopping = plan(passing(stops), Ruckig()), plan(stops, Ruckig(synchronization="time"))
        assert_within_limits(result)
        assert result.trajectory.duration <= stopping.trajectory.duration * (1.0 + 1e-9)
        # No motion is faster than full speed all the way.
        travels = np.abs(np.diff(result.path.positions, axis=0))
        assert result.trajectory.duration > (travels / stops.robot.limit("velocity")).max(axis=1).sum()
        peak = max(check.ratio or 0.0 for check in result.certificate.checks if check.quantity != "position")
        assert peak == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_the_least_time_of_stopping_is_that_of_the_slowest_joint_by_single_calls_of_the_library(seed: int) -> None:
    path = plan(passing(problem_of("ur5e", seed, 4, 0.5)), Toppra()).path
    limits = path.limits.of(np.arange(len(path.positions) - 1))
    travels = np.diff(path.positions, axis=0)
    target, output, library = ruckig.InputParameter(1), ruckig.Trajectory(1), ruckig.Ruckig(1)
    total = 0.0
    for segment, travel in enumerate(travels):
        times = []
        for joint, distance in enumerate(travel):
            rates = (limits.bounds(quantity).upper[segment, joint] for quantity in RATES)
            target.max_velocity, target.max_acceleration, target.max_jerk = ([rate] for rate in rates)
            target.target_position = [distance]
            library.calculate(target, output)
            times.append(output.duration)
        total += max(times)
    assert least_stopping_time(travels, limits) == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize(("end", "gain"), [(2.0, 0.2), (1.4, 0.2), (0.9, 0.0)])
def test_passing_one_waypoint_is_as_fast_as_brute_force_finds(end: float, gain: float) -> None:
    """One joint passes 1 rad; single calls of the library try every velocity and acceleration there on a grid."""
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
    found = plan(passing(problem), Ruckig()).trajectory.duration
    assert best * 0.99 < found <= best * 1.002
    assert 1.0 - found / plan(problem, Ruckig()).trajectory.duration >= gain


def least_duration(problem: PlanningProblem, pieces: int) -> float:
    """Optimise the duration, s, of a motion through the waypoints with pieces of constant jerk, by CasADi and IPOPT.

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


@pytest.mark.long_table
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
    """Some of these were 0.8 to 1.4 % slower, as joints could wait for others only in ranges of durations."""
    problem = problem_of(robot_id, seed, 6, scale)
    robot = replace(problem.robot, joints=tuple(replace(joint, torque=np.inf) for joint in problem.robot.joints))
    problem = replace(problem, robot=robot)
    found = plan(passing(problem), Ruckig()).trajectory.duration
    assert 0.97 < found / least_duration(problem, 24) < 1.004


@settings(max_examples=settings.default.max_examples // 4)
@given(seed=st.integers(0, 2**32), data=st.data())
def test_passing_with_any_durations_keeps_its_promises(seed: int, data: st.DataObject) -> None:
    """Given durations are kept, or refused with others that are kept, whether or not the ends are at rest."""
    count = data.draw(st.integers(3, 5))
    stops = problem_of(data.draw(st.sampled_from(ARMS)), seed, count, 10.0 ** data.draw(st.floats(-4.0, 0.0)))
    shares = data.draw(
        st.lists(st.sampled_from([None, 0.7, 0.9, 1.0, 1.7, 6.0]), min_size=count - 1, max_size=count - 1)
    )
    requested = {
        k + 1: s * t
        for k, (s, t) in enumerate(zip(shares, durations_of(plan(stops, Ruckig())), strict=True))
        if s is not None
    }
    problem, backend = with_durations(passing(stops), requested), Ruckig()
    if data.draw(st.booleans()):
        share = st.lists(st.floats(-0.1, 0.1), min_size=stops.robot.dof, max_size=stops.robot.dof)
        own = {
            "initial_velocity": np.array(data.draw(share)) * stops.robot.limit("velocity"),
            "initial_acceleration": np.array(data.draw(share)) * stops.robot.limit("acceleration"),
            "final_velocity": np.array(data.draw(share)) * stops.robot.limit("velocity"),
        }
        backend = Ruckig(**{name: tuple(rates.tolist()) for name, rates in own.items()})
    try:
        result = plan(problem, backend)
    except JointPositionLimit:
        return
    except InfeasibleDuration as refusal:
        assert refusal.remedies
        changed = {remedy.field[1]: remedy.value for remedy in refusal.remedies}
        requested |= changed
        result = plan(with_durations(problem, changed), backend)
    assert_within_limits(result)
    for waypoint, duration in requested.items():
        if duration is not None:
            assert durations_of(result)[waypoint - 1] == pytest.approx(duration, rel=1e-9)


def test_waypoints_on_the_way_cost_hardly_anything() -> None:
    """A joint that moves on in one direction passes waypoints in it at almost no cost."""
    problem = passing(line(one_joint(velocity=2.0, acceleration=4.0, jerk=40.0), *np.linspace(0.0, 2.0, 6).tolist()))
    trajectory = plan(problem, Ruckig()).trajectory
    assert trajectory.duration == pytest.approx(shortest_time(2.0, 2.0, 4.0, 40.0), rel=1.5e-2)
    assert all(a < b for a, b in pairwise(trajectory.arrivals))


@pytest.mark.long_table
@pytest.mark.parametrize("speed", [0.1, 0.5])
@pytest.mark.parametrize("synchronization", ["phase", "time"])
@pytest.mark.parametrize("robot_id", ["kuka_kr16_l6_2", "date_sorting_arm", "ngv_refuelling_arm"])
def test_where_the_tools_speed_is_limited(robot_id: str, synchronization: Synchronization, speed: float) -> None:
    """The motion is never slower than with stops, nor than the best time scaling along toppra's smooth curve."""
    for seed in range(2):
        stops = problem_of(robot_id, seed, 4, 0.3)
        limits = Limits(tcp_linear_velocity=speed)
        stops, backend = replace(stops, limits=limits), Ruckig(synchronization=synchronization)
        along = plan(passing(stops), Toppra(jerk_limited=True))
        result, stopping = plan(passing(stops), backend), plan(stops, backend)
        assert_within_limits(result)
        assert result.trajectory.duration <= stopping.trajectory.duration * (1.0 + 1e-9)
        assert result.trajectory.duration <= along.trajectory.duration * (1.0 + 1e-3)


def test_a_straight_line_is_slow_only_where_the_tool_is_fast() -> None:
    """A limit of the tool's speed stretched the time scaling as a whole: nearly twice the duration."""
    problem = problem_of("kuka_kr16_l6_2", 0, 2, 0.3)
    free, slow = plan(problem, Ruckig()), plan(replace(problem, limits=Limits(tcp_linear_velocity=0.3)), Ruckig())
    speeds = [tool_speeds(problem.robot, *evenly(result, [0, 1]))[0] for result in (free, slow)]
    assert speeds[1].max() <= 0.3
    assert np.median(speeds[1]) > 0.98 * 0.3
    assert slow.trajectory.duration < 0.7 * free.trajectory.duration * speeds[0].max() / 0.3
    requested = with_durations(slow.problem, {1: slow.trajectory.duration})
    assert plan(requested, Ruckig()).trajectory.duration == slow.trajectory.duration
    hurried = with_durations(slow.problem, {1: 0.99 * slow.trajectory.duration})
    with pytest.raises(InfeasibleDuration, match="the limit of the tool's speed") as refusal:
        plan(hurried, Ruckig())
    assert refusal.value.limit == pytest.approx(slow.trajectory.duration, rel=1e-3)


def evenly(result: Plan, orders: list[int]) -> list[np.ndarray]:
    """Return 2,001 samples of the motion."""
    return list(result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 2001), orders))
