"""The kernels of profiles against plain numpy and against linear programs that are solved by trying every corner."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.backends.toppra.intervals import CUTTING
from planner.backends.toppra.path_limits import OF_REST_AND_BOUNDS
from planner.backends.toppra.profile import SPLITTING
from planner.kernels.profile import (
    POINTS,
    PROBES,
    LimitRows,
    PathLimits,
    cut_curves,
    fastest_profile,
    judge_profile,
    limits_on_intervals,
    times_between,
)
from tests.planner.kernels import path_limits as by_numpy

Problem = tuple[PathLimits, np.ndarray, np.ndarray]
"""Limits, whether they hold throughout, and the rests."""


def problem(seed: int, count: int, rows: int, bend: float = 1.0) -> Problem:
    """Draw limits that differ from the start of an interval to its end, some of them of one term only."""
    rng = np.random.default_rng(seed)
    shape = (count, rows)

    def along(values: np.ndarray, change: float) -> np.ndarray:
        return values * (1.0 + change * rng.uniform(-1.0, 1.0, (POINTS, *shape)))

    per_u = along(rng.normal(size=shape) * (rng.random(shape) < 0.8), 0.2)
    per_x = along(bend * rng.normal(size=shape) * (rng.random(shape) < 0.8), 0.2)
    rest, bounds = along(rng.uniform(-0.8, 0.8, shape), 0.1), rng.uniform(0.2, 3.0, (PROBES, count))
    rests = rng.random(count + 1) < 0.1
    rests[[0, -1]] = True
    return PathLimits(rng.uniform(0.1, 1.0, count), per_u, per_x, rest, bounds), rng.random(count) < 0.5, rests


def constant(lengths: np.ndarray, per_u: np.ndarray, rest: float, bound: float) -> Problem:
    """Return limits (limits,) that are equal everywhere, from rest to rest."""
    count, shape = len(lengths), (POINTS, len(lengths), len(per_u))
    limits = PathLimits(
        lengths,
        np.broadcast_to(per_u, shape),
        np.zeros(shape),
        np.full(shape, rest),
        np.full((PROBES, count), bound),
    )
    return limits, np.zeros(count, dtype=bool), np.isin(np.arange(count + 1), [0, count])


RANDOM = {
    "seed": st.integers(0, 2**32),
    "count": st.integers(1, 10),
    "rows": st.integers(1, 3),
    "bend": st.sampled_from([0.1, 1.0, 30.0]),
}


@given(**RANDOM)
def test_random_limits(seed: int, count: int, rows: int, bend: float) -> None:
    given = problem(seed, count, rows, bend)
    assert fastest_profile(*given) == pytest.approx(by_numpy.fastest_profile(*given), rel=1e-7, abs=1e-9)


@given(may_split=st.booleans(), is_first=st.booleans(), looseness=st.sampled_from([1e-6, 1e-3, 0.3]), **RANDOM)
def test_the_judgement_of_random_profiles(
    seed: int, count: int, rows: int, bend: float, may_split: bool, is_first: bool, looseness: float
) -> None:
    limits, throughout, rests = problem(seed, count, rows, bend)
    limits.per_u[..., 0] = np.where(limits.per_u[..., 0] == 0.0, 0.3, limits.per_u[..., 0])  # one limits u everywhere
    x = fastest_profile(limits, throughout, rests) * (1.0 - looseness) + 1e-3
    given = limits, throughout, np.cumsum(rests[:-1]) - 1, x, SPLITTING
    bends, parts = judge_profile(*given, may_split=may_split, is_first=is_first)
    others, expected = by_numpy.judge_profile(*given, may_split=may_split, is_first=is_first)
    assert bends == pytest.approx(others, rel=1e-9, abs=1e-12)
    assert (parts is None) == (expected is None)
    for own, other in zip(parts or (), expected or (), strict=True):
        assert own == pytest.approx(other, rel=1e-9, abs=1e-12)


@given(st.integers(0, 2**32), st.sampled_from([0.0, 1e-9, 1e-3, 0.45]), st.booleans())
def test_times_on_intervals(seed: int, bend: float, whole: bool) -> None:
    rng = np.random.default_rng(seed)
    lengths, x = rng.uniform(0.1, 2.0, 5), rng.uniform(0.3, 3.0, 6)
    most = (np.sqrt(x[:-1]) + np.sqrt(x[1:])) ** 2 / (2.0 * lengths)
    bends, shares = bend * most * rng.choice([-1.0, 1.0], 5), (0.0, 1.0) if whole else np.sort(rng.random(2)).tolist()
    given = lengths, x, bends, *shares
    assert times_between(*given) == pytest.approx(by_numpy.times_between(*given), rel=1e-11)


def test_the_time_from_rest() -> None:
    """With s'' = 2 the length 1 takes 1 s from rest."""
    x = np.array([0.0, 4.0, 0.0])
    assert times_between(np.ones(2), x, np.zeros(2), 0.0, 1.0) == pytest.approx([1.0, 1.0], rel=1e-12)


@given(st.integers(0, 2**32), st.integers(1, 8), st.integers(2, 6), st.sampled_from([0.0, 1e-3, 1.0, 100.0]))
def test_random_curves_cut_into_intervals(seed: int, pieces: int, order: int, bend: float) -> None:
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=(pieces, 3, order)) * np.where(np.arange(order) < 2, 1.0, bend)
    segments = np.cumsum(rng.random(pieces) < 0.7)
    groups = np.cumsum(np.diff(segments, prepend=segments[0]) * (rng.random(pieces) < 0.4))
    given = rng.uniform(0.1, 2.0, pieces), coefficients, segments, groups - groups[0], rng.uniform(0.5, 2.0, (9, 3))
    rule = np.array([rng.integers(1, 30), *CUTTING])
    for own, other in zip(cut_curves(*given, rule), by_numpy.cut_curves(*given, rule), strict=True):
        assert own == pytest.approx(other, rel=1e-12)


@given(st.integers(0, 2**32), st.integers(0, 4), st.booleans())
def test_random_rows_as_limits_on_intervals(seed: int, width: int, limits_path_speed: bool) -> None:
    rng = np.random.default_rng(seed)
    count, segments, joints = 7, 3, 2

    def positive(*shape: int) -> np.ndarray:
        return rng.uniform(0.3, 3.0, shape)

    sides = rng.normal(size=(segments, joints)), positive(segments, joints), -positive(segments, joints)
    velocity = np.where(rng.random((segments, joints)) < 0.3, np.inf, positive(segments, joints))
    rows = LimitRows(
        *rng.normal(size=(3, POINTS, count, width)), rng.normal(size=(segments, width)), positive(segments, width)
    )
    derivatives = rng.normal(size=(2, PROBES, count, joints)) * (rng.random((2, PROBES, count, joints)) < 0.8)
    given = positive(count), rng.integers(0, segments, count), tuple(derivatives), (*sides, velocity), rows
    used = positive(PROBES, count) if limits_path_speed else None
    others = used, positive(count), OF_REST_AND_BOUNDS
    expected = by_numpy.limits_on_intervals(*given, *others)
    for own, other in zip(limits_on_intervals(*given, *others), expected, strict=True):
        assert own == pytest.approx(other, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("size", [1e-12, 1e-4, 1.0, 1e6])
@pytest.mark.parametrize("speed", [1e-6, 1.0, 1e5])
def test_the_units_of_length_and_time_do_not_matter(size: float, speed: float) -> None:
    """s is `size` times as long and x = s'^2 is `speed`^2 times as large: the kernel has no tolerance in a unit."""
    limits, throughout, rests = problem(5, 40, 3)
    scale = (size * speed) ** 2
    lengths, per_u, per_x, rest, bounds = limits
    scaled = PathLimits(lengths * size, per_u * size / scale, per_x / scale, rest, bounds * scale)
    x = fastest_profile(limits, throughout, rests)
    assert fastest_profile(scaled, throughout, rests) / scale == pytest.approx(x, rel=1e-9, abs=1e-12)


def test_limits_that_all_but_bind_at_rest() -> None:
    """Gravity takes 0.9999 of a torque limit: little acceleration is left, and none of it is lost."""
    count = 1000
    s = np.linspace(0.0, 1.0, count + 1)
    x = fastest_profile(*constant(np.full(count, 1.0 / count), np.ones(1), 0.9999, 10.0))
    assert x == pytest.approx(np.minimum(2e-4 * s, 2.0 * 1.9999 * (1.0 - s)), rel=1e-9)


def test_limits_without_acceleration_bound_the_speed_alone() -> None:
    """On a path that turns on the spot, 4 x <= 1 has no u: a singular row, or one of rounding, beside |u| <= 1."""
    limits, throughout, rests = constant(np.ones(3), np.array([1.0, 0.0]), 0.0, 9.0)
    limits.per_x[:, 1, 1] = 4.0
    for rounding in (0.0, 1e-14):
        per_u = limits.per_u.copy()
        per_u[:, 1, 1] = rounding - 4.0 * limits.lengths[1]
        x = fastest_profile(limits._replace(per_u=per_u), throughout, rests)
        assert x == pytest.approx([0.0, 0.25, 2.0, 0.0])


def test_limits_of_nothing() -> None:
    """Only the bounds of the speed count, and no bend is needed."""
    limits, throughout, rests = constant(np.ones(3), np.zeros(2), 0.0, 2.0)
    x = fastest_profile(limits, throughout, rests)
    assert x == pytest.approx([0.0, 2.0, 2.0, 0.0])
    groups = np.zeros(3, dtype=int)
    bends, parts = judge_profile(limits, throughout, groups, x, SPLITTING, may_split=False, is_first=True)
    assert np.isfinite(bends).all()
    assert parts is None


def test_intervals_next_to_nothing() -> None:
    """Waypoints are 1e-12 apart: such an interval hardly changes x."""
    lengths = np.where(np.arange(30) % 3 == 1, 1e-12, 0.1)
    s = np.append(0.0, np.cumsum(lengths))
    x = fastest_profile(*constant(lengths, np.ones(1), 0.0, 50.0))
    assert x == pytest.approx(2.0 * np.minimum(s, s[-1] - s), abs=1e-12)


def test_a_bulge_of_gravity_within_an_interval_leaves_a_way() -> None:
    """Between the points, the quadratic exceeds the limit, and no u keeps its coefficients within it."""
    limits, _, rests = constant(np.ones(2), np.ones(1), 0.0, 1.0)
    limits.rest[...] = np.array([0.9, 0.9999, 0.9])[:, None, None]
    x = fastest_profile(limits, np.ones(2, dtype=bool), rests)
    assert x[1] > 0.0


def test_the_same_bytes_on_every_run() -> None:
    given = problem(3, 500, 8)
    assert fastest_profile(*given).tobytes() == fastest_profile(*given).tobytes()


def test_wrong_shapes_are_refused() -> None:
    limits, throughout, rests = problem(3, 5, 2)
    with pytest.raises(ValueError, match="shape"):
        fastest_profile(limits._replace(per_x=limits.per_x[..., 1:]), throughout, rests)
    with pytest.raises(ValueError, match="shape"):
        fastest_profile(limits, throughout, rests[1:])
    with pytest.raises(ValueError, match="shape"):
        judge_profile(limits, throughout, np.zeros(5, dtype=int), np.ones(3), SPLITTING, may_split=True, is_first=True)
