"""Limits of the tool's jerk: checked against finite differences of its acceleration, and against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import BackEnd, MinEffort, Quintic, Ruckig, Toppra
from planner.errors import InfeasibleDuration
from planner.guarantees import TCP_ORDERS, Guarantee
from planner.kinematics import tool_accelerations, tool_jerks
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.spatial import FloatArray
from planner.time_scaling.linear_limits import NORMALS, jerk_rows
from planner.tolerances import LIMIT_TOLERANCE
from tests.planner.problems_of_tests import backend_of
from tests.planner.tool_problems import CORNER, JOINTS, LINE, ROBOT, START

LIMITS = Limits(tcp_linear_jerk=8.0, tcp_angular_jerk=12.0)
JERKS = [quantity for quantity, order in TCP_ORDERS.items() if order == 3]
KEEPING = [(Quintic(), JOINTS), (Quintic(), CORNER), (Ruckig(), JOINTS), (Toppra(jerk_limited=True), CORNER)]


def differences(result: Plan, count: int = 500, step: float = 1e-5) -> dict[str, FloatArray]:
    """Return differences of tool accelerations at two times each, within one piece of the trajectory."""
    trajectory = result.trajectory
    middles = np.linspace(0.0, trajectory.duration, count + 2)[1:-1]
    pieces = trajectory.locate(np.array([middles - step, middles + step]).ravel())[0].reshape(2, -1)
    middles = middles[pieces[0] == pieces[1]]
    before, after = (
        tool_accelerations(result.path.robot, *trajectory.evaluate(middles + shift, [0, 1, 2]))
        for shift in (-step, step)
    )
    each = ((late - early) / (2.0 * step) for early, late in zip(before, after, strict=True))
    return dict(zip(JERKS, (np.linalg.norm(values, axis=1) for values in each), strict=True))


@pytest.mark.parametrize(("backend", "waypoints"), KEEPING)
def test_finite_differences_are_within_the_limits(backend: BackEnd, waypoints: list[JointWaypoint]) -> None:
    result = plan(PlanningProblem(ROBOT, waypoints, LIMITS), backend)
    checks = {check.quantity: check for check in result.certificate.checks}
    for quantity, values in differences(result).items():
        assert values.max() <= getattr(LIMITS, quantity) * 1.001
        assert checks[quantity].peak == pytest.approx(values.max(), rel=0.03, abs=0.1)
        assert checks[quantity].enforced
        assert checks[quantity].bounded
    assert max(checks[quantity].ratio or 0.0 for quantity in JERKS) > 0.99


@pytest.mark.parametrize("kind", ["cubic", "trapezoidal", "toppra"])
def test_where_accelerations_jump_it_is_reported_and_costs_no_time(kind: str) -> None:
    backend = backend_of(kind)
    limited, free = (plan(PlanningProblem(ROBOT, LINE, limits), backend) for limits in (LIMITS, Limits()))
    assert limited.trajectory.duration == free.trajectory.duration
    checks = {check.quantity: check for check in limited.certificate.checks}
    for quantity in JERKS:
        assert backend.guarantees[quantity] is Guarantee.REPORTED
        assert not checks[quantity].enforced
        assert not checks[quantity].bounded


@pytest.mark.parametrize("backend", [Ruckig(), Toppra(jerk_limited=True)], ids=repr)
def test_a_straight_line_is_driven_by_the_jerk_of_the_tool(backend: BackEnd) -> None:
    """Over 0.3 m at 8 m/s^3, without other binding limits: four phases, T = (32 d / j)^(1/3)."""
    duration = plan(PlanningProblem(ROBOT, LINE, Limits(tcp_linear_jerk=8.0)), backend).trajectory.duration
    assert 1.0 - 1e-6 < duration / np.cbrt(32.0 * 0.3 / 8.0) < 1.005


def test_laws_along_a_corner_gain_what_a_wider_limit_allows() -> None:
    """Jerk depends on the third power of time: 6 % more jerk saves 1.9 % of the duration, and little more."""
    times = []
    for jerk in (2.0, 2.12):
        problem = PlanningProblem(ROBOT, CORNER, Limits(tcp_linear_jerk=jerk))
        times.append(plan(problem, Toppra(jerk_limited=True)).trajectory.duration)
    assert 1.06 ** (1.0 / 3.0) * 0.997 < times[0] / times[1] < 1.06 ** (1.0 / 3.0) * 1.003


def test_a_duration_that_asks_for_too_much_is_refused_with_remedies() -> None:
    """The quintic's jerk at its ends is 60 d / T^3."""
    line = [LINE[0], RelativeWaypoint(CartesianMove((0.0, -0.3, 0.0)), "base", motion=LinearMotion(), duration=0.9)]
    problem = PlanningProblem(ROBOT, line, Limits(tcp_linear_jerk=8.0))
    with pytest.raises(InfeasibleDuration, match="the limit of the tool's jerk") as refusal:
        plan(problem, Quintic())
    changed = {remedy.field: remedy for remedy in refusal.value.remedies}
    assert changed["waypoints", 1, "duration"].value == pytest.approx(np.cbrt(60.0 * 0.3 / 8.0), rel=1e-3)
    wider = changed["limits", "tcp_linear_jerk"].applied_to(problem)
    assert plan(wider, Quintic()).trajectory.duration == pytest.approx(0.9)


def test_the_least_effort_along_a_line_keeps_them() -> None:
    found = plan(PlanningProblem(ROBOT, LINE, LIMITS), MinEffort(time_weight=100.0, knots=12))
    assert found.certificate.satisfied
    for quantity, values in differences(found).items():
        assert values.max() <= getattr(LIMITS, quantity) * 1.001


def test_the_faces_hold_a_sphere_and_its_corners_are_on_it() -> None:
    """No jerk within all faces exceeds the limit; along the axes and halfway between them all of it is used."""
    directions = np.random.default_rng(0).normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reached = np.abs(directions @ NORMALS.T).max(axis=1)
    assert reached.min() >= 1.0
    assert reached.max() < 1.13
    corners = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 1.0]])
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    assert np.abs(corners @ NORMALS.T).max(axis=1) == pytest.approx(1.0, abs=LIMIT_TOLERANCE)


def test_rows_are_the_jerk_of_the_retimed_motion() -> None:
    """The motion is q(x(t)) with x' = sqrt(b), b = 1 + 2 a x + c x^2, at x = 0. The chain rule gives q' to q'''."""
    rng = np.random.default_rng(1)
    q, v, a, j = np.array([START] * 50) + 0.3 * rng.normal(size=(50, 6)), *rng.normal(size=(3, 50, 6))
    v[:10], a[10:20] = 0.0, 2.0 * v[10:20]  # at rest, and straight on
    slope, bend = rng.normal(size=(2, 50, 1))
    retimed = q, v, a + v * slope, j + 3.0 * a * slope + v * bend
    rows = jerk_rows(ROBOT, JERKS, q, v, a, j)
    values = np.abs(rows.by_b + rows.by_a * slope + rows.by_c * bend)
    for quantity, jerks in zip(JERKS, tool_jerks(ROBOT, *retimed), strict=True):
        own = np.array([name == quantity for name in rows.quantities])
        share = values[:, own].max(axis=1) / np.linalg.norm(jerks, axis=1)
        assert (share >= 1.0 - 1e-9).all()
        assert (share < 1.13).all()
