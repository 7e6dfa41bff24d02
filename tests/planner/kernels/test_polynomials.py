"""Kernels of polynomials against numpy: derivatives, values, the roots of derivatives, and numbers of samples."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from planner.kernels.polynomials import (
    count_parts,
    evaluate,
    extrema,
    follow_scaling,
    shift,
    states_on_pieces,
    times_of_arrival,
    unit_derivatives,
)
from planner.tolerances import ROUNDING
from planner.trajectories.sampled_peaks import (
    FEWEST_PARTS,
    LEAST_PEAK_SHARE,
    MOST_PEAK_PARTS,
    OFF_PARABOLA,
    SAMPLES_PER_RADIAN,
)
from tests.planner.kernels import reference

DENSITY = np.array([LEAST_PEAK_SHARE, OFF_PARABOLA, MOST_PEAK_PARTS, SAMPLES_PER_RADIAN, FEWEST_PARTS])


def random_pieces(order: int, pieces: int = 7, joints: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths and coefficients of pieces of very different lengths, with values of about 1."""
    rng = np.random.default_rng(order)
    lengths = 10.0 ** rng.uniform(-4.0, 2.0, pieces)
    coefficients = rng.normal(size=(pieces, joints, order)) / lengths[:, None, None] ** np.arange(order)
    return lengths, coefficients


@pytest.mark.parametrize("order", [1, 2, 3, 4, 6, 8, 12])
def test_derivatives_and_values_are_those_of_numpy(order: int) -> None:
    lengths, coefficients = random_pieces(order)
    unit, bernstein = unit_derivatives(lengths, coefficients, 6)
    units = np.linspace(0.0, 1.0, 9)
    for piece, length in enumerate(lengths):
        at = np.full(9, piece)
        values = evaluate(unit, at, units)
        of_bernstein = [comb(order - 1, i) * units**i * (1.0 - units) ** (order - 1 - i) for i in range(order)]
        for joint in range(3):
            polynomial = Polynomial(coefficients[piece, joint])
            for k in range(6):
                expected = polynomial(units * length)
                scale = np.abs(polynomial.coef * length ** np.arange(len(polynomial.coef))).sum() + 1e-300
                assert values[k, :, joint] == pytest.approx(expected, abs=1e-13 * scale)
                assert bernstein[k, piece, joint] @ of_bernstein == pytest.approx(expected, abs=1e-13 * scale)
                polynomial = polynomial.deriv()


def largest_by_roots(coefficients: np.ndarray, directions: np.ndarray) -> float:
    """Find the largest of -p and p, each times its factor, on [0, 1]: at ends and roots of p'."""
    polynomial = Polynomial(coefficients)
    roots = polynomial.deriv().roots() if len(coefficients) > 1 else np.empty(0)
    inside = np.real(roots[np.abs(np.imag(roots)) < 1e-6])
    values = polynomial(np.concatenate([[0.0, 1.0], np.clip(inside, 0.0, 1.0)]))
    return float(np.maximum(-values * directions[0], values * directions[1]).max())


@pytest.mark.parametrize("order", [1, 2, 4, 6, 9])
@pytest.mark.parametrize("weighted", [False, True])
def test_extrema_are_at_roots_of_derivatives(order: int, weighted: bool) -> None:
    rng = np.random.default_rng(order)
    rows, groups = rng.normal(size=(40, order)), np.arange(40) % 7
    measure = 10.0 ** rng.uniform(-2.0, 2.0, 40)
    directions = np.ones((2, 40))
    if weighted:
        directions[rng.integers(0, 2, 40), np.arange(40)] = rng.uniform(0.0, 1.0, 40)
    _, bernstein = unit_derivatives(np.ones(40), rows[:, None], 1)
    at_row, at_unit = extrema(bernstein.reshape(40, order), measure, groups, directions if weighted else None, ROUNDING)
    for group in range(7):
        own = np.flatnonzero(groups == group)
        expected = max(largest_by_roots(rows[row], directions[:, row]) / measure[row] for row in own)
        assert at_row[group] in own
        value = float(Polynomial(rows[at_row[group]])(at_unit[group]))
        factor = directions[int(value > 0.0), at_row[group]]
        assert abs(value) * factor / measure[at_row[group]] == pytest.approx(expected, rel=1e-9)


def test_extrema_of_constants_of_nothing_and_of_no_number() -> None:
    """NaN counts as the largest extremum: a quantity that cannot be computed keeps no limit."""
    bernstein = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, np.nan], [5.0, 5.0]])
    groups = np.array([0, 0, 1, 2, 2])
    row, unit = extrema(bernstein, np.array([1.0, 1.0, np.inf, 1.0, 1.0]), groups, None, ROUNDING)
    assert row.tolist() == [0, 2, 3]
    assert unit.tolist() == [0.0, 0.0, 1.0]


def test_numbers_of_parts_are_those_of_numpy() -> None:
    for order in (4, 6, 8):
        lengths, coefficients = random_pieces(order, 30)
        coefficients[::5, 1] = 0.0
        _, bernstein = unit_derivatives(lengths, coefficients, 6)
        counts, expected = count_parts(bernstein, lengths, DENSITY), reference.parts_of(bernstein, lengths)
        assert np.abs(counts - expected).max() <= 1  # where rounding decides
        assert (counts != expected).mean() < 0.05


def test_an_index_beyond_the_pieces_is_refused() -> None:
    lengths, coefficients = random_pieces(4)
    unit, _ = unit_derivatives(lengths, coefficients, 2)
    for pieces in ([0, 7], [-1, 0]):
        with pytest.raises(ValueError, match="index"):
            evaluate(unit, np.array(pieces), np.zeros(2))


@pytest.mark.parametrize("order", [1, 2, 4, 6, 9])
def test_states_on_pieces_are_those_of_numpy(order: int) -> None:
    rng = np.random.default_rng(order)
    lengths, coefficients = rng.uniform(0.1, 2.0, 7), rng.normal(size=(7, 3, order))
    shares = np.array([0.0, 0.3, 1.0])
    states = states_on_pieces(lengths, coefficients, shares)
    for piece, joint, point in np.ndindex(7, 3, 3):
        polynomial = np.polynomial.Polynomial(coefficients[piece, joint])
        s = shares[point] * lengths[piece]
        expected = [polynomial(s), polynomial.deriv(1)(s), polynomial.deriv(2)(s)]
        assert states[:, point, piece, joint] == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("order", [1, 2, 4, 6, 9])
def test_shifted_polynomials_have_the_values_of_the_others_further_on(order: int) -> None:
    rng = np.random.default_rng(order)
    coefficients, by = rng.normal(size=(20, order)), rng.uniform(-2.0, 2.0, 20)
    by[3] = 0.0
    shifted = shift(coefficients, by)
    assert (shifted[3] == coefficients[3]).all()
    for own, other, further in zip(coefficients, shifted, by, strict=True):
        x = rng.uniform(-1.0, 1.0, 5)
        expected = np.polynomial.Polynomial(own)(x + further)
        assert np.polynomial.Polynomial(other)(x) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_motion_along_a_curve_is_the_polynomial_of_a_polynomial() -> None:
    """Its position and three time derivatives equal the multiplied-out polynomial q(s(t))."""
    rng = np.random.default_rng(4)
    lengths, coefficients = rng.uniform(1.0, 2.0, 3), rng.normal(size=(3, 2, 6))
    breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
    scaling = np.array([[0.1, 0.5, 0.2, -0.1], [breakpoints[1] + 0.1, 0.3, 0.1, 0.05]])
    of, on, t = np.array([0, 0, 1, 1]), np.array([0, 0, 1, 1]), np.array([0.0, 0.7, 0.2, 0.5])
    s, q, slopes = follow_scaling((lengths, breakpoints, coefficients), scaling, of, on, t)
    for k in range(4):
        law = Polynomial(scaling[of[k]])
        assert s[:, k] == pytest.approx([law(t[k]), law.deriv()(t[k]), law.deriv(2)(t[k])], rel=1e-12)
        for joint in range(2):
            whole = Polynomial(coefficients[on[k], joint])(law - breakpoints[on[k]])
            expected = [whole(t[k]), *(whole.deriv(order)(t[k]) for order in (1, 2, 3))]
            assert q[:, k, joint] == pytest.approx(expected, rel=1e-9, abs=1e-9)
            on_path = Polynomial(coefficients[on[k], joint])
            expected = [on_path.deriv(order)(law(t[k]) - breakpoints[on[k]]) for order in (1, 2)]
            assert slopes[:, k, joint] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_times_of_arrival_are_roots() -> None:
    """Products of ascending factors reach their values at roots of numpy, or end where they do not."""
    rng = np.random.default_rng(5)
    coefficients = np.abs(rng.normal(size=(50, 6)))
    lengths, shares = rng.uniform(0.1, 2.0, 50), rng.uniform(0.01, 1.2, 50)
    values = np.array([Polynomial(c)(share * h) for c, share, h in zip(coefficients, shares, lengths, strict=True)])
    found = times_of_arrival(coefficients, lengths, values, 60)
    assert found == pytest.approx(np.minimum(shares, 1.0) * lengths, rel=1e-9)
    assert len(times_of_arrival(np.empty((0, 6)), np.empty(0), np.empty(0), 60)) == 0
