"""The step rule of interior points against brute force and a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from planner.time_scaling.interior_point import InteriorPoint, longest_step, next_centring


@pytest.mark.parametrize("share", [0.5, 0.98, 0.99])
def test_the_longest_step_keeps_what_is_positive_positive(share: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        values, changes = rng.uniform(1e-9, 1.0, (2, 3)), rng.normal(size=(2, 3)) * 10.0 ** rng.uniform(-6, 6)
        step = longest_step(values, changes, share)
        assert 0.0 < step <= 1.0
        assert ((values + step * changes) / values).min() >= (1.0 - share) * (1.0 - 1e-9)
        if step < 1.0:
            assert (values + step / share * changes).min() == pytest.approx(0.0, abs=1e-9)


def test_a_step_of_nothing_is_made_in_full() -> None:
    assert longest_step(np.empty(0), np.empty(0)) == 1.0
    assert longest_step(np.ones(3), np.zeros(3)) == 1.0


def test_the_central_path_is_where_newton_leads() -> None:
    """One variable between 0 and 1, cost x: on the central path mu = x (1 - x) / (1 - 2 x)."""
    x, mu = 0.5, 0.01
    point = InteriorPoint.on_central_path(np.array([x, 1.0 - x]), 1.0)
    assert point.gap == pytest.approx(2.0)
    for _ in range(60):
        terms = point.towards(mu)
        change = (-1.0 + terms.push[0] - terms.push[1]) / terms.stiffness.sum()
        step = point.step(terms, np.array([change, -change]))
        x += step.primal * change
        point = point.moved(np.array([x, 1.0 - x]), step)
    assert mu * (1.0 - 2.0 * x) == pytest.approx(x * (1.0 - x), rel=1e-9)
    assert point.slacks * point.duals == pytest.approx([mu, mu], rel=1e-9)


def test_the_barrier_falls_by_more_after_longer_steps() -> None:
    shares = [next_centring(made, 0.1) for made in (0.0, 0.3, 0.9, 0.999, 1.0)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] == 1.0
    assert shares[-1] == 0.1
