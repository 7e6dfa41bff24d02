"""Quadratic programs against scipy's solvers and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, linprog, minimize

from planner.kernels.quadratic_programs import Gap, QuadraticProgram, solve_quadratic_program

GAP = 1e-9


def objective(program: QuadraticProgram, x: np.ndarray) -> float:
    return float(program.cost @ x + 0.5 * program.curvature @ x**2)


def solved(program: QuadraticProgram, start: np.ndarray) -> np.ndarray:
    """Solve a program and assert that the solution is within all limits."""
    x = solve_quadratic_program(program, start, Gap(GAP))
    slacks = np.concatenate([program.bounds - program.matrix @ x, x - program.lower, program.upper - x])
    assert slacks.min() > 0.0
    return x


def random_program(seed: int, kind: str) -> QuadraticProgram:
    """Draw a program with 0 as a feasible point."""
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


@pytest.mark.parametrize("seed", range(5))
def test_a_long_program_that_is_nearly_all_zeros_has_no_way_down_left(seed: int) -> None:
    """The program is like one of many durations, each coupled to its neighbours; the last variable bounds all.

    No feasible point lies further down along the slope at the solution: that bounds the distance from the optimum.
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
    """With numbers of 1e17 beside 1, a slack of 0.1 is zero."""
    ones = np.ones(2)
    program = QuadraticProgram(ones, 0.0 * ones, 1e17 * np.ones((1, 2)), np.array([1e17 + 0.1]), -2.0 * ones, ones)
    start = np.array([1.0, 0.0])
    assert (solve_quadratic_program(program, start, Gap(GAP)) == start).all()


def test_a_gap_that_may_be_a_larger_share_of_the_gain_ends_the_search_sooner() -> None:
    """The minimum of cost x is -1, at the bounds."""
    cost = np.array([0.3, -0.7])
    program = QuadraticProgram(cost, np.zeros(2), np.empty((0, 2)), np.empty(0), -np.ones(2), np.ones(2))
    gaps = [Gap(1e-6, share) for share in (0.0, 0.01, 0.9)]
    values = [objective(program, solve_quadratic_program(program, np.zeros(2), gap)) for gap in gaps]
    assert -1.0 < values[0] < values[1] < values[2] < -0.5
    assert values[0] == pytest.approx(-1.0, abs=1e-5)
