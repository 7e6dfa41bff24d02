"""The fastest profile by the kernel against linear programs that are solved by trying every corner."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.kernels.profile import fastest_profile

Rows = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Limits a u + b x + c <= 0 on intervals, each (intervals, rows)."""


def corners(rows: np.ndarray) -> np.ndarray:
    """The points (corners, 2) (x, u) within a u + b x + c <= 0, rows (rows, 3), where two of these meet."""
    found = []
    for first, second in combinations(rows / np.linalg.norm(rows[:, :2], axis=1, keepdims=True), 2):
        matrix = np.array([[first[1], first[0]], [second[1], second[0]]])
        if abs(np.linalg.det(matrix)) > 1e-14:
            found.append(np.linalg.solve(matrix, -np.array([first[2], second[2]])))
    points = np.array(found)
    values = points @ rows[:, 1::-1].T + rows[:, 2]
    size = np.abs(points) @ np.abs(rows[:, 1::-1]).T + np.abs(rows[:, 2])
    inside: np.ndarray = points[(values <= 1e-9 * size).all(axis=1)]
    return inside


def reference(lengths: np.ndarray, rows: Rows, bounds: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Do what the kernel does: the largest x of each linear program backward, the largest u forward."""
    count = len(lengths)
    controllable, x = np.zeros(count + 1), np.zeros(count + 1)
    polygons = [np.empty((0, 3))] * count
    for i in range(count - 1, -1, -1):
        own = np.column_stack([part[i] for part in rows])
        step, following = 2.0 * lengths[i], controllable[i + 1]
        more = [[0, 1, -bounds[i]], [0, -1, 0], [step, 1, -following], [-step, -1, 0]]
        polygons[i] = np.vstack([own[np.abs(own[:, :2]).max(axis=1) > 0.0], more])
        controllable[i] = 0.0 if rests[i] else corners(polygons[i])[:, 0].max()
    for i in range(count):
        a, b, c = polygons[i][polygons[i][:, 0] > 0.0].T
        u = (-(b * x[i] + c) / a).min()
        x[i + 1] = min(max(x[i] + 2.0 * lengths[i] * u, 0.0), controllable[i + 1])
    return controllable, x


def problem(seed: int, count: int, rows: int, bend: float = 1.0) -> tuple[np.ndarray, Rows, np.ndarray, np.ndarray]:
    """Random limits from below and from above, as a path has them."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, 1.0, count)
    a = rng.normal(size=(count, rows)) * (rng.random((count, rows)) < 0.8)
    b = bend * rng.normal(size=(count, rows)) * (rng.random((count, rows)) < 0.8)
    c = rng.uniform(-0.95, 0.95, (count, rows))
    both = np.hstack([a, -a]), np.hstack([b, -b]), np.hstack([c, -c]) - 1.0
    rests = rng.random(count + 1) < 0.1
    rests[[0, -1]] = True
    return lengths, both, rng.uniform(0.2, 3.0, count + 1), rests


@given(seed=st.integers(0, 2**32), count=st.integers(1, 12), rows=st.integers(1, 4), bend=st.sampled_from([0.1, 1, 30]))
def test_random_limits(seed: int, count: int, rows: int, bend: float) -> None:
    lengths, limits, bounds, rests = problem(seed, count, rows, bend)
    expected = reference(lengths, limits, bounds, rests)
    for own, other in zip(fastest_profile(lengths, *limits, bounds, rests), expected, strict=True):
        assert own == pytest.approx(other, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("size", [1e-12, 1e-4, 1.0, 1e6])
@pytest.mark.parametrize("speed", [1e-6, 1.0, 1e5])
def test_the_units_of_length_and_time_do_not_matter(size: float, speed: float) -> None:
    """s is `size` times as long, x = s'^2 so many times `speed`^2: the kernel has no tolerance in a unit."""
    lengths, (a, b, c), bounds, rests = problem(5, 40, 3)
    x = fastest_profile(lengths, a, b, c, bounds, rests)[1]
    scale = (size * speed) ** 2
    scaled = fastest_profile(lengths * size, a * size / scale, b / scale, c, bounds * scale, rests)[1]
    assert scaled / scale == pytest.approx(x, rel=1e-9, abs=1e-12)


def test_limits_that_all_but_bind_at_rest() -> None:
    """Gravity takes 0.9999 of a torque: hardly any acceleration is left, and none is lost."""
    count = 1000
    a, b = np.ones((count, 2)) * [1.0, -1.0], np.zeros((count, 2))
    c = np.full((count, 2), -1.0) + np.array([0.9999, -0.9999])
    rests = np.isin(np.arange(count + 1), [0, count])
    controllable, x = fastest_profile(np.full(count, 1.0 / count), a, b, c, np.full(count + 1, 10.0), rests)
    s = np.linspace(0.0, 1.0, count + 1)
    assert x == pytest.approx(np.minimum(2e-4 * s, 2.0 * 1.9999 * (1.0 - s)), rel=1e-9)
    assert controllable == pytest.approx(np.minimum(2.0 * 1.9999 * (1.0 - s), 10.0) * (s > 0.0), rel=1e-9)


def test_limits_without_acceleration_bound_the_speed_alone() -> None:
    """A path that turns on the spot: b x <= 1 with a = 0, a singular row, beside one of rounding."""
    a = np.array([[1.0, -1.0, 0.0], [1.0, -1.0, 1e-14], [1.0, -1.0, 0.0]])
    b = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 0.0, 0.0]])
    rests = np.array([True, False, False, True])
    x = fastest_profile(np.ones(3), a, b, np.full((3, 3), -1.0), np.full(4, 9.0), rests)[1]
    assert x == pytest.approx([0.0, 0.25, 2.0, 0.0])


def test_intervals_next_to_nothing() -> None:
    """Waypoints 1e-12 apart: such an interval changes x by next to nothing."""
    lengths = np.where(np.arange(30) % 3 == 1, 1e-12, 0.1)
    a, b = np.ones((30, 2)) * [1.0, -1.0], np.zeros((30, 2))
    rests = np.isin(np.arange(31), [0, 30])
    x = fastest_profile(lengths, a, b, np.full((30, 2), -1.0), np.full(31, 50.0), rests)[1]
    s = np.append(0.0, np.cumsum(lengths))
    assert x == pytest.approx(2.0 * np.minimum(s, s[-1] - s), abs=1e-12)


def test_the_same_bytes_on_every_run() -> None:
    given = problem(3, 500, 8)
    first, second = (fastest_profile(given[0], *given[1], *given[2:]) for _ in range(2))
    assert [part.tobytes() for part in first] == [part.tobytes() for part in second]


def test_wrong_shapes_are_refused() -> None:
    lengths, (a, b, c), bounds, rests = problem(3, 5, 2)
    with pytest.raises(ValueError, match="shape"):
        fastest_profile(lengths, a, b[:, 1:], c, bounds, rests)
    with pytest.raises(ValueError, match="shape"):
        fastest_profile(lengths, a, b, c, bounds[1:], rests)
