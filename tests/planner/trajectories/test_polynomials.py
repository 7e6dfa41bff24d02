"""Piecewise polynomials, checked against scipy's PPoly and BPoly, numpy's polynomials and exact fractions."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import fsum

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly, PPoly

from planner.trajectories.polynomials import (
    PiecewisePolynomial,
    SegmentedPolynomial,
    bernstein_matrix,
    cumulative_sums,
    joined,
    quintic_hermite,
    shifted,
    summing_to,
)
from planner.trajectories.trajectory import Trajectory

LENGTHS = {
    "equal": lambda count, rng: np.full(count, 0.25),
    "random": lambda count, rng: rng.uniform(0.1, 2.0, count),
    "tiny": lambda count, rng: rng.uniform(1.0, 2.0, count) * 1e-9,
    "huge": lambda count, rng: rng.uniform(1.0, 2.0, count) * 1e6,
    "tiny beside huge": lambda count, rng: 10.0 ** rng.uniform(-6.0, 3.0, count),
}
"""Lengths of pieces by their kind."""

curves = st.builds(
    lambda kind, count, joints, order, seed: curve_of(kind, count, joints, order, np.random.default_rng(seed)),
    kind=st.sampled_from(sorted(LENGTHS)),
    count=st.sampled_from([1, 2, 3, 10, 300]),
    joints=st.integers(1, 3),
    order=st.integers(1, 8),
    seed=st.integers(0, 2**31),
)


def curve_of(kind: str, count: int, joints: int, order: int, rng: np.random.Generator) -> SegmentedPolynomial:
    """Draw pieces with terms of size 1, some zero, and repeated pieces; the curve jumps between them."""
    lengths = LENGTHS[kind](count, rng)
    terms = rng.uniform(-1.0, 1.0, (count, joints, order)) * rng.choice([0.0, 1.0, 1.0], (count, joints, order))
    terms[1::3] = terms[: len(terms[1::3])]
    return SegmentedPolynomial(lengths, terms / lengths[:, None, None] ** np.arange(order), np.arange(count) // 2)


def in_scipy(curve: PiecewisePolynomial) -> PPoly:
    """Return the same curve by scipy, with descending powers."""
    return PPoly(np.moveaxis(curve.coefficients, 2, 0)[::-1], curve.breakpoints, extrapolate=False)


def inside(curve: PiecewisePolynomial, per_piece: int = 4) -> np.ndarray:
    """Return points within all pieces, away from breakpoints, where rounding decides the piece."""
    unit = (np.arange(per_piece) + 0.5) / per_piece
    return (curve.breakpoints[:-1, None] + unit * curve.lengths[:, None]).ravel()


def assert_same(values: np.ndarray, expected: np.ndarray, size: float = 1.0, rounding: float = 1e-12) -> None:
    assert values.shape == expected.shape
    assert np.abs(values - expected).max() <= rounding * size


def rounding_of(curve: PiecewisePolynomial) -> float:
    """Return the relative error of values of size 1 at points rounded like numbers as large as the whole curve."""
    return 1e-13 + 100.0 * np.finfo(float).eps * curve.breakpoints[-1] / curve.lengths.min()


@given(curve=curves)
def test_values_and_derivatives_are_those_of_scipy(curve: SegmentedPolynomial) -> None:
    at, order = inside(curve), curve.coefficients.shape[2]
    for k, values in enumerate(curve.evaluate(at, range(order + 2))):
        expected = in_scipy(curve)(at, nu=k)
        # The derivatives of a piece grow with the inverse of its length to the power of their order.
        size = np.repeat(40320.0 / curve.lengths**k, 4)[:, None]
        assert_same(values / size, expected / size)


@given(curve=curves)
def test_a_breakpoint_belongs_to_the_later_piece_and_the_end_to_the_last(curve: SegmentedPolynomial) -> None:
    starts = curve.evaluate(curve.breakpoints[:-1], [0])[0]
    assert np.array_equal(starts, curve.coefficients[:, :, 0])
    end = curve.evaluate(curve.breakpoints[-1:], [0])[0]
    powers = curve.lengths[-1] ** np.arange(curve.coefficients.shape[2])
    assert_same(end[0], (curve.coefficients[-1] * powers).sum(axis=1), 8.0, rounding_of(curve))


@given(curve=curves, factor=st.sampled_from([1e-6, 0.3, 1.0, 2.0, 1e6]))
def test_a_stretched_curve_has_the_same_values_at_stretched_points(curve: SegmentedPolynomial, factor: float) -> None:
    slower, at = curve.stretched(factor), inside(curve)
    assert isinstance(slower, SegmentedPolynomial)
    assert np.array_equal(slower.lengths, curve.lengths * factor)
    for k, values in enumerate(slower.evaluate(at * factor, range(3))):
        size = np.repeat(40320.0 / slower.lengths**k, 4)[:, None]
        assert_same(values / size, in_scipy(curve)(at, nu=k) / factor**k / size, 1.0, rounding_of(curve))


@given(curve=curves, seed=st.integers(0, 2**31))
def test_pieces_are_stretched_by_themselves_and_back(curve: SegmentedPolynomial, seed: int) -> None:
    factors = 10.0 ** np.random.default_rng(seed).uniform(-3.0, 3.0, len(curve.lengths))
    slower = curve.stretched(factors)
    for piece, factor in enumerate(factors[:20].tolist()):
        alone = PiecewisePolynomial(curve.lengths[piece : piece + 1], curve.coefficients[piece : piece + 1])
        assert np.array_equal(slower.coefficients[piece], alone.stretched(factor).coefficients[0])
    back = slower.stretched(1.0 / factors)
    assert back.lengths == pytest.approx(curve.lengths, rel=1e-15)
    scales = curve.lengths[:, None, None] ** np.arange(curve.coefficients.shape[2])
    assert_same(back.coefficients * scales, curve.coefficients * scales, 1.0, 1e-13)


@given(curve=curves, seed=st.integers(0, 2**31))
def test_a_split_curve_is_the_same_curve(curve: SegmentedPolynomial, seed: int) -> None:
    parts = np.random.default_rng(seed).integers(1, 6, len(curve.lengths))
    split, at = curve.split(parts), inside(curve, 3)
    assert len(split.lengths) == parts.sum()
    assert split.breakpoints[np.append(0, np.cumsum(parts))] == pytest.approx(curve.breakpoints, rel=1e-14)
    assert np.array_equal(split.segments, np.repeat(curve.segments, parts))
    # Where parts meet within a piece, either has the value; pieces themselves may jump.
    assert_same(split.evaluate(at, [0])[0], in_scipy(curve)(at), 128.0, rounding_of(split))


@given(curve=curves, data=st.data())
def test_a_part_of_a_curve_begins_at_zero(curve: SegmentedPolynomial, data: st.DataObject) -> None:
    ends = st.sampled_from([0.0, *curve.breakpoints.tolist(), *inside(curve, 1).tolist()])
    start, end = sorted([data.draw(ends), data.draw(ends)])
    if end - start < 0.1 * curve.lengths.min():
        start, end = 0.0, float(curve.breakpoints[-1])
    part = curve.between(start, end)
    assert (part.lengths > 0.0).all()
    assert part.breakpoints[-1] == pytest.approx(end - start, rel=1e-9)
    at = inside(part)
    assert_same(part.evaluate(at, [0])[0], in_scipy(curve)(start + at), 128.0, rounding_of(curve))


def test_a_part_has_no_pieces_that_are_due_to_rounding() -> None:
    """The bounds of a certificate divided by lengths of 0 and did not end."""
    curve = PiecewisePolynomial(np.array([0.3, 0.5, 0.2]), np.random.default_rng(4).normal(size=(3, 2, 4)))
    begin, end = curve.breakpoints[1:3]
    for start, stop in ((begin, end), (np.nextafter(begin, 0.0), np.nextafter(end, 1.0))):
        part = curve.between(float(start), float(stop))
        assert len(part.lengths) == 1
        assert part.lengths.sum() == pytest.approx(stop - start, rel=1e-14)
        np.testing.assert_allclose(part.coefficients, curve.coefficients[1:2], atol=1e-12)


@given(curve=curves, data=st.data())
def test_the_parts_of_a_curve_are_the_whole_when_joined(curve: SegmentedPolynomial, data: st.DataObject) -> None:
    inner = data.draw(st.sampled_from(inside(curve, 1).tolist()))
    whole = joined([curve.between(0.0, inner), curve.between(inner, float(curve.breakpoints[-1]))])
    assert whole.breakpoints[-1] == pytest.approx(curve.breakpoints[-1], rel=1e-12)
    at = inside(curve)
    assert_same(whole.evaluate(at, [0])[0], in_scipy(curve)(at), 128.0, 2.0 * rounding_of(whole))


@given(parts=st.lists(st.tuples(st.sampled_from(sorted(LENGTHS)), st.integers(1, 8)), min_size=3, max_size=5))
def test_joining_is_associative_and_keeps_every_curve(parts: list[tuple[str, int]]) -> None:
    rng = np.random.default_rng(len(parts))
    curves = [curve_of(kind, int(rng.integers(1, 9)), 2, order, rng) for kind, order in parts]
    whole = joined(curves)
    for other in (
        joined([joined(curves[:2]), *curves[2:]]),
        joined([curves[0], joined(curves[1:])]),
        curves[0].followed_by(*curves[1:]),
    ):
        assert np.array_equal(whole.lengths, other.lengths)
        assert np.array_equal(whole.coefficients, other.coefficients)
        assert np.array_equal(whole.segments, other.segments)
    first = 0
    for curve in curves:
        own = whole.of(np.arange(first, first + len(curve.lengths)))
        order = curve.coefficients.shape[2]
        assert np.array_equal(own.coefficients[:, :, :order], curve.coefficients)
        assert not own.coefficients[:, :, order:].any()
        assert np.array_equal(own.lengths, curve.lengths)
        assert np.array_equal(own.segments, curve.segments)
        first += len(curve.lengths)
    assert first == len(whole.lengths)


@given(curve=curves, seed=st.integers(0, 2**31))
def test_a_stretched_trajectory_has_its_waypoints_where_they_were(curve: SegmentedPolynomial, seed: int) -> None:
    rng = np.random.default_rng(seed)
    knots = np.append(0, np.sort(rng.integers(0, len(curve.lengths) + 1, 4)))
    times = curve.breakpoints[knots]
    trajectory = Trajectory(
        curve.lengths, curve.coefficients, curve.segments, arrivals=times[::2], departures=times[1::2]
    )
    slower = trajectory.stretched(10.0 ** rng.uniform(-3.0, 3.0, len(curve.lengths)))
    assert np.array_equal(slower.arrivals, slower.breakpoints[knots[::2]])
    assert np.array_equal(slower.departures, slower.breakpoints[knots[1::2]])


@pytest.mark.parametrize("order", range(1, 9))
def test_shifted_and_bernstein_coefficients_are_those_of_numpy_and_scipy(order: int) -> None:
    rng = np.random.default_rng(order)
    coefficients, by = rng.uniform(-1.0, 1.0, (5, order)), rng.uniform(-2.0, 2.0, 5)
    for own, step, moved in zip(coefficients, by, shifted(coefficients, by), strict=True):
        expected = np.polynomial.Polynomial(own)(np.polynomial.Polynomial([step, 1.0])).coef
        assert moved[: len(expected)] == pytest.approx(expected, rel=1e-12, abs=1e-12)
    bernstein = BPoly.from_power_basis(PPoly(coefficients.T[::-1, None], [0.0, 1.0])).c[:, 0].T
    assert coefficients @ bernstein_matrix(order) == pytest.approx(bernstein, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("length", [1e-6, 0.1, 1.0, 1e4])
def test_quintics_have_the_derivatives_asked_at_both_ends(length: float) -> None:
    rng = np.random.default_rng(1)
    ends = rng.uniform(-1.0, 1.0, (2, 3, 4)) / length ** np.arange(3)[:, None]
    coefficients = quintic_hermite(np.array([length]), tuple(ends[0][:, None]), tuple(ends[1][:, None]))
    curve, by_scipy = PiecewisePolynomial(np.array([length]), coefficients), BPoly.from_derivatives([0.0, length], ends)
    at = np.linspace(0.0, length, 50)
    assert curve.evaluate(at, [0])[0] == pytest.approx(by_scipy(at), abs=1e-12)


@given(lengths=st.lists(st.floats(1e-9, 1e6), min_size=1, max_size=200))
def test_breakpoints_are_sums_rounded_once(lengths: list[float]) -> None:
    sums = cumulative_sums(np.array(lengths))
    assert sums[0] == 0.0
    for count in range(1, len(lengths) + 1):
        assert sums[count] == pytest.approx(fsum(lengths[:count]), rel=2.0**-52)


@given(
    groups=st.lists(st.lists(st.floats(1e-9, 1e3), min_size=1, max_size=12), min_size=1, max_size=6),
    excess=st.floats(-1e-12, 1e-12),
)
def test_lengths_that_sum_to_totals_change_only_in_the_longest(groups: list[list[float]], excess: float) -> None:
    lengths = np.concatenate([np.array(group) for group in groups])
    owners = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    totals = np.array([fsum(group) * (1.0 + excess) for group in groups])
    totals[::3] = np.nan
    result = summing_to(lengths, owners, totals)
    for k, total in enumerate(totals.tolist()):
        own, before = result[owners == k], lengths[owners == k]
        longest = int(before.argmax())
        assert np.array_equal(np.delete(own, longest), np.delete(before, longest))
        if np.isnan(total):
            assert own[longest] == before[longest]
        else:
            exact = Fraction(total) - sum((Fraction(x) for x in np.delete(before, longest).tolist()), Fraction(0))
            assert own[longest] == pytest.approx(float(exact), rel=2.0**-51)


def test_pieces_of_no_segment_are_no_pieces() -> None:
    curve = curve_of("random", 6, 2, 4, np.random.default_rng(0))
    chosen = curve.of(curve.segments == 1)
    assert np.array_equal(chosen.lengths, curve.lengths[2:4])
    assert len(curve.of(curve.segments == 7).lengths) == 0
    assert np.array_equal(replace(curve, segments=curve.segments + 1).of(np.array([0])).segments, [1])
