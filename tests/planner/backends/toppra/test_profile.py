"""The times of a profile against numerical quadrature."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from planner.backends.toppra.intervals import Intervals
from planner.backends.toppra.profile import Profile


@pytest.mark.parametrize("ends", [(0.0, 1.0), (0.0, 0.5), (0.5, 1.0)])
@given(
    x=st.tuples(st.floats(1e-3, 1.0), st.sampled_from([0.0, 1e-6, 1e-2, 0.5, 1.0])),
    length=st.floats(1e-3, 10.0),
    share=st.one_of(st.floats(-0.9, 0.9), st.sampled_from([0.0, 1e-3, -1e-3, 1e-6])),
)
def test_times_are_the_integral_of_one_by_the_path_velocity(
    ends: tuple[float, float], x: tuple[float, float], length: float, share: float
) -> None:
    """With x quadratic in s: from rest, to rest, and nearly so."""
    bend = share * (np.sqrt(x[0]) + np.sqrt(x[1])) ** 2 / 2.0 / length
    one = np.zeros(1, dtype=int)
    profile = Profile(Intervals(np.array([length]), np.zeros((1, 1, 1)), one, one), np.array(x), np.array([bend]))

    def rate(w: float) -> float:
        # p = 1 - w^2 makes the integrand finite where the robot comes to rest.
        p = 1.0 - w * w
        return 2.0 * w * length / np.sqrt(x[0] * (1.0 - p) + x[1] * p - 2.0 * bend * length * p * (1.0 - p))

    start, end = ends
    knots = [0.01, 0.1]
    low, high = np.sqrt(1.0 - end), np.sqrt(1.0 - start)
    edges = [low, *(knot for knot in knots if low < knot < high), high]
    time = sum(quad(rate, a, b, epsrel=1e-10, limit=500)[0] for a, b in itertools.pairwise(edges))
    assert profile.times_between(start, end)[0] == pytest.approx(time, rel=1e-7)
