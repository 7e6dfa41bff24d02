"""The kernels of splines: peaks against the roots that numpy finds, long splines against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import make_interp_spline

from planner.kernels.splines import interpolate, peaks, sensitivities

SEARCH = (0.65, 0.1, 1e-5, 1e-6, 30.0)
"""Thresholds of peaks as shares of the worst rate and of the span, and their accuracy."""

RATES = {3: 2, 5: 3}
DEGREES = (3, 5)


def spline(seed: int, segments: int, degree: int, cuts: float = 0.0) -> tuple[np.ndarray, ...]:
    """Draw durations, given velocities, coefficients on unit time and positions of a spline of three joints."""
    rng = np.random.default_rng(seed)
    positions, durations = rng.uniform(-2.0, 2.0, (segments + 1, 3)), rng.uniform(0.2, 2.0, segments)
    given = rng.random(segments - 1) < cuts
    unit, _ = interpolate(degree, positions, durations, rng.normal(size=(segments - 1, 3)), given)
    return durations, given, unit, positions


@given(
    seed=st.integers(0, 2**32),
    segments=st.integers(1, 6),
    degree=st.sampled_from(DEGREES),
    cuts=st.sampled_from([0.0, 0.4]),
)
def test_the_worst_peaks_are_those_that_numpy_finds(seed: int, segments: int, degree: int, cuts: float) -> None:
    durations, given, unit, positions = spline(seed, segments, degree, cuts)
    rng = np.random.default_rng(seed + 1)
    rates = tuple(sign * rng.uniform(0.5, 3.0, (RATES[degree], segments, 3)) for sign in (-1.0, 1.0))
    span, position = np.ptp(positions, axis=0), (positions.min(axis=0), positions.max(axis=0))
    (segment, joint, order), (u, value, excess, _) = peaks(durations, given, unit, span, rates, position, SEARCH)
    largest, outside = np.zeros(segments), np.zeros((segments, 3))
    for s in range(segments):
        for j in range(3):
            whole = Polynomial(unit[s, j])
            for d in range(RATES[degree] + 1):
                curve, turns = whole.deriv(d) if d else whole, whole.deriv(d + 1).roots()
                inner = [turn.real for turn in turns if abs(turn.imag) < 1e-9 and 1e-4 < turn.real < 1.0 - 1e-4]
                ends = [0.0, 1.0]
                if d == 1:  # a velocity that is given is no peak
                    ends = [end for end in ends if not np.append(np.append(False, given), False)[s + int(end)]]
                values = curve(np.array([*ends, *inner])) / durations[s] ** d
                if d == 0:
                    outside[s, j] = max((values - position[1][j]).max(), (position[0][j] - values).max()) / span[j]
                elif len(values):
                    used = values / np.where(values < 0.0, rates[0][d - 1, s, j], rates[1][d - 1, s, j])
                    largest[s] = max(largest[s], used.max() ** (1.0 / d))
    found = np.zeros(segments)
    np.maximum.at(found, segment[order > 0], np.exp(excess[order > 0]))
    parts = np.append(0, np.cumsum(given))
    for part in np.unique(parts):
        own = parts == part
        assert found[own].max() == pytest.approx(largest[own].max(), rel=1e-6)
    overshoot = np.zeros((segments, 3))
    np.maximum.at(overshoot, (segment[order == 0], joint[order == 0]), excess[order == 0])
    assert overshoot == pytest.approx(np.maximum(outside, 0.0), abs=1e-7)
    for s, j, d, at, own in zip(segment, joint, order, u, value, strict=True):
        expected = Polynomial(unit[s, j]).deriv(int(d))(at) if d else Polynomial(unit[s, j])(at)
        assert own * durations[s] ** d == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("degree", DEGREES)
def test_long_splines_are_those_of_scipy_and_forget_far_durations(degree: int) -> None:
    """In 300 segments, the first duration affects the last segment by less than rounding, but near segments by more."""
    durations, given, unit, positions = spline(3, 300, degree)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    rest = [(order, np.zeros(3)) for order in range(1, (degree + 1) // 2)]
    peer = make_interp_spline(times, positions, k=degree, bc_type=(rest, rest))
    starts = unit[:, :, 1] / durations[:, None]
    assert starts == pytest.approx(peer(times[:-1], 1), rel=1e-8, abs=1e-8)
    _, ends = interpolate(degree, positions, durations, np.zeros((299, 3)), given)
    one = np.ones(1, dtype=int)
    slopes = sensitivities(durations, given, ends, (150 * one, one, one, np.array([0.3])))[0]
    scale = np.abs(slopes).max()
    assert np.abs(slopes[[0, -1]]).max() <= 1e-15 * scale
    for k in (149, 150, 151, 160):
        change = 1e-6 * (np.arange(300) == k)
        both = [
            interpolate(degree, positions, durations * np.exp(s * change), np.zeros((299, 3)), given)[0]
            for s in (-1, 1)
        ]
        speeds = [
            Polynomial(each[150, 1]).deriv()(0.3) / (durations[150] * np.exp(s * change[150]))
            for each, s in zip(both, (-1, 1), strict=True)
        ]
        assert slopes[k] == pytest.approx((speeds[1] - speeds[0]) / 2e-6, rel=1e-5, abs=1e-6 * scale)
