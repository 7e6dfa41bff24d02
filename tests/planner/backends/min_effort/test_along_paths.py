"""Minimum effort along lines, circles and blends, against other time scalings, a second solver, differences and dense
samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from planner.backends import BackEnd, MinEffort, Quintic, Ruckig, Toppra
from planner.backends.min_effort.cost import Objective
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, MissingDynamics
from planner.kinematics import FloatArray, Pose, forward_kinematics, tool_speeds
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    Motion,
    PlanningProblem,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, Transition
from planner.robots import ExternalAxis, load_robot

ARM = load_robot("kuka_kr16_l6_2")
START = JointWaypoint(position=(0.2, -1.3, 1.4, 0.3, 0.6, 0.2))
HOME = forward_kinematics(ARM, np.array([START.position]))[0].position


def towards(
    x: float, y: float, z: float, motion: Motion | None = None, transition: Transition | None = None
) -> RelativeWaypoint:
    waypoint = RelativeWaypoint(frame="base", move=CartesianMove((x, y, z)), motion=motion or LinearMotion())
    return waypoint if transition is None else replace(waypoint, transition=transition)


LINE = (START, towards(0.0, 0.5, -0.2))
PATHS: dict[str, tuple[AnyWaypoint, ...]] = {
    "line": LINE,
    "short line": (START, towards(0.0, 0.0, 0.02)),
    "circle": (START, towards(0.2, 0.3, 0.0, CircularMotion(Pose(HOME + np.array([0.2, 0.0, 0.1]))))),
    "blends": (
        START,
        towards(0.0, 0.3, 0.0, transition=BlendTransition(0.05)),
        towards(0.1, 0.0, -0.2, transition=BlendTransition(0.03)),
        towards(0.0, -0.2, 0.0),
    ),
    "mixed": (
        START,
        JointWaypoint(position=(0.6, -1.1, 1.2, 0.0, 0.5, 0.0)),
        replace(towards(0.0, 0.3, 0.1, transition=BlendTransition(0.04)), name="corner"),
        replace(towards(0.2, 0.0, 0.0), dwell=0.5),
        JointWaypoint(position=START.position),
    ),
}
QUICK = MinEffort(knots=24)


@cache
def planned(name: str, backend: BackEnd = QUICK, durations: tuple[float | None, ...] | None = None) -> Plan:
    waypoints = PATHS[name]
    if durations is not None:
        timed = zip(waypoints[1:], durations, strict=True)
        waypoints = (waypoints[0], *(replace(waypoint, duration=seconds) for waypoint, seconds in timed))
    return plan(PlanningProblem(ARM, waypoints), backend)


def cost(result: Plan, objective: Objective = "effort", duration: float | None = None) -> float:
    """Return the cost by dense samples, of the motion stretched evenly to a duration."""
    own = result.trajectory.duration
    factor = 1.0 if duration is None else duration / own
    times = np.linspace(0.0, own, 8001)
    q, v, a, j = result.trajectory.evaluate(times, [0, 1, 2, 3])
    torques = inverse_dynamics(ARM, q, v / factor, a / factor**2)
    rates = {
        "effort": ((torques / ARM.limit("torque")) ** 2).sum(axis=1),
        "mechanical_work": np.abs(torques * v / factor).sum(axis=1),
        "jerk": ((j / factor**3 / ARM.limit("jerk")) ** 2).sum(axis=1),
    }
    return float(np.trapezoid(rates[objective], times * factor))


def dense_use(result: Plan) -> FloatArray:
    """Return the largest used shares (6,) of the limits, by dense samples."""
    times = np.linspace(0.0, result.trajectory.duration, 20001)
    q, v, a, j = result.trajectory.evaluate(times, [0, 1, 2, 3])
    limits = result.path.limits.of(result.trajectory.segments[result.trajectory.locate(times)[0]])
    linear, angular = tool_speeds(ARM, q, v)
    uses = (
        np.abs(v) / limits.velocity.narrower,
        np.abs(a) / limits.acceleration.narrower,
        np.abs(j) / limits.jerk.narrower,
        np.abs(inverse_dynamics(ARM, q, v, a)) / limits.torque.narrower,
        linear / limits.magnitudes("tcp_linear_velocity")[:, 0],
        angular / limits.magnitudes("tcp_angular_velocity")[:, 0],
    )
    return np.array([use.max() for use in uses])


@pytest.mark.long_table
@pytest.mark.parametrize("slower", [1.0, 1.005, 1.05, 2.0, 8.0])
@pytest.mark.parametrize("name", ["line", "short line", "circle", "blends"])
def test_effort_is_never_above_other_laws_of_the_same_duration(name: str, slower: float) -> None:
    is_single = len(PATHS[name]) == 2
    others = [planned(name, backend) for backend in (Ruckig(), Toppra(jerk_limited=True), Quintic())]
    if is_single:
        requested = slower * others[0].trajectory.duration
        result = planned(name, QUICK, (requested,))
    else:
        requested = slower * others[2].trajectory.duration
        result = planned(name, replace(QUICK, slowdown=slower))
    duration = result.trajectory.duration
    assert duration == pytest.approx(requested, rel=0.0 if is_single else 1e-9)
    assert dense_use(result).max() <= 1.0 + 1e-9
    for other in others:
        if other.trajectory.duration <= duration * (1.0 + 1e-9):
            assert cost(result) <= cost(other, duration=duration) * (1.0 + 1e-6)


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["line", "circle", "blends", "mixed"])
def test_something_is_saved(name: str) -> None:
    result = planned(name)
    duration = result.trajectory.duration
    assert cost(result) < 0.998 * cost(planned(name, Quintic()), duration=duration)
    assert cost(result) < 0.998 * cost(planned(name, Ruckig()), duration=duration)
    assert result.warnings == ()


@pytest.mark.long_table
@pytest.mark.parametrize("slower", [1.3, 2.0])
@pytest.mark.parametrize("move", [(0.0, 0.5, -0.2), (0.1, -0.4, 0.1), (-0.2, 0.0, 0.4)])
def test_a_second_solver_finds_the_same_optimum(move: tuple[float, float, float], slower: float) -> None:
    """The unknowns are squared speeds at nodes of the line (Verscheure et al. 2009), by SLSQP.

    Jerk limits are too wide to bind.
    """
    joints = tuple(replace(joint, jerk=1e4) for joint in ARM.joints)
    problem = PlanningProblem(replace(ARM, joints=joints), (START, towards(*move)))
    fastest = plan(problem, Ruckig())
    duration = slower * fastest.trajectory.duration
    requested = (START, replace(problem.waypoints[1], duration=duration))
    result = plan(replace(problem, waypoints=requested), MinEffort(knots=100))

    curve, limits, nodes = result.path.groups[0].curve, result.path.limits, 50
    s = np.linspace(0.0, curve.breakpoints[-1], nodes + 1)
    q, dq, ddq = curve.evaluate((s[:-1] + s[1:]) / 2.0)
    still = np.zeros_like(q)
    gravity = inverse_dynamics(ARM, q, still, still)
    by_gain = (inverse_dynamics(ARM, q, still, dq) - gravity) / ARM.limit("torque")
    by_square = (inverse_dynamics(ARM, q, dq, ddq) - gravity) / ARM.limit("torque")
    gravity /= ARM.limit("torque")
    step = s[1]
    middle = (np.eye(nodes + 1)[1:] + np.eye(nodes + 1)[:-1])[:, 1:-1] / 2.0
    slope = (np.eye(nodes + 1)[1:] - np.eye(nodes + 1)[:-1])[:, 1:-1] / (2.0 * step)

    def linear(by_b: FloatArray, by_a: FloatArray) -> FloatArray:
        rows: FloatArray = by_b.T[:, :, None] * middle + by_a.T[:, :, None] * slope
        return rows

    def times(b: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the times of the intervals, and their derivatives."""
        speeds = np.sqrt(np.concatenate([[0.0], b, [0.0]]))
        both = speeds[1:] + speeds[:-1]
        by_speed = -2.0 * step / both**2
        slopes = np.zeros((nodes, nodes - 1))
        inner = np.arange(nodes - 1)
        slopes[inner, inner] = by_speed[:-1] / (2.0 * speeds[1:-1])
        slopes[inner + 1, inner] = by_speed[1:] / (2.0 * speeds[1:-1])
        return 2.0 * step / both, slopes

    torque = linear(by_square, by_gain)
    acceleration = linear(ddq, dq) / limits.acceleration.narrower[0][:, None, None]
    velocity = linear(dq**2, np.zeros_like(dq)) / limits.velocity.narrower[0][:, None, None] ** 2
    rows = np.concatenate([torque, -torque, acceleration, -acceleration, velocity]).reshape(-1, nodes - 1)
    room = np.concatenate([1.0 - gravity.T, 1.0 + gravity.T, np.ones((3 * ARM.dof, nodes))]).ravel()

    def effort(x: FloatArray) -> tuple[float, FloatArray]:
        dt, by_b = times(x * unit)
        use = torque @ (x * unit) + gravity.T
        pull = 2.0 * np.einsum("jk,jkn,k->n", use, torque, dt) + (use**2).sum(axis=0) @ by_b
        return float((use**2).sum(axis=0) @ dt), unit * pull

    first = s[1:-1] * (s[-1] - s[1:-1])
    first *= (times(first)[0].sum() / duration) ** 2
    unit = float(first.max())
    found = minimize(
        effort,
        first / unit,
        jac=True,
        method="SLSQP",
        bounds=[(1e-6, None)] * (nodes - 1),
        constraints=[
            {
                "type": "eq",
                "fun": lambda x: times(x * unit)[0].sum() / duration - 1.0,
                "jac": lambda x: times(x * unit)[1].sum(axis=0) * unit / duration,
            },
            {"type": "ineq", "fun": lambda x: room - rows @ (x * unit), "jac": lambda x: -rows * unit},
        ],
        options={"maxiter": 400, "ftol": 1e-6},
    )
    assert found.success, found.message
    begun, best = cost(fastest, duration=duration), cost(result)
    assert best < begun
    assert best <= found.fun + 0.1 * (begun - found.fun) + 1e-4 * begun
    assert best >= found.fun * (1.0 - 0.005)


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["line", "circle", "blends"])
def test_limits_by_dense_samples(name: str) -> None:
    """Torque and tool speed are narrow enough to bind; the tool keeps to its path."""
    limits = Limits(
        torque=tuple((0.5 * ARM.limit("torque")).tolist()), tcp_linear_velocity=0.4, tcp_angular_velocity=0.5
    )
    result = plan(PlanningProblem(ARM, PATHS[name], limits=limits), replace(QUICK, time_weight=1.0))
    used = dense_use(result)
    assert used.max() <= 1.0 + 1e-9
    assert used[3:].max() > 0.97
    assert result.certificate.satisfied
    assert int(result.certificate.continuity[1:]) >= 2


@pytest.mark.large_only
def test_durations_of_segments_that_are_passed_are_kept() -> None:
    """Given durations are kept exactly; a segment without one has the duration of the quintic."""
    free = planned("blends", replace(QUICK, slowdown=1.2))
    times = np.diff(free.trajectory.arrivals).tolist()
    unequal = [1.4 * times[0], 1.1 * times[1], 1.2 * times[2]]
    for requested in (unequal, [unequal[0], None, unequal[2]]):
        result, quintic = (planned("blends", backend, tuple(requested)) for backend in (QUICK, Quintic()))
        expected = np.diff(quintic.trajectory.arrivals)
        assert np.diff(result.trajectory.arrivals) == pytest.approx(expected, rel=1e-12)
        assert dense_use(result).max() <= 1.0 + 1e-9
        assert cost(result) < 0.9999 * cost(quintic)


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["line", "blends"])
def test_a_duration_too_short_is_refused_with_one_that_will_do(name: str) -> None:
    times = np.diff(planned(name).trajectory.arrivals)
    requested: list[float | None] = (0.4 * times).tolist()
    with pytest.raises(InfeasibleDuration) as refused:
        planned(name, QUICK, tuple(requested))
    assert refused.value.segment is not None
    for remedy in refused.value.remedies:
        requested[remedy.field[1] - 1] = remedy.value
    result = planned(name, QUICK, tuple(requested))
    assert np.diff(result.trajectory.arrivals) == pytest.approx(requested, rel=1e-12)


def test_motions_of_all_kinds_in_one_list() -> None:
    result, quintic = planned("mixed"), planned("mixed", Quintic())
    times = result.trajectory
    assert times.arrivals == pytest.approx(quintic.trajectory.arrivals, rel=1e-9, abs=0.02 * times.duration)
    assert times.departures[3] - times.arrivals[3] == pytest.approx(0.5)
    assert dense_use(result).max() <= 1.0 + 1e-9
    ends = [0, 1, 3, 4]  # waypoint 2 is blended
    met = times.evaluate(times.arrivals[ends], [0])[0]
    assert np.abs(met - result.path.positions[ends]).max() <= 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("objective", ["mechanical_work", "jerk"])
@pytest.mark.parametrize("name", ["line", "blends"])
def test_other_objectives(name: str, objective: Objective) -> None:
    best = planned(name, replace(QUICK, objective=objective))
    for backend in (Ruckig(), Quintic(), QUICK):
        other = planned(name, backend)
        assert cost(best, objective) < 0.9999 * cost(other, objective, best.trajectory.duration)


@pytest.mark.large_only
def test_time_against_effort() -> None:
    def price(result: Plan, weight: float) -> float:
        return cost(result) + weight * result.trajectory.duration

    plans = {w: planned("line", replace(QUICK, time_weight=w)) for w in (1e-4, 1e-2, 1.0)}
    durations = [result.trajectory.duration for result in plans.values()]
    assert durations[0] > 1.05 * durations[1] > 1.1 * durations[2]
    assert durations[2] < 1.02 * planned("line", Ruckig()).trajectory.duration
    for weight, result in plans.items():
        others = [*plans.values(), planned("line"), planned("line", Ruckig())]
        assert all(price(result, weight) <= price(other, weight) * (1.0 + 1e-9) for other in others)


RAIL = ExternalAxis("rail", "prismatic", (0, 1, 0), lower=0.0, upper=4.0, velocity=1.0, mass=10.0)
UNWEIGHED = load_robot("ngv_refuelling_arm").derived(external_axes=[RAIL])
"""Only the mass of the rail's carriage is known."""
STILL_RAIL = JointWaypoint((2.0, 0.6, -0.4, 0.8, 0.0, -0.4, 0.0))


@pytest.mark.parametrize(
    "goals",
    [
        (towards(0.0, 0.1, 0.0),),
        (towards(0.0, 0.1, 0.0, transition=BlendTransition(0.02)), towards(0.0, 0.0, 0.1)),
        (JointWaypoint((2.0, 0.4, -0.2, 0.8, 0.3, -0.4, 0.0)),),
    ],
    ids=["line", "blend", "joints"],
)
def test_motions_of_what_weighs_nothing_are_no_failure(goals: tuple[AnyWaypoint, ...]) -> None:
    """The quintic costs nothing, so no search improves on it and its refusals stand: the rail does not move."""
    options = InverseKinematicsOptions(prefer="arm")
    problem = PlanningProblem(UNWEIGHED, (STILL_RAIL, *goals), inverse_kinematics=options)
    found = plan(problem, QUICK)
    assert {warning.code for warning in found.warnings} <= {"position_unchecked", "torque_unchecked"}
    assert np.abs(found.path.positions[:, 0] - 2.0).max() <= 1e-9
    states = found.trajectory.evaluate(np.linspace(0.0, found.trajectory.duration, 500), [0, 1, 2])
    assert np.abs(inverse_dynamics(UNWEIGHED, *states)).max() <= 1e-9
    assert found.trajectory.duration == pytest.approx(plan(problem, Quintic()).trajectory.duration)
    hurried = [replace(goal, duration=0.05) for goal in goals]
    with pytest.raises(InfeasibleDuration):
        plan(replace(problem, waypoints=(STILL_RAIL, *hurried)), QUICK)


def test_after_its_iterations_the_best_law_so_far_is_returned() -> None:
    hurried = planned("line", replace(QUICK, iterations=1))
    assert [warning.code for warning in hurried.warnings] == ["suboptimal"]
    assert cost(hurried) <= cost(planned("line", Quintic())) * (1.0 + 1e-9)


@pytest.mark.large_only
def test_no_other_law_is_no_fault() -> None:
    """The shortest duration admits one time scaling only: nothing is searched for, and no warning is given."""
    shortest = planned("line", Ruckig()).trajectory.duration
    result = planned("line", QUICK, (shortest * (1.0 + 1e-9),))
    assert result.warnings == ()


def test_without_inertias_effort_is_unknown() -> None:
    robot = load_robot("ngv_refuelling_arm")
    start = JointWaypoint(position=(0.3, 0.5, 0.4, 0.3, 0.6, 0.2))
    problem = PlanningProblem(robot, (start, towards(0.0, 0.02, 0.0)))
    with pytest.raises(MissingDynamics):
        plan(problem, QUICK)
    smooth = plan(problem, replace(QUICK, objective="jerk"))
    assert smooth.certificate.satisfied
