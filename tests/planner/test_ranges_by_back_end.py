"""Limits that differ by direction are used in full: checked against the package ruckig and brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.corpus.promises import keeps_joint_limits
from planner.backends import BackEnd, Cubic, MinEffort, Quintic, Ruckig, Toppra
from planner.backends.jerk_limited.s_curves import s_curves
from planner.backends.splines.interpolation import interpolating_spline
from planner.errors import InfeasibleDuration, JointPositionLimit, LimitsUnsatisfiable
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.spatial import FloatArray
from tests.planner.problems_of_tests import ARMS, problem_of
from tests.planner.tool_problems import ROBOT, START

VELOCITY, ACCELERATION, JERK = (ROBOT.limit(quantity)[0] for quantity in ("velocity", "acceleration", "jerk"))


def first_joint(velocity: tuple[float, float], acceleration: tuple[float, float]) -> Limits:
    """Return limits of the first joint, as shares of the robot's limits; the other joints keep theirs."""

    def ranges(quantity: str, shares: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        own = ROBOT.limit(quantity)
        return ((-shares[0] * own[0], shares[1] * own[0]), *((-limit, limit) for limit in own[1:].tolist()))

    return Limits(velocity_range=ranges("velocity", velocity), acceleration_range=ranges("acceleration", acceleration))


def along(*travels: float) -> list[JointWaypoint]:
    """Return waypoints of the first joint alone, the inner ones passed."""
    positions = START[0] + np.concatenate([[0.0], np.cumsum(travels)])
    return [
        JointWaypoint((float(q), *START[1:]), transition=ThroughTransition() if 0 < k < len(travels) else PASSED)
        for k, q in enumerate(positions)
    ]


PASSED = JointWaypoint(START).transition


def least_time(start: float, end: float, limits: Limits, rates: tuple[FloatArray, FloatArray]) -> float:
    """Return the least duration of the first joint between two states, by one call of the package ruckig."""
    target, output = ruckig.InputParameter(1), ruckig.Trajectory(1)
    assert limits.velocity_range
    assert limits.acceleration_range
    (target.min_velocity, target.max_velocity), (target.min_acceleration, target.max_acceleration) = (
        ([own[0][0]], [own[0][1]]) for own in (limits.velocity_range, limits.acceleration_range)
    )
    target.max_jerk, target.current_position, target.target_position = [JERK], [start], [end]
    (target.current_velocity, target.current_acceleration) = ([value] for value in rates[0].tolist())
    (target.target_velocity, target.target_acceleration) = ([value] for value in rates[1].tolist())
    ruckig.Ruckig(1).calculate(target, output)
    return float(output.duration)


@pytest.mark.parametrize("travel", [0.02, 0.4, 1.5, -0.02, -0.4, -1.5])
@pytest.mark.parametrize(
    "backend", [Ruckig(), Ruckig(synchronization="time"), Toppra(jerk_limited=True)], ids=["phase", "time", "toppra"]
)
def test_a_straight_motion_takes_the_time_that_ruckig_takes(backend: BackEnd, travel: float) -> None:
    limits, still = first_joint((0.7, 0.4), (0.3, 0.9)), np.zeros(2)
    duration = plan(PlanningProblem(ROBOT, along(travel), limits), backend).trajectory.duration
    assert duration == pytest.approx(least_time(0.0, travel, limits, (still, still)), rel=1e-6)


@given(
    limits=st.tuples(*[st.floats(-3.0, 3.0)] * 4), unlimited=st.sampled_from(["", "velocity", "acceleration", "jerk"])
)
def test_laws_that_brake_otherwise_are_those_of_ruckig(limits: tuple[float, ...], unlimited: str) -> None:
    """They also agree where a limit is missing, or both accelerations are equal."""
    v, a, j, d = (10.0**exponent for exponent in limits)
    v, a, d, j = (
        np.inf if unlimited == name else limit
        for name, limit in (("velocity", v), ("acceleration", a), ("acceleration", d), ("jerk", j))
    )
    duration, scalings, _ = s_curves(*(np.array([limit]) for limit in (v, a, j)), braking=np.array([d]))
    target, output = ruckig.InputParameter(1), ruckig.Trajectory(1)
    target.target_position, target.max_velocity, target.max_acceleration = [1.0], [v], [a]
    target.min_acceleration, target.max_jerk = [-d], [j]
    ruckig.Ruckig(1).calculate(target, output)
    assert duration[0] == pytest.approx(output.duration, rel=1e-6)
    scaling = scalings.stretched(float(duration[0]))
    position, velocity, acceleration = scaling.evaluate(np.linspace(0.0, duration[0], 500), [0, 1, 2])
    assert position[-1] == pytest.approx(1.0)
    assert velocity.max() <= v * (1.0 + 1e-9)
    assert velocity.min() >= -1e-9 * velocity.max()
    assert acceleration.max() <= a * (1.0 + 1e-9)
    assert acceleration.min() >= -d * (1.0 + 1e-9)


def test_waypoints_are_passed_in_the_time_of_the_best_states() -> None:
    """The truth tries all velocities and accelerations at the one waypoint on a fine grid."""
    limits, travels, still = first_joint((0.9, 0.2), (0.3, 0.8)), (0.5, -0.7), np.zeros(2)
    problem = PlanningProblem(ROBOT, along(*travels), limits)
    velocities = np.linspace(-0.9, 0.2, 45) * VELOCITY
    accelerations = np.linspace(-0.3, 0.8, 45) * ACCELERATION
    states = np.stack(np.meshgrid(velocities, accelerations), axis=-1).reshape(-1, 2)
    change = states[:, 1] * np.abs(states[:, 1]) / (2.0 * JERK)
    after, before = states[:, 0] + change, states[:, 0] - change
    low, high = -0.9 * VELOCITY, 0.2 * VELOCITY
    inside = (np.minimum(after, before) >= low) & (np.maximum(after, before) <= high)
    best = min(
        least_time(0.0, 0.5, limits, (still, state)) + least_time(0.5, -0.2, limits, (state, still))
        for state in states[inside]
    )
    assert plan(problem, Ruckig()).trajectory.duration <= best * 1.002


@settings(max_examples=settings.default.max_examples // 4)
@given(seed=st.integers(0, 2**32), data=st.data())
def test_any_ranges_are_kept_and_never_slower_than_the_narrower_ones(seed: int, data: st.DataObject) -> None:
    """Waypoints are passed, also with moving ends."""
    problem = problem_of(data.draw(st.sampled_from(ARMS)), seed, data.draw(st.integers(2, 4)), 0.3)
    robot = problem.robot
    waypoints = [
        replace(waypoint, transition=ThroughTransition() if 0 < k < len(problem.waypoints) - 1 else PASSED)
        for k, waypoint in enumerate(problem.waypoints)
    ]
    shares = st.floats(0.1, 1.0)
    pairs = {
        f"{quantity}_range": tuple(
            (-data.draw(shares) * limit, data.draw(shares) * limit) for limit in robot.limit(quantity).tolist()
        )
        for quantity in ("velocity", "acceleration")
    }
    narrower = {name[:-6]: tuple(min(-low, high) for low, high in own) for name, own in pairs.items()}
    backend: BackEnd = data.draw(st.sampled_from([Ruckig(), Ruckig(synchronization="time"), Quintic(), Cubic()]))
    if data.draw(st.booleans()) and isinstance(backend, Ruckig):
        own = [data.draw(st.floats(low / 2.0, high / 2.0)) for low, high in pairs["velocity_range"]]
        backend = replace(backend, initial_velocity=tuple(own))
    try:
        result = plan(PlanningProblem(robot, waypoints, Limits(**pairs)), backend)
        keeps_joint_limits(result)
        slower = plan(PlanningProblem(robot, waypoints, Limits(**narrower)), backend)
    except (JointPositionLimit, LimitsUnsatisfiable, InfeasibleDuration):
        return
    if len(waypoints) == 2:
        assert result.trajectory.duration <= slower.trajectory.duration * (1.0 + 1e-6)
    else:  # what a search finds
        assert result.trajectory.duration <= slower.trajectory.duration * 1.05


@pytest.mark.parametrize(("backend", "degree"), [(Cubic(), 3), (Quintic(), 5)], ids=["cubic", "quintic"])
@pytest.mark.parametrize("shares", [((1.0, 1.0), (0.2, 1.0)), ((0.9, 0.15), (1.0, 1.0))], ids=["brakes", "slow"])
def test_splines_share_their_time_as_brute_force_does(backend: BackEnd, degree: int, shares: object) -> None:
    """All ratios of two durations are tried, each scaled by its dense samples; positions keep their limits too."""
    limits = first_joint(*shares)  # type: ignore[misc]
    travels = (0.8, -0.5)
    found = plan(PlanningProblem(ROBOT, along(*travels), limits), backend).trajectory
    assert limits.velocity_range
    assert limits.acceleration_range
    bounds = [
        *(np.array(own[0]) for own in (limits.velocity_range, limits.acceleration_range)),
        np.array([-JERK, JERK]),
    ]
    positions = np.array([[0.0], [travels[0]], [sum(travels)]])
    times = []
    for share in np.linspace(0.2, 0.8, 121).tolist():
        spline = interpolating_spline(positions, np.array([share, 1.0 - share]), degree)  # type: ignore[arg-type]
        _, *rates = spline.evaluate(np.linspace(0.0, 1.0, 1001), list(range(4 if degree == 5 else 3)))
        needed = [
            np.max(np.maximum(values / low, values / high)) ** (1.0 / order)
            for order, (values, (low, high)) in enumerate(zip(rates, bounds, strict=False), start=1)
        ]
        times.append(max(needed))
    assert found.duration <= min(times) * 1.006


@pytest.mark.large_only
def test_least_effort_uses_the_wider_side_where_the_narrower_one_would_be_too_slow() -> None:
    """In 1 s all joints accelerate at 0.3 of their limits at most in one direction, and at 0.8 in the other."""
    ranges = Limits(
        velocity_range=tuple((-0.7 * v, 0.4 * v) for v in ROBOT.limit("velocity").tolist()),
        acceleration_range=tuple((-0.3 * a, 0.8 * a) for a in ROBOT.limit("acceleration").tolist()),
    )
    velocity, acceleration = (ROBOT.limit(quantity) for quantity in ("velocity", "acceleration"))
    narrower = Limits(velocity=tuple(0.4 * velocity), acceleration=tuple(0.3 * acceleration))
    trip = [JointWaypoint(START), JointWaypoint((0.8, -1.0, 1.1, 0.5, 0.4, -0.3), duration=1.0)]
    backend = MinEffort(max_joint_deviation=0.3, knots=12)
    with pytest.raises(InfeasibleDuration):
        plan(PlanningProblem(ROBOT, trip, narrower), backend)
    result = plan(PlanningProblem(ROBOT, trip, ranges), backend)
    assert result.trajectory.duration == pytest.approx(1.0)
    rates = result.trajectory.evaluate(np.linspace(0.0, 1.0, 4001), [1, 2])
    for values, pairs in zip(rates, (ranges.velocity_range, ranges.acceleration_range), strict=True):
        low, high = np.array(pairs).T
        assert np.maximum(values / low, values / high).max() <= 1.0 + 1e-9
    assert (np.abs(rates[1]) / (0.3 * acceleration)).max() > 1.5
