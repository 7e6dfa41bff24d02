"""Minimum effort along lines, circles and blends: against other laws, a second solver, differences and dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from planner.backends import BackEnd, MinimumEffort, Quintic, Ruckig, TimeOptimal
from planner.backends.effort_cost import Objective
from planner.backends.effort_on_curve import RetimingCost
from planner.backends.retiming import Duration
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, MissingDynamics
from planner.kinematics import FloatArray, Pose, forward_kinematics, tool_speeds
from planner.plan import Plan, plan
from planner.problem import (
    AnyWaypoint,
    BlendTransition,
    CartesianMove,
    CircularMotion,
    JointWaypoint,
    Limits,
    LinearMotion,
    Motion,
    PlanningProblem,
    RelativeWaypoint,
    Transition,
)
from planner.robots import load_robot

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
    "circle": (START, towards(0.2, 0.3, 0.0, CircularMotion(Pose(HOME + [0.2, 0.0, 0.1])))),
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
QUICK = MinimumEffort(knots=24)


def planned(
    waypoints: tuple[AnyWaypoint, ...], backend: BackEnd = QUICK, durations: list[float | None] | None = None
) -> Plan:
    if durations is not None:
        timed = zip(waypoints[1:], durations, strict=True)
        waypoints = (waypoints[0], *(replace(waypoint, duration=seconds) for waypoint, seconds in timed))
    return plan(PlanningProblem(ARM, waypoints, backend))


def cost(result: Plan, objective: Objective = "effort", duration: float | None = None) -> float:
    """By dense samples; of the motion stretched evenly to a duration."""
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
    """(6,), the largest shares of the limits that are used."""
    times = np.linspace(0.0, result.trajectory.duration, 20001)
    q, v, a, j = result.trajectory.evaluate(times, [0, 1, 2, 3])
    limits = result.path.limits.of(result.trajectory.segments[result.trajectory.locate(times)[0]])
    linear, angular = tool_speeds(ARM, q, v)
    uses = (
        np.abs(v) / limits.velocity,
        np.abs(a) / limits.acceleration,
        np.abs(j) / limits.jerk,
        np.abs(inverse_dynamics(ARM, q, v, a)) / limits.torque,
        linear / limits.tcp_linear_velocity,
        angular / limits.tcp_angular_velocity,
    )
    return np.array([use.max() for use in uses])


@pytest.mark.parametrize("slower", [None, 1.005, 1.05, 2.0, 8.0])
@pytest.mark.parametrize("name", ["line", "short line", "circle", "blends"])
def test_effort_is_never_above_other_laws_of_the_same_duration(name: str, slower: float | None) -> None:
    others = [planned(PATHS[name], backend) for backend in (Ruckig(), TimeOptimal(jerk_limited=True), Quintic())]
    waypoints = PATHS[name]
    if slower is None:
        result = planned(waypoints)
        assert result.trajectory.duration == pytest.approx(others[2].trajectory.duration, rel=1e-9)
    else:
        weight = None if len(waypoints) == 2 else [None] * (len(waypoints) - 1)
        asked = slower * others[0].trajectory.duration
        backend = QUICK if weight is None else replace(QUICK, slowdown=max(slower, 1.0))
        result = planned(waypoints, backend, [asked] if weight is None else None)
        if weight is None:
            assert result.trajectory.duration == asked
    assert dense_use(result).max() <= 1.0 + 1e-9
    duration = result.trajectory.duration
    for other in others:
        if other.trajectory.duration <= duration * (1.0 + 1e-9):
            assert cost(result) <= cost(other, duration=duration) * (1.0 + 1e-6)


@pytest.mark.parametrize("name", ["line", "circle", "blends", "mixed"])
def test_something_is_saved(name: str) -> None:
    result = planned(PATHS[name])
    duration = result.trajectory.duration
    assert cost(result) < 0.998 * cost(planned(PATHS[name], Quintic()), duration=duration)
    assert cost(result) < 0.998 * cost(planned(PATHS[name], Ruckig()), duration=duration)
    assert result.warnings == ()


@pytest.mark.parametrize("slower", [1.3, 2.0])
@pytest.mark.parametrize("move", [(0.0, 0.5, -0.2), (0.3, 0.2, 0.3), (-0.2, 0.0, 0.4)])
def test_a_second_solver_finds_the_same_optimum(move: tuple[float, float, float], slower: float) -> None:
    """Squared speeds at nodes of the line as the unknowns (Verscheure et al. 2009), by SLSQP; jerk limits too wide."""
    joints = tuple(replace(joint, jerk=1e5) for joint in ARM.joints)
    problem = PlanningProblem(replace(ARM, joints=joints), (START, towards(*move)), Ruckig())
    fastest = plan(problem)
    duration = slower * fastest.trajectory.duration
    asked = (START, replace(problem.waypoints[1], duration=duration))
    result = plan(replace(problem, waypoints=asked, backend=MinimumEffort(knots=100)))

    curve, limits, nodes = result.path.runs[0].curve, result.path.limits, 60
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
        """Of the intervals, and their derivatives."""
        speeds = np.sqrt(np.concatenate([[0.0], b, [0.0]]))
        both = speeds[1:] + speeds[:-1]
        by_speed = -2.0 * step / both**2
        slopes = np.zeros((nodes, nodes - 1))
        inner = np.arange(nodes - 1)
        slopes[inner, inner] = by_speed[:-1] / (2.0 * speeds[1:-1])
        slopes[inner + 1, inner] = by_speed[1:] / (2.0 * speeds[1:-1])
        return 2.0 * step / both, slopes

    torque = linear(by_square, by_gain)
    acceleration = linear(ddq, dq) / limits.acceleration[0][:, None, None]
    velocity = linear(dq**2, np.zeros_like(dq)) / limits.velocity[0][:, None, None] ** 2
    rows = np.concatenate([torque, -torque, acceleration, -acceleration, velocity]).reshape(-1, nodes - 1)
    room = np.concatenate([1.0 - gravity.T, 1.0 + gravity.T, np.ones((3 * ARM.dof, nodes))]).ravel()

    def effort(x: FloatArray) -> tuple[float, FloatArray]:
        dt, by_b = times(x * unit)
        use = torque @ (x * unit) + gravity.T
        pull = 2.0 * np.einsum("jk,jkn,k->n", use, torque, dt) + (use**2).sum(axis=0) @ by_b
        return float((use**2).sum(axis=0) @ dt), unit * pull

    places = CubicSpline(np.linspace(0, 1, 2001), travelled(result, fastest, 2001))
    speeds = places.derivative()(np.interp(s[1:-1], places(np.linspace(0, 1, 2001)), np.linspace(0, 1, 2001)))
    first = (speeds / duration) ** 2
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
        options={"maxiter": 400, "ftol": 1e-9},
    )
    assert found.success, found.message
    begun, best = cost(fastest, duration=duration), cost(result)
    assert best < begun
    assert best <= found.fun + 0.1 * (begun - found.fun) + 1e-4 * begun
    assert best >= found.fun * (1.0 - 0.005)


def travelled(result: Plan, law: Plan, count: int) -> FloatArray:
    """How far on the line's curve a plan along it is at even shares of its duration."""
    curve = result.path.runs[0].curve
    s = np.linspace(0.0, curve.breakpoints[-1], 4001)
    along = curve.evaluate(s, [0])[0]
    way = along[-1] - along[0]
    positions = law.trajectory.evaluate(np.linspace(0.0, law.trajectory.duration, count), [0])[0]
    return np.interp((positions - along[0]) @ way, (along - along[0]) @ way, s)
