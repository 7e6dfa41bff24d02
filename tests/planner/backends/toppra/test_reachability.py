"""The fastest time scaling against linear programs of another library."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from planner.backends.toppra.profile import solve
from planner.backends.toppra.reachability import X_TAKEN_OFF
from planner.backends.toppra.solvers import Solver
from planner.kernels.profile import POINTS, PROBES, PathLimits

LOST = 2.0 * X_TAKEN_OFF
"""Allowed loss of x below the optimum per gridpoint, relative to the largest x. The package subtracts as much at each
gridpoint, in its own unit, which may be larger."""

SOLVERS: tuple[Solver, ...] = ("kernel", "package")

Problem = tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray], np.ndarray, np.ndarray]


@st.composite
def problems(draw: st.DrawFn, bend: float, fewest: int = 1, most: int = 25) -> Problem:
    """Draw lengths, limits, bounds and rests.

    b is at most `bend` times the value that reverses a joint within one interval.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count, rows = draw(st.integers(fewest, most)), draw(st.integers(1, 8))
    lengths = rng.uniform(0.1, 1.0, count)
    a = rng.normal(size=(count, rows))
    b = bend * draw(st.floats(0.0, 1.0)) * rng.uniform(-1.0, 1.0, (count, rows)) * a / (2.0 * lengths[:, None])
    a = np.where(rng.random((count, rows)) < draw(st.floats(0.0, 0.9)), 0.0, a)
    c = draw(st.floats(0.0, 0.95)) * rng.uniform(-1.0, 1.0, (count, rows))
    bounds, rests = rng.uniform(0.2, 3.0, count + 1), rng.random(count + 1) < 0.1
    rests[[0, -1]] = True
    return lengths, (a, b, c), bounds, rests


def as_limits(problem: Problem) -> tuple[PathLimits, np.ndarray, np.ndarray]:
    """Return limits |a u + b x + c| <= 1 in the middle of the intervals, and the rests."""
    lengths, (a, b, c), most, rests = problem
    bounds = most[:-1] + (most[1:] - most[:-1]) * np.linspace(0.0, 1.0, PROBES)[:, None]
    parts = ([part] * POINTS for part in (a - lengths[:, None] * b, b, c))
    return PathLimits(lengths, *map(np.array, parts), bounds), np.zeros(len(lengths), dtype=bool), rests


def largest(problem: Problem) -> np.ndarray:
    """Return the largest x everywhere, by one linear program in x alone: u = (x[i + 1] - x[i]) / (2 d)."""
    lengths, (a, b, c), most, rests = problem
    count, rows = a.shape
    per_next = a / (2.0 * lengths[:, None])
    matrix = np.zeros((count, rows, count + 1))
    for i in range(count):
        matrix[i, :, i] = b[i] - per_next[i]
        matrix[i, :, i + 1] = per_next[i]
    both = np.vstack([matrix.reshape(-1, count + 1), -matrix.reshape(-1, count + 1)])
    bounds = np.column_stack([np.zeros(count + 1), np.where(rests, 0.0, most)])
    found = linprog(
        -np.ones(count + 1),
        A_ub=both,
        b_ub=np.concatenate([1.0 - c.ravel(), 1.0 + c.ravel()]),
        bounds=bounds,
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert found.status == 0, found.message
    optimum: np.ndarray = found.x
    return optimum


@pytest.mark.parametrize("solver", SOLVERS)
@settings(max_examples=settings.default.max_examples // 2)
@given(problem=problems(1.0))
def test_the_largest_speeds_everywhere_are_those_of_one_linear_program(solver: Solver, problem: Problem) -> None:
    """Where each speed can be as large as possible at once, their sum is the largest."""
    x = solve(solver, *as_limits(problem))
    assert x == pytest.approx(largest(problem), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
@settings(max_examples=settings.default.max_examples // 4)
@given(problem=problems(1.0, fewest=60, most=150), ramps=st.booleans())
def test_long_ramps_are_those_of_one_linear_program(solver: Solver, problem: Problem, ramps: bool) -> None:
    lengths, rows, most, rests = problem
    if ramps:
        most, rests = 1e3 * most, np.isin(np.arange(len(rests)), [0, len(lengths)])
        problem = lengths, rows, most, rests
    x = solve(solver, *as_limits(problem))
    optimum = largest(problem)
    size = max(float(optimum.max()), 1.0)
    assert (x <= optimum * (1.0 + 1e-6) + 1e-6 * size).all()
    # Where rows bound x far below its bounds, the bounds set the unit, and steep rows pass the subtracted amount on.
    lost = LOST * (len(lengths) * size + 10.0 * float(most.max())) if solver == "package" else 1e-6 * size
    assert (x >= optimum * (1.0 - 1e-6) - lost).all()


@pytest.mark.parametrize("solver", SOLVERS)
@settings(max_examples=settings.default.max_examples // 2)
@given(problem=problems(1000.0))
def test_all_limits_are_kept_however_sharply_the_curve_bends(solver: Solver, problem: Problem) -> None:
    lengths, (a, b, c), most, rests = problem
    x = solve(solver, *as_limits(problem))
    u = np.diff(x) / (2.0 * lengths)
    assert np.abs(a * u[:, None] + b * x[:-1, None] + c).max() <= 1.0 + 1e-7
    assert (x >= 0.0).all()
    assert (x <= np.where(rests, 0.0, most)).all()


@pytest.mark.parametrize("solver", SOLVERS)
def test_rows_without_any_limit(solver: Solver) -> None:
    """Only the bounds on the speed count."""
    none = np.zeros((3, 2))
    problem = np.ones(3), (none, none, none), np.full(4, 2.0), np.array([True, False, False, True])
    assert solve(solver, *as_limits(problem)) == pytest.approx([0.0, 2.0, 2.0, 0.0], rel=1e-7)
