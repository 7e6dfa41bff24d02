"""Splines that pass waypoints with given velocities, against scipy's, hand-solved systems and dense trials."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline, PPoly, make_interp_spline
from scipy.optimize import minimize

from planner.backends.splines.given_velocities import PassingSpline, VelocityOutOfReach
from planner.backends.splines.interpolation import Degree, interpolate
from planner.backends.splines.spline_limits import DurationsTooShort
from tests.planner.backends.splines.spline_problems import INF, excess, free, random_problem, samples, spline_limits

if TYPE_CHECKING:
    from planner.limits import SegmentLimits
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial

DEGREES: tuple[Degree, ...] = (3, 5)
NONE = np.nan
fewer = settings(max_examples=max(20, settings.default.max_examples // 5))
"""Each example searches durations."""


def some_velocities(seed: int, segments: int, joints: int, size: float, share: float = 0.5) -> FloatArray:
    """Draw velocities (segments - 1, joints) at some of the inner waypoints, at least at one."""
    rng = np.random.default_rng(seed)
    velocities: FloatArray = rng.uniform(-size, size, (segments - 1, joints))
    velocities[rng.uniform(size=segments - 1) > share] = NONE
    velocities[rng.integers(segments - 1)] = rng.uniform(-size, size, joints)
    return velocities


def parts_of(velocities: FloatArray) -> list[tuple[int, int]]:
    """Return the first and the last waypoint of each part between two given velocities."""
    cuts = [0, *(np.flatnonzero(~np.isnan(velocities[:, 0])) + 1).tolist(), len(velocities) + 1]
    return list(pairwise(cuts))


def reference(positions: FloatArray, durations: FloatArray, velocities: FloatArray, degree: Degree) -> list[PPoly]:
    """Return the splines of the parts by scipy, each from time 0 on."""
    at_all, made = np.pad(velocities, ((1, 1), (0, 0))), []
    for first, last in parts_of(velocities):
        times = np.concatenate([[0.0], np.cumsum(durations[first:last])])
        points, ends = positions[first : last + 1], at_all[[first, last]]
        rest = np.zeros_like(ends[0])
        if degree == 3:
            made.append(CubicSpline(times, points, bc_type=((1, ends[0]), (1, ends[1]))))
        elif len(times) == 2:
            states = [np.stack([point, end, rest]) for point, end in zip(points, ends, strict=True)]
            made.append(PPoly.from_bernstein_basis(BPoly.from_derivatives(times, states)))
        else:
            conditions = [[(1, end), (2, rest)] for end in ends]
            made.append(make_interp_spline(times, points, k=5, bc_type=conditions))
    return made


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("spread", [1.0, 1e3])
@pytest.mark.parametrize("segments", [2, 3, 17, 300])
def test_between_velocities_the_spline_is_scipys(segments: int, spread: float, degree: Degree) -> None:
    rng = np.random.default_rng(segments)
    positions = rng.uniform(-3.0, 3.0, (segments + 1, 4))
    durations = spread ** rng.uniform(0.0, 1.0, segments)
    velocities = some_velocities(segments, segments, 4, 2.0, share=0.3)
    values = samples(interpolate(positions, durations, degree, velocities).curve, count=9)
    for (first, last), spline in zip(
        parts_of(velocities), reference(positions, durations, velocities, degree), strict=True
    ):
        own = durations[first:last]
        starts = np.concatenate([[0.0], np.cumsum(own)[:-1]])
        expected = spline(starts[:, None] + np.linspace(0.0, 1.0, 9) * own[:, None])
        assert np.abs(values[first:last] - expected).max() <= 1e-9 * np.abs(expected).max()


@fewer
@given(degree=st.sampled_from(DEGREES), seed=st.integers(0, 2**31), segments=st.integers(2, 12))
def test_velocities_are_met_exactly_and_the_acceleration_is_as_smooth_as_promised(
    degree: Degree, seed: int, segments: int
) -> None:
    rng = np.random.default_rng(seed)
    positions, durations = rng.uniform(-3.0, 3.0, (segments + 1, 3)), rng.uniform(0.1, 3.0, segments)
    velocities = some_velocities(seed, segments, 3, 2.0)
    curve = interpolate(positions, durations, degree, velocities).curve
    is_given = ~np.isnan(velocities[:, 0])
    for order in range(degree):
        values = samples(curve, order, count=2)
        tolerance = 1e-10 * np.abs(values).max() + 1e-12 * np.abs(positions).max() / durations.min() ** order
        jumps = np.abs(values[1:, 0] - values[:-1, -1]).max(axis=1)
        continuous = np.ones(segments - 1, dtype=bool) if order <= degree // 2 else ~is_given
        assert (jumps[continuous] <= tolerance).all()
        if order == 1:
            assert np.abs(values[:-1, -1] - velocities)[is_given].max() <= tolerance
        if order == 2 and degree == 5:
            assert np.abs(values[:-1, -1])[is_given].max() <= tolerance


@pytest.mark.parametrize("seed", range(6))
def test_the_cubic_has_the_least_mean_square_acceleration_of_all_that_have_these_velocities(seed: int) -> None:
    """Of Hermite cubics the integral of the squared acceleration is quadratic in the other velocities."""
    rng = np.random.default_rng(seed)
    positions, h = rng.uniform(-2.0, 2.0, (7, 1)), rng.uniform(0.2, 2.0, 6)
    velocities = some_velocities(seed, 6, 1, 2.0)
    known = np.pad(velocities[:, 0], 1)
    unknown = np.isnan(known)
    # Gradient of sum over segments of 4 (v0^2 + v0 v1 + v1^2) / h - 12 d (v0 + v1) / h^2 by each velocity.
    hessian, right = np.zeros((7, 7)), np.zeros(7)
    for k, (time, travel) in enumerate(zip(h, np.diff(positions[:, 0]), strict=True)):
        hessian[k : k + 2, k : k + 2] += np.array([[8.0, 4.0], [4.0, 8.0]]) / time
        right[k : k + 2] += 12.0 * travel / time**2
    least = known.copy()
    least[unknown] = np.linalg.solve(
        hessian[np.ix_(unknown, unknown)], right[unknown] - hessian[np.ix_(unknown, ~unknown)] @ known[~unknown]
    )
    found = samples(interpolate(positions, h, 3, velocities).curve, 1, count=2)
    assert found[:, 0, 0] == pytest.approx(least[:-1], abs=1e-10)


@fewer
@given(degree=st.sampled_from(DEGREES), seed=st.integers(0, 2**31), segments=st.integers(2, 7))
def test_sensitivities_to_durations_are_those_of_differences(degree: Degree, seed: int, segments: int) -> None:
    rng = np.random.default_rng(seed)
    positions, durations = rng.uniform(-2.0, 2.0, (segments + 1, 3)), rng.uniform(0.3, 2.0, segments)
    velocities = some_velocities(seed, segments, 3, 1.0)
    segment, joint = rng.integers(segments, size=8), rng.integers(3, size=8)
    order, u = rng.integers(degree, size=8), rng.uniform(0.0, 1.0, 8)

    def values(durations: FloatArray) -> list[float]:
        coefficients = interpolate(positions, durations, degree, velocities).curve.coefficients
        polynomials = [np.polynomial.Polynomial(coefficients[i, j]) for i, j in zip(segment, joint, strict=True)]
        return [
            float((p.deriv(k) if k else p)(at * durations[i]))
            for p, i, k, at in zip(polynomials, segment, order.tolist(), u, strict=True)
        ]

    slopes = interpolate(positions, durations, degree, velocities).sensitivities(segment, joint, order, u)
    for k in range(segments):
        change = np.where(np.arange(segments) == k, 1e-5, 0.0)
        difference = np.subtract(values(durations * np.exp(change)), values(durations * np.exp(-change))) / 2e-5
        assert slopes[:, k] == pytest.approx(difference, rel=1e-5, abs=1e-5 * (1.0 + np.abs(slopes).max()))


# Durations.


def timed(
    positions: FloatArray, velocities: FloatArray, limits: SegmentLimits, requested: FloatArray, degree: Degree
) -> PiecewisePolynomial:
    """Return the spline at the shortest durations found."""
    spline = PassingSpline(positions, velocities, limits, degree)
    return interpolate(positions, spline.durations(requested), degree, velocities).curve


def keeps_all(
    spline: PiecewisePolynomial, positions: FloatArray, velocities: FloatArray, limits: SegmentLimits, degree: Degree
) -> None:
    """Assert that waypoints, velocities and limits are kept, by samples."""
    worst, overshoot = excess(spline, limits, degree)
    assert worst.max() <= 1.0 + 1e-8
    assert overshoot <= 1e-8
    values, rates = samples(spline, count=2), samples(spline, 1, count=2)
    assert np.abs(values[:, 1] - positions[1:]).max() <= 1e-11
    is_given = ~np.isnan(velocities[:, 0])
    assert np.abs(rates[:-1, 1] - velocities)[is_given].max() <= 1e-10


def shortest_of_one_segment(
    travel: FloatArray, ends: FloatArray, limits: SegmentLimits, row: int, start: FloatArray, degree: Degree
) -> tuple[float, float]:
    """Return the least sampled duration of one segment that keeps its limits, and the least excess of all."""
    u = np.linspace(0.0, 1.0, 51)
    least, nearest = INF, INF
    for h in np.geomspace(0.02, 60.0, 800):
        states = [np.stack([start, ends[0], 0.0 * start]), np.stack([start + travel, ends[1], 0.0 * start])]
        states = states if degree == 5 else [state[:2] for state in states]
        spline = BPoly.from_derivatives([0.0, h], states)
        rates = [limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower][: (degree + 1) // 2]
        worst = max(
            (np.abs(spline.derivative(order)(u * h)) / rate[row]).max() ** (1.0 / order)
            for order, rate in enumerate(rates, start=1)
        )
        q = spline(u * h)
        out = max((q - limits.position.upper).max(), (limits.position.lower - q).max())
        nearest = min(nearest, max(worst - 1.0, out))
        if worst <= 1.0 + 1e-6 and out <= 1e-6:
            return h, min(nearest, 0.0)
    return least, nearest


@pytest.mark.long_table
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("seed", range(8))
def test_where_every_velocity_is_given_no_shorter_duration_keeps_the_limits(seed: int, degree: Degree) -> None:
    """Where one is refused, no duration keeps the limits."""
    positions, limits = random_problem(seed, 2, 2, 0.3)
    velocities = some_velocities(seed, 2, 2, (0.3, 1.0)[seed % 2])
    at_all = np.pad(velocities, ((1, 1), (0, 0)))
    dense = [
        shortest_of_one_segment(positions[k + 1] - positions[k], at_all[k : k + 2], limits, k, positions[k], degree)
        for k in range(2)
    ]
    try:
        found = timed(positions, velocities, limits, free(2), degree).lengths
    except VelocityOutOfReach:
        assert max(nearest for _, nearest in dense) > -1e-3
        return
    assert np.all(found <= [1.02 * least for least, _ in dense])


@fewer
@given(
    seed=st.integers(0, 2**31),
    segments=st.integers(2, 8),
    joints=st.integers(1, 4),
    size=st.sampled_from([1e-6, 0.1, 0.4]),
    degree=st.sampled_from(DEGREES),
    data=st.data(),
)
def test_velocities_are_had_within_all_limits_or_refused_for_the_limit_in_their_way(
    seed: int, segments: int, joints: int, size: float, degree: Degree, data: st.DataObject
) -> None:
    positions, limits = random_problem(seed, segments, joints, data.draw(st.sampled_from([0.05, 0.3, INF])))
    velocities = some_velocities(seed, segments, joints, size)
    some = st.one_of(st.just(NONE), st.just(NONE), st.floats(0.05, 8.0))
    requested = np.array(data.draw(st.lists(some, min_size=segments, max_size=segments)))
    given_ones = ~np.isnan(requested)
    try:
        spline = timed(positions, velocities, limits, requested, degree)
    except DurationsTooShort as error:
        assert given_ones.any()
        assert (error.durations[given_ones] >= requested[given_ones]).all()
        assert error.value > error.limit or error.quantity == "position"
        return
    except VelocityOutOfReach as error:
        bounds = np.sort([error.value, error.limit])
        assert bounds[0] < bounds[1]
        assert given_ones.any() or size > 0.1 or np.isfinite(limits.position.upper).all()
        return
    keeps_all(spline, positions, velocities, limits, degree)
    assert np.array_equal(spline.lengths[given_ones], requested[given_ones])


@pytest.mark.long_table
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("seed", range(6))
def test_the_shortest_is_as_short_as_an_independent_optimiser_makes_it(seed: int, degree: Degree) -> None:
    segments = 3 + seed % 3
    positions, limits = random_problem(seed, segments, 2)
    velocities = np.full((segments - 1, 2), NONE)
    velocities[seed % (segments - 1)] = np.random.default_rng(seed).uniform(-0.5, 0.5, 2)
    rates = [limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower][: (degree + 1) // 2]
    start = timed(positions, velocities, limits, free(segments), degree).lengths

    def slack(u: FloatArray) -> FloatArray:
        curve = interpolate(positions, np.exp(u), degree, velocities).curve
        return np.concatenate(
            [
                (1.0 - (samples(curve, order, count=21) / rate[:, None]) ** 2).ravel()
                for order, rate in enumerate(rates, start=1)
            ]
        )

    rng, totals = np.random.default_rng(seed), []
    for _ in range(2):
        begin = np.log(start * rng.uniform(0.9, 1.5, segments))
        result = minimize(
            lambda u: np.exp(u).sum(),
            begin,
            jac=np.exp,
            method="SLSQP",
            bounds=[(x - 1.5, x + 1.5) for x in begin],
            constraints={"type": "ineq", "fun": slack},
            options={"maxiter": 200},
        )
        if result.success and slack(result.x).min() > -1e-4:
            totals.append(np.exp(result.x).sum())
    assert totals
    assert start.sum() <= 1.05 * min(totals)


# Special velocities.

WAY = np.array([[0.0, 0.0], [0.5, 0.2], [1.0, -0.3]])


def wide_limits(segments: int = 2, velocity: float = 1.0) -> SegmentLimits:
    """Return wide limits of two joints."""
    rates = (np.full((segments, 2), limit) for limit in (velocity, 4.0, 40.0))
    return spline_limits(np.full(2, -INF), np.full(2, INF), *rates)


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize(
    "velocity",
    [
        (0.3, 0.0),
        (1.0, -1.0),
        (-0.8, 0.0),
        (1e-9, 0.0),
        (1.0, 1.0 - 1e-12),
    ],
    ids=["of one joint", "at the limits", "against the motion", "next to none", "next to the limit"],
)
def test_a_velocity_of_any_kind_is_had(velocity: tuple[float, float], degree: Degree) -> None:
    velocities = np.array([velocity])
    keeps_all(timed(WAY, velocities, wide_limits(), free(2), degree), WAY, velocities, wide_limits(), degree)


@pytest.mark.parametrize("degree", DEGREES)
def test_a_joint_that_does_not_move_stays_where_it_is(degree: Degree) -> None:
    positions = np.column_stack([WAY[:, 0], np.full(3, 0.7)])
    spline = timed(positions, np.array([[0.4, 0.0]]), wide_limits(), free(2), degree)
    assert np.abs(samples(spline)[..., 1] - 0.7).max() <= 1e-15


@pytest.mark.parametrize("degree", DEGREES)
def test_there_and_back_take_as_long(degree: Degree) -> None:
    there = timed(WAY, np.array([[0.4, 0.1]]), wide_limits(), free(2), degree).lengths
    back = timed(WAY[::-1], np.array([[-0.4, -0.1]]), wide_limits(), free(2), degree).lengths
    assert back[::-1] == pytest.approx(there, rel=1e-4)


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("segments", [2, 300])
def test_with_the_velocity_of_a_constant_motion_its_middle_is_that_motion(segments: int, degree: Degree) -> None:
    """Between two equal velocities, over the distance of a constant motion, only the velocity limit binds."""
    steps = np.arange(segments + 1)[:, None] * np.array([0.1, -0.05])
    velocities = np.tile([1.0, -0.5], (segments - 1, 1))
    spline = timed(steps, velocities, wide_limits(segments), free(segments), degree)
    assert spline.lengths[1:-1] == pytest.approx(np.full(segments - 2, 0.1), rel=1e-4)
    keeps_all(spline, steps, velocities, wide_limits(segments), degree)


def test_a_narrow_range_of_durations_is_found() -> None:
    """From rest to v over d with an acceleration of at most v^2 / 2d, only 2 d / v works, or far more."""
    positions, velocities = np.array([[0.0], [1.0], [2.0]]), np.array([[1.0]])
    limits = spline_limits(
        np.array([-0.05]), np.array([2.05]), *(np.full((2, 1), limit) for limit in (1.5, 0.502, INF))
    )
    assert timed(positions, velocities, limits, free(2), 3).lengths == pytest.approx(np.full(2, 2.0), rel=0.01)


@pytest.mark.parametrize("degree", DEGREES)
def test_a_short_part_does_not_hide_the_peaks_of_a_long_one(degree: Degree) -> None:
    """Both parts were slowed together, and only near the worst of both was checked: this was refused."""
    positions, velocities = np.array([[0.0], [0.01], [-1.16]]), np.array([[3e-8]])
    rates = (np.full((2, 1), limit) for limit in (1.05, 3.2, 30.0))
    limits = spline_limits(np.array([-INF]), np.array([INF]), *rates)
    keeps_all(timed(positions, velocities, limits, free(2), degree), positions, velocities, limits, degree)


@pytest.mark.parametrize("degree", DEGREES)
def test_accelerations_alone_limit_a_spline(degree: Degree) -> None:
    """A quintic without acceleration at the waypoints uses none of the limited acceleration there."""
    velocities, none = np.array([[0.1, 0.1]]), np.full((2, 2), INF)
    limits = spline_limits(np.full(2, -INF), np.full(2, INF), none, np.full((2, 2), 2.0), none)
    keeps_all(timed(WAY, velocities, limits, free(2), degree), WAY, velocities, limits, degree)


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("others", [0.0, NONE], ids=["one segment a part", "several segments a part"])
def test_next_to_no_velocity_takes_few_trials_where_accelerations_alone_limit_a_spline(
    others: float, degree: Degree, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first trials were as short as 1e-300 rad needs: 6,000 of them, and half a minute."""
    trials: list[FloatArray] = []
    excesses = PassingSpline.excesses

    def counted(spline: PassingSpline, durations: FloatArray) -> FloatArray:
        trials.append(durations)
        return excesses(spline, durations)

    monkeypatch.setattr(PassingSpline, "excesses", counted)
    positions = np.array([[0.0, 0.0], [0.5, 0.2], [1.0, -0.3], [1.3, 0.1], [0.9, 0.4]])
    none, limited = np.full((4, 2), INF), np.full((4, 2), 2.0)
    limits = spline_limits(np.full(2, -INF), np.full(2, INF), none, limited, none)
    found, counts = [], []
    for velocity in (1e-6, 1e-30, 1e-300):
        velocities = np.array([[velocity, 0.0], [others, others], [velocity, -velocity]])
        trials.clear()
        found.append(timed(positions, velocities, limits, free(4), degree).lengths)
        counts.append(len(trials))
    assert max(counts) <= 60, counts
    assert found[1] == pytest.approx(found[0], rel=1e-4) and found[2] == pytest.approx(found[0], rel=1e-4)


@pytest.mark.parametrize("degree", DEGREES)
def test_a_velocity_without_room_before_it_is_refused(degree: Degree) -> None:
    """Braking needs v^2 / 2a = 0.125, but the position limit is 0.05 behind the waypoint."""
    positions = np.array([[0.0, 0.0], [0.5, 0.0], [0.2, 0.0]])
    limits = wide_limits()
    walled = spline_limits(
        np.full(2, -INF),
        np.array([0.55, INF]),
        limits.velocity.narrower,
        limits.acceleration.narrower,
        limits.jerk.narrower,
    )
    with pytest.raises(VelocityOutOfReach) as refusal:
        timed(positions, np.array([[1.0, 0.0]]), walled, free(2), degree)
    assert (refusal.value.segment, refusal.value.joint) == (1, 0)
    assert refusal.value.quantity in ("position", "acceleration", "jerk")
