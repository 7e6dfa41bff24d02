"""Quadratic programs against scipy's solvers and closed forms; the step rule against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, linprog, minimize

from planner.time_scaling.interior_point import (
    InteriorPoint,
    QuadraticProgram,
    longest_step,
    next_centring,
    solve_quadratic_program,
)

GAP = 1e-9


def objective(program: QuadraticProgram, x: np.ndarray) -> float:
    return float(program.cost @ x + 0.5 * program.curvature @ x**2)


def solved(program: QuadraticProgram, start: np.ndarray) -> np.ndarray:
    """The solution; it is within all limits, and its gap is as small as asked."""
    gaps = []

    def is_solved(_: np.ndarray, gap: float) -> bool:
        gaps.append(gap)
        return gap < GAP

    x = solve_quadratic_program(program, start, is_solved)
    assert gaps[-1] < GAP
    assert program.slacks(x).min() > 0.0
    return x


def random_program(seed: int, kind: str) -> QuadraticProgram:
    """A program that 0 lies within."""
    rng = np.random.default_rng(seed)
    variables, count = int(rng.integers(1, 9)), int(rng.integers(0, 15))
    matrix, bounds = rng.normal(size=(count, variables)), rng.uniform(0.1, 1.0, count)
    curvature = rng.uniform(0.0, 2.0, variables)
    if kind == "linear":
        curvature = np.zeros(variables)
    elif kind == "redundant":
        rows = np.repeat(np.arange(count), 3)
        matrix, bounds = matrix[rows], bounds[rows]
        bounds[1::3] *= 2.0
    elif kind == "degenerate":
        # Many limits meet in one corner of the box, more than there are variables.
        matrix = np.abs(matrix)
        bounds = matrix.sum(axis=1)
    elif kind == "badly scaled":
        factors = 10.0 ** rng.uniform(-5.0, 5.0, count)
        matrix, bounds = matrix * factors[:, None], bounds * factors
    elif kind == "aligned":
        matrix = np.round(matrix)
    elif kind == "barely inside":
        bounds = bounds * 1e-3
    cost = -np.abs(rng.normal(size=variables)) if kind == "degenerate" else rng.normal(size=variables)
    return QuadraticProgram(cost, curvature, matrix, bounds, -np.ones(variables), np.ones(variables))


KINDS = ("convex", "linear", "redundant", "degenerate", "badly scaled", "aligned", "barely inside")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(8))
def test_a_quadratic_program_has_the_optimum_of_scipy(seed: int, kind: str) -> None:
    program = random_program(seed, kind)
    own = solved(program, np.zeros(len(program.cost)))
    if kind == "linear":
        limits = {"A_ub": program.matrix, "b_ub": program.bounds} if len(program.bounds) else {}
        peer = linprog(program.cost, bounds=np.column_stack([program.lower, program.upper]), **limits).fun
    else:
        # The same limits, each row of length 1: that is easier for scipy.
        lengths = np.linalg.norm(program.matrix, axis=1)
        rows = lengths > 0.0
        limit = LinearConstraint(program.matrix[rows] / lengths[rows, None], ub=program.bounds[rows] / lengths[rows])
        peer = minimize(
            lambda x: objective(program, x),
            np.zeros(len(program.cost)),
            jac=lambda x: program.cost + program.curvature * x,
            bounds=np.column_stack([program.lower, program.upper]),
            constraints=[limit] if rows.any() else [],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 1000},
        ).fun
    assert objective(program, own) == pytest.approx(peer, abs=3.0 * GAP)


@pytest.mark.parametrize("seed", range(5))
def test_without_limits_each_variable_has_its_own_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 30
    cost, curvature = rng.normal(size=n), rng.uniform(0.2, 3.0, n)
    lower, upper = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    program = QuadraticProgram(cost, curvature, np.empty((0, n)), np.empty(0), lower, upper)
    assert solved(program, np.zeros(n)) == pytest.approx(np.clip(-cost / curvature, lower, upper), abs=1e-4)


@pytest.mark.parametrize("share", [0.5, 0.98, 0.99])
def test_the_longest_step_keeps_what_is_positive_positive(share: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        values, changes = rng.uniform(1e-9, 1.0, (2, 3)), rng.normal(size=(2, 3)) * 10.0 ** rng.uniform(-6, 6)
        step = longest_step(values, changes, share)
        assert 0.0 < step <= 1.0
        assert ((values + step * changes) / values).min() >= (1.0 - share) * (1.0 - 1e-9)
        if step < 1.0:
            assert (values + step / share * changes).min() == pytest.approx(0.0, abs=1e-9)


def test_a_step_of_nothing_is_made_in_full() -> None:
    assert longest_step(np.empty(0), np.empty(0)) == 1.0
    assert longest_step(np.ones(3), np.zeros(3)) == 1.0


def test_the_central_path_is_where_newton_leads() -> None:
    """One variable between 0 and 1, cost x: on the central path mu = x (1 - x) / (1 - 2 x)."""
    x, mu = 0.5, 0.01
    point = InteriorPoint.on_central_path(np.array([x, 1.0 - x]), 1.0)
    assert point.gap == pytest.approx(2.0)
    for _ in range(60):
        terms = point.towards(mu)
        change = (-1.0 + terms.push[0] - terms.push[1]) / terms.stiffness.sum()
        step = point.step(terms, np.array([change, -change]))
        x += step.primal * change
        point = point.moved(np.array([x, 1.0 - x]), step)
    assert mu * (1.0 - 2.0 * x) == pytest.approx(x * (1.0 - x), rel=1e-9)
    assert point.slacks * point.duals == pytest.approx([mu, mu], rel=1e-9)


def test_the_barrier_falls_by_more_after_longer_steps() -> None:
    shares = [next_centring(made, 0.1) for made in (0.0, 0.3, 0.9, 0.999, 1.0)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] == 1.0
    assert shares[-1] == 0.1


@pytest.mark.parametrize("seed", range(5))
def test_a_long_program_that_is_nearly_all_zeros_has_no_way_down_left(seed: int) -> None:
    """As of the durations of many intervals, each of which matters to its neighbours; the last variable bounds all.

    No feasible point lies further down along the slope at the solution: that bounds how far from the optimum it is.
    """
    rng = np.random.default_rng(seed)
    n = 300
    near = np.abs(np.arange(n)[:, None] - np.arange(n)) <= 3
    matrix = np.column_stack([np.where(near, rng.normal(size=(n, n)), 0.0), np.full(n, -1.0)])
    bounds, cost = rng.uniform(0.1, 1.0, n), np.append(rng.normal(size=n), 20.0) / n
    lower, upper = np.append(-np.ones(n), -5.0), np.append(np.ones(n), 5.0)
    program = QuadraticProgram(cost, np.append(np.ones(n), 0.0) / n, matrix, bounds, lower, upper)
    x = solved(program, np.zeros(n + 1))
    slope = program.cost + program.curvature * x
    best = linprog(slope, A_ub=matrix, b_ub=bounds, bounds=np.column_stack([lower, upper])).fun
    assert slope @ x - best < 3.0 * GAP


def test_a_start_that_rounding_puts_onto_a_limit_is_as_near_as_it_goes() -> None:
    """With numbers of 1e17 beside 1, a slack of 0.1 is none."""
    ones = np.ones(2)
    program = QuadraticProgram(ones, 0.0 * ones, 1e17 * np.ones((1, 2)), np.array([1e17 + 0.1]), -2.0 * ones, ones)
    start = np.array([1.0, 0.0])
    assert (solve_quadratic_program(program, start, lambda x, gap: gap < 1e-9) == start).all()
