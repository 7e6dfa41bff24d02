"""Samples of a curve are located on it, even if parts are left out, and at sharp bends."""

from __future__ import annotations

import numpy as np
import pytest

from planner.certificate.on_curve import parameters_on
from planner.trajectories.polynomials import PiecewisePolynomial, quintic_hermite


@pytest.mark.parametrize("seed", range(3))
def test_samples_are_found_wherever_they_are(seed: int) -> None:
    """Quintics pass random points slowly or fast; u is known for each sample."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.01, 1.0, 30)
    lengths /= lengths.sum()
    points = np.cumsum(rng.normal(size=(31, 6)) * 0.02, axis=0)
    rates, bends = rng.normal(size=(31, 6)) * 2.0, rng.normal(size=(31, 6)) * 300.0
    states = (points, rates, bends)
    starts, ends = tuple(x[:-1] for x in states), tuple(x[1:] for x in states)
    curve = PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))
    u = np.linspace(0.0, 1.0, 601)
    for kept in (u >= 0.0, (u > 0.3) & (u < 0.9), (u > 0.05) & ((u < 0.4) | (u > 0.45))):
        (samples,) = curve.evaluate(u[kept], [0])
        found = parameters_on(curve, samples)
        away = np.linalg.norm(samples - curve.evaluate(found, [0])[0], axis=1)
        assert away.max() < 1e-5
