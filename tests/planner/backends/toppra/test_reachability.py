"""The fastest law against linear programs of another library."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from planner.backends.toppra.path_limits import LinearRows
from planner.backends.toppra.reachability import fastest_profile

Problem = tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray], np.ndarray, np.ndarray]


@st.composite
def problems(draw: st.DrawFn, bend: float) -> Problem:
    """Lengths, limits, bounds and rests; b is at most `bend` times what would turn a joint back within one interval."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count, rows = draw(st.integers(1, 25)), draw(st.integers(1, 8))
    lengths = rng.uniform(0.1, 1.0, count)
    a = rng.normal(size=(count, rows))
    b = bend * draw(st.floats(0.0, 1.0)) * rng.uniform(-1.0, 1.0, (count, rows)) * a / (2.0 * lengths[:, None])
    a = np.where(rng.random((count, rows)) < draw(st.floats(0.0, 0.9)), 0.0, a)
    c = draw(st.floats(0.0, 0.95)) * rng.uniform(-1.0, 1.0, (count, rows))
    most, rests = rng.uniform(0.2, 3.0, count + 1), rng.random(count + 1) < 0.1
    rests[[0, -1]] = True
    return lengths, (a, b, c), most, rests


def one_sided(problem: Problem) -> tuple[np.ndarray, LinearRows, np.ndarray, np.ndarray]:
    """|a u + b x + c| <= 1 as a u + b x + c - 1 <= 0 and its counterpart, without those that cannot bind."""
    lengths, (a, b, c), most, rests = problem
    rows = LinearRows(np.hstack([a, -a]), np.hstack([b, -b]), np.hstack([c, -c]) - 1.0)
    return lengths, rows.that_bind(most[:-1]), most, rests


@settings(max_examples=150)
@given(problem=problems(1.0))
def test_the_largest_speeds_everywhere_are_those_of_one_linear_program(problem: Problem) -> None:
    """Where each can be as large as possible at once, their sum is the largest."""
    lengths, (a, b, c), most, rests = problem
    count, rows = a.shape
    x = fastest_profile(*one_sided(problem))
    # In x alone: u = (x[i + 1] - x[i]) / (2 d).
    per_next = a / (2.0 * lengths[:, None])
    matrix = np.zeros((count, rows, count + 1))
    for i in range(count):
        matrix[i, :, i] = b[i] - per_next[i]
        matrix[i, :, i + 1] = per_next[i]
    both = np.vstack([matrix.reshape(-1, count + 1), -matrix.reshape(-1, count + 1)])
    bounds = np.column_stack([np.zeros(count + 1), np.where(rests, 0.0, most)])
    found = linprog(
        -np.ones(count + 1), A_ub=both, b_ub=np.concatenate([1.0 - c.ravel(), 1.0 + c.ravel()]), bounds=bounds
    )
    assert found.status == 0, found.message
    assert x == pytest.approx(found.x, rel=1e-6, abs=1e-6)


@settings(max_examples=150)
@given(problem=problems(1000.0))
def test_all_limits_are_kept_however_sharply_the_curve_bends(problem: Problem) -> None:
    lengths, (a, b, c), most, rests = problem
    x = fastest_profile(*one_sided(problem))
    u = np.diff(x) / (2.0 * lengths)
    assert np.abs(a * u[:, None] + b * x[:-1, None] + c).max() <= 1.0 + 1e-7
    assert (x >= 0.0).all()
    assert (x <= np.where(rests, 0.0, most)).all()


def test_rows_without_any_limit() -> None:
    """Nothing but the bounds on the speed counts."""
    none, rests = np.zeros((3, 2)), np.array([True, False, False, True])
    x = fastest_profile(np.ones(3), LinearRows(none, none, none - 1.0), np.full(4, 2.0), rests)
    assert x == pytest.approx([0.0, 2.0, 2.0, 0.0], rel=1e-7)
