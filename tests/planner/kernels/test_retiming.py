"""The kernel of retiming: its objective against differences, its optimum against scipy's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from planner.kernels.retiming import (
    Objective,
    PathCost,
    best_unknowns,
    joint_rows,
    largest_scales,
    retime_scaling,
    smooth_start,
    spline_maps,
)
from planner.time_scaling.fastest import GAUSS_RULE
from planner.time_scaling.linear_limits import LinearLimits, QuadraticSpline
from planner.time_scaling.retiming import RequestedDurations, of_duration
from tests.planner.kernels import linear_limits as by_numpy

if TYPE_CHECKING:
    from planner.spatial import FloatArray

TOLERANCE = 1e-5


@pytest.mark.parametrize(("power", "smoothing"), [(-0.5, 0.0), (0.0, 1e-3), (0.5, 0.0)])
def test_derivatives_by_differences(power: float, smoothing: float) -> None:
    """The slope agrees, and so does the curvature, except where it is cut to stay convex and where a parabola replaces
    |y|."""
    rng = np.random.default_rng(1)
    cost = PathCost(rng.normal(size=(4, 4, 15)), power, smoothing)
    objective = Objective(of_duration(rng.uniform(0.1, 0.5, 5)).weights, 500.0, (cost,))
    states, none, step = rng.uniform(0.5, 1.5, (3, 15)), np.zeros(15), 1e-6

    def value(at: FloatArray) -> float:
        return objective.at(at, none)[0]

    _, slope, packed = objective.at(states, none)
    units = np.eye(45).reshape(3, 15, 3, 15)
    differences = [
        [(value(states + step * unit) - value(states - step * unit)) / (2.0 * step) for unit in row] for row in units
    ]
    assert slope == pytest.approx(np.array(differences), rel=1e-5, abs=1e-6)
    curvature = packed[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    for k in range(3):
        change = np.zeros_like(states)
        change[k] = step
        by_k = (objective.at(states + change, none)[1] - objective.at(states - change, none)[1]) / (2.0 * step)
        if smoothing:
            assert (curvature[k, k] >= by_k[k] - 1e-6 * np.abs(by_k[k]).max()).all()
        else:
            assert curvature[k] == pytest.approx(by_k, rel=1e-5, abs=1e-6)


def problem(seed: int, jerk: float) -> tuple[FloatArray, LinearLimits]:
    """Draw the widths of four intervals and three limits, whose bounds depend on 1 / sqrt(b) by a share."""
    rng = np.random.default_rng(seed)
    widths, shape = rng.uniform(0.3, 1.0, 4), (3, 12)
    by_b, by_a = rng.uniform(-1.0, 1.0, (2, *shape))
    by_b[0] = rng.uniform(0.5, 2.0, 12)
    by_a[0] = 0.0
    by_c, offset = jerk * rng.uniform(-0.2, 0.2, shape), (1.0 - jerk) * rng.uniform(-0.5, 0.5, shape)
    bound = np.ones(shape) * np.array([1.0, 1.0 - jerk, 1.0 - jerk])[:, None]
    return widths, LinearLimits(by_b, by_a, by_c, offset, bound, 1.0 - bound)


def slacks(limits: LinearLimits, states: FloatArray) -> FloatArray:
    b, a, c = states
    values = limits.by_b * b + limits.by_a * a + limits.by_c * c + limits.offset
    bound = limits.constant + limits.inverse / np.sqrt(np.abs(states[0]) + 1e-300)
    return np.concatenate([bound - values, bound + values]).ravel()


@pytest.mark.parametrize("jerk", [0.0, 1.0])
@pytest.mark.parametrize("kind", ["duration", "effort", "work", "requested"])
@pytest.mark.parametrize("seed", range(4))
def test_the_best_law_is_that_of_scipy(seed: int, kind: str, jerk: float) -> None:
    """With bounds that depend on 1 / sqrt(b) the problem is not convex: scipy must find no better optimum."""
    widths, limits = problem(seed, jerk)
    spline, rng = QuadraticSpline(widths), np.random.default_rng(seed + 100)
    rows = rng.normal(size=(4, 2, 12)) * np.array([1.0, 1.0, 0.0, 0.3])[:, None, None]
    costs = {"effort": (PathCost(rows, -0.5),), "work": (PathCost(rows, 0.0, 1e-3),)}.get(kind, ())
    objective = Objective(of_duration(widths).weights, 1.0, costs)
    start = np.ones(6)
    start *= 0.9 * limits.scale(spline.states(start))
    parts = np.array([[True, True, False, False]]) if kind == "requested" else np.empty((0, 4), dtype=bool)
    requested = RequestedDurations.of_parts(widths, parts, np.empty(len(parts)))
    requested = RequestedDurations(requested.weights, 1.2 * (requested.weights @ spline.states(start)[0] ** -0.5))
    x, converged = best_unknowns(spline.maps, limits.arrays, objective, requested, TOLERANCE, 500, start)
    assert converged
    assert slacks(limits, spline.states(x)).min() > 0.0
    assert x.min() > 0.0
    assert requested.missed(spline.states(x)[0]) == pytest.approx(0.0, abs=1e-4)
    none = np.zeros(12)
    constraints = [{"type": "ineq", "fun": lambda y: slacks(limits, spline.states(y))}]
    constraints += (
        [{"type": "eq", "fun": lambda y: requested.missed(spline.states(np.abs(y))[0])}] if len(parts) else []
    )
    peer = minimize(
        lambda y: objective.at(spline.states(np.abs(y)), none)[0],
        x * rng.uniform(0.97, 1.0, 6),
        bounds=[(1e-9, None)] * 6,
        constraints=constraints,
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    kept = slacks(limits, spline.states(peer.x)).min() > -1e-9
    value = objective.at(spline.states(x), none)[0]
    assert value <= peer.fun * (1.0 + 1e-4) or not kept
    if not jerk and peer.success and kept:
        assert value == pytest.approx(peer.fun, rel=1e-4)


@given(st.integers(0, 2**32), st.integers(1, 12), st.booleans())
def test_the_maps_of_random_splines(seed: int, count: int, begins_evenly: bool) -> None:
    widths = np.random.default_rng(seed).uniform(0.01, 2.0, count)
    expected = by_numpy.spline_maps(widths, begins_evenly=begins_evenly)
    assert spline_maps(widths, begins_evenly=begins_evenly) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def rows(seed: int, count: int, width: int, spread: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """Draw widths of intervals, and limits of every kind: of speeds, with rest, of jerks, of powers, of nothing."""
    rng = np.random.default_rng(seed)
    limits = [*(rng.normal(size=(6, width, 3 * count)) * np.exp(spread * rng.normal(size=3 * count)))]
    limits[3] = rng.uniform(-0.9, 0.9, limits[3].shape) * (rng.random((width, 1)) < 0.6)
    grows = rng.random((width, 1)) < 0.4
    limits[4], limits[5] = np.where(grows, 0.0, np.ones_like(limits[0])), np.where(grows, np.ones_like(limits[0]), 0.0)
    limits[0][0], limits[3][0], limits[4][0], limits[5][0] = np.abs(limits[0][0]) + 0.1, 0.0, 1.0, 0.0
    if width > 2:
        limits[0][1] = limits[1][1] = limits[2][1] = limits[3][1] = 0.0
    return rng.uniform(0.1, 1.0, count), limits


@given(st.integers(0, 2**32), st.integers(1, 12), st.integers(1, 6))
def test_the_scales_of_random_limits(seed: int, count: int, width: int) -> None:
    _, limits = rows(seed, count, width, 0.5)
    states = np.random.default_rng(seed + 1).uniform(0.2, 2.0, (3, 3 * count))
    assert largest_scales(limits, states) == pytest.approx(by_numpy.scales(limits, states), rel=1e-12)
    ones = np.array([[1.0], [0.0], [0.0]])
    assert largest_scales(limits, ones) == pytest.approx(by_numpy.scales(limits, ones), rel=1e-12)


@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(1, 6), st.sampled_from([0.1, 1.0, 5.0]))
def test_the_start_within_random_limits(seed: int, count: int, width: int, spread: float) -> None:
    widths, limits = rows(seed, count, width, spread)
    given = spline_maps(widths, begins_evenly=False), limits, of_duration(widths).weights
    rule = np.unique(np.minimum([1, 2, 5], count)), 1e6, 0.8
    assert smooth_start(*given, *rule) == pytest.approx(by_numpy.smooth_start(*given, *rule), rel=1e-9)


@given(st.integers(0, 2**32), st.integers(0, 3), st.booleans())
def test_random_limits_of_joints_as_rows(seed: int, others: int, limits_path_speed: bool) -> None:
    rng = np.random.default_rng(seed)
    segments, joints, points = 4, 3, 10
    sides = rng.uniform(0.5, 2.0, (4, segments, joints))
    sides[rng.random(sides.shape) < 0.2] = np.inf
    centred = np.array([rng.normal(size=(segments, joints)), sides[2]])
    limits = np.array([-sides[0], sides[1]]), centred, sides[3]
    motion = rng.normal(size=(4, points, joints)) * (rng.random((4, points, joints)) < 0.9)
    given = 1 + 2 * joints + others, rng.integers(0, segments, points), limits, motion
    speeds = rng.uniform(0.0, 3.0, points) if limits_path_speed else None
    found, expected = joint_rows(*given, speeds), by_numpy.joint_rows(*given, speeds)
    assert found[:, : 1 + 2 * joints] == pytest.approx(expected[:, : 1 + 2 * joints], rel=1e-12)
    assert found.shape == expected.shape


@given(st.integers(0, 2**32), st.integers(1, 8))
def test_a_random_time_scaling_after_a_retiming(seed: int, count: int) -> None:
    """Pieces that meet in position, velocity and acceleration."""
    rng = np.random.default_rng(seed)
    widths, starts, scaling = rng.uniform(0.3, 1.5, count), np.array([0.0, 1.0, 0.1]), np.empty((count, 5))
    for i, h in enumerate(widths):
        scaling[i] = [*starts, *rng.uniform(-0.1, 0.1, 2)]
        law = np.polynomial.Polynomial(scaling[i])
        starts = np.array([law(h), law.deriv()(h), law.deriv(2)(h) / 2.0])
    given = widths, scaling, rng.uniform(0.3, 2.0, count + 2), GAUSS_RULE
    for own, peer in zip(retime_scaling(*given), by_numpy.retime_scaling(*given), strict=True):
        assert own == pytest.approx(peer, rel=1e-8, abs=1e-8)
