"""The kernels of profiles against plain numpy and against linear programs that are solved by trying every corner."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.kernels.profile import POINTS, PROBES, PathLimits, fastest_crossings, fastest_profile, use_of_limits
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


@given(**RANDOM)
def test_the_use_of_random_limits(seed: int, count: int, rows: int, bend: float) -> None:
    limits, throughout, rests = problem(seed, count, rows, bend)
    limits.per_u[..., 0] = np.where(limits.per_u[..., 0] == 0.0, 0.3, limits.per_u[..., 0])  # one limits u everywhere
    x = fastest_profile(limits, throughout, rests) + 1e-3 * np.random.default_rng(seed).random(count + 1)
    for own, other in zip(
        use_of_limits(limits, throughout, x), by_numpy.use_of_limits(limits, throughout, x), strict=True
    ):
        assert own == pytest.approx(other, rel=1e-9, abs=1e-12)
    for own, other in zip(fastest_crossings(limits, x, 1e6), by_numpy.fastest_crossings(limits, x, 1e6), strict=True):
        assert own == pytest.approx(other, rel=1e-9, abs=1e-12)


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
    assert np.isfinite(use_of_limits(limits, throughout, x)).all()


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
        use_of_limits(limits, throughout, np.ones(3))
