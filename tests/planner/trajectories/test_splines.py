"""Natural cubic splines against scipy's, and slopes with which no curve overshoots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from planner.trajectories.polynomials import PiecewisePolynomial, quintic_hermite
from planner.trajectories.splines import natural_spline, slopes_between


@pytest.mark.parametrize("pieces", [1, 2, 3, 20])
def test_a_natural_spline_is_that_of_scipy(pieces: int) -> None:
    rng = np.random.default_rng(pieces)
    lengths, values = rng.uniform(0.1, 2.0, pieces), rng.normal(size=(pieces + 1, 3))
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, knots[-1], 500)
    own = PiecewisePolynomial(lengths, natural_spline(lengths, values)).evaluate(at, [0])[0]
    np.testing.assert_allclose(own, CubicSpline(knots, values, bc_type="natural")(at), atol=1e-12)


def test_a_curve_with_these_slopes_rises_only_where_its_points_do() -> None:
    values = np.random.default_rng(0).normal(size=(40, 1)) ** 3
    values[10:13] = values[10]  # a flat part
    means = np.diff(values, axis=0)
    slopes = np.vstack([means[:1], slopes_between(means[:-1], means[1:]), means[-1:]])
    flat = np.zeros_like(values)
    lengths = np.ones(len(means))
    starts, ends = (values[:-1], slopes[:-1], flat[:-1]), (values[1:], slopes[1:], flat[1:])
    curve = PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))
    for k, rise in enumerate(means[:, 0].tolist()):
        steps = np.diff(curve.evaluate(np.linspace(k, k + 1, 100), [0])[0][:, 0])
        assert (steps * np.sign(rise) >= -1e-12).all()
