"""Splines through waypoints, checked against scipy's splines, dense samples and scipy's optimiser."""

from __future__ import annotations

from math import cbrt, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline, PPoly, make_interp_spline
from scipy.optimize import minimize

from planner.backends.splines.given_velocities import NothingLimits, timed_spline
from planner.backends.splines.interpolation import interpolate, interpolating_spline
from planner.backends.splines.shortest_durations import Evaluation, shortest_durations
from planner.backends.splines.spline_limits import DurationsTooShort, PositionOvershoot
from tests.planner.backends.splines.spline_problems import INF, excess, free, random_problem, samples, spline_limits

DEGREES = (3, 5)
fewer = settings(max_examples=max(20, settings.default.max_examples // 5))
"""Each example searches durations."""


def reference(positions, durations, degree) -> PPoly:
    """Return the same spline by scipy."""
    times = np.concatenate([[0.0], np.cumsum(durations)])
    if degree == 3:
        return CubicSpline(times, positions, bc_type="clamped")
    if len(durations) == 1:
        rest = [np.stack([row, 0.0 * row, 0.0 * row]) for row in positions]
        return PPoly.from_bernstein_basis(BPoly.from_derivatives(times, rest))
    rest = [(1, np.zeros(positions.shape[1])), (2, np.zeros(positions.shape[1]))]
    return make_interp_spline(times, positions, k=5, bc_type=(rest, rest))


problems = st.builds(
    random_problem,
    seed=st.integers(0, 2**31),
    segments=st.integers(1, 8),
    joints=st.integers(1, 4),
    room=st.sampled_from([0.05, 0.3, INF]),
)


# The spline itself.


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("spread", [1.0, 1e3])
@pytest.mark.parametrize("segments", [1, 2, 3, 17, 200])
def test_the_spline_is_scipys(segments, spread, degree) -> None:
    rng = np.random.default_rng(segments)
    positions = rng.uniform(-3.0, 3.0, (segments + 1, 4))
    durations = spread ** rng.uniform(0.0, 1.0, segments)
    values = samples(interpolating_spline(positions, durations, degree), count=9)
    starts = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
    times = starts[:, None] + np.linspace(0.0, 1.0, 9) * durations[:, None]
    expected = reference(positions, durations, degree)(times)
    assert np.abs(values - expected).max() <= 1e-9 * np.abs(expected).max()


@fewer
@given(
    degree=st.sampled_from(DEGREES),
    durations=st.lists(st.floats(1e-2, 10.0), min_size=1, max_size=30),
    seed=st.integers(0, 2**31),
)
def test_the_spline_meets_its_waypoints_smoothly_and_rests_at_its_ends(degree, durations, seed) -> None:
    durations = np.array(durations)
    positions = np.random.default_rng(seed).uniform(-3.0, 3.0, (len(durations) + 1, 3))
    spline = interpolating_spline(positions, durations, degree)
    values = samples(spline, count=2)
    size = np.abs(interpolate(positions, durations, degree).unit).max()
    assert np.array_equal(values[:, 0], positions[:-1])
    assert np.abs(values[:, 1] - positions[1:]).max() <= 1e-13 * size
    for order in range(1, degree):
        values = samples(spline, order)
        jumps = np.abs(values[1:, 0] - values[:-1, -1])
        # The rounding of a position shows in its derivatives, the more so on a short segment.
        tolerance = 1e-9 * np.abs(values).max() + 1e-13 * size / durations.min() ** order
        assert jumps.max(initial=0.0) <= tolerance
        if order <= degree // 2:
            assert np.abs(values[[0, -1], [0, -1]]).max() <= tolerance


@fewer
@given(degree=st.sampled_from(DEGREES), seed=st.integers(0, 2**31), segments=st.integers(1, 7))
def test_sensitivities_to_durations_are_those_of_differences(degree, seed, segments) -> None:
    rng = np.random.default_rng(seed)
    positions, durations = rng.uniform(-2.0, 2.0, (segments + 1, 3)), rng.uniform(0.3, 2.0, segments)
    segment, joint = rng.integers(segments, size=8), rng.integers(3, size=8)
    order, u = rng.integers(degree, size=8), rng.uniform(0.0, 1.0, 8)

    def values(durations):
        coefficients = interpolating_spline(positions, durations, degree).coefficients
        return [
            np.polynomial.Polynomial(coefficients[i, j]).deriv(k)(at * durations[i])
            if k
            else np.polynomial.Polynomial(coefficients[i, j])(at * durations[i])
            for i, j, k, at in zip(segment, joint, order.tolist(), u, strict=True)
        ]

    slopes = interpolate(positions, durations, degree).sensitivities(segment, joint, order, u)
    for k in range(segments):
        change = np.where(np.arange(segments) == k, 1e-5, 0.0)
        difference = np.subtract(values(durations * np.exp(change)), values(durations * np.exp(-change))) / 2e-5
        assert slopes[:, k] == pytest.approx(difference, rel=1e-5, abs=1e-5 * (1.0 + np.abs(slopes).max()))


# At the shortest durations.


@pytest.mark.parametrize("degree", DEGREES)
def test_one_segment_is_the_law_from_rest_to_rest(degree) -> None:
    positions = np.array([[0.2, -0.3], [1.4, 0.1]])
    limits = spline_limits(*np.full((2, 2), INF) * [[-1], [1]], *(np.full((1, 2), x) for x in (5.0, 3.0, 40.0)))
    peaks = (1.5, 6.0) if degree == 3 else (15.0 / 8.0, 10.0 / sqrt(3.0), 60.0)
    needed = max(1.2 * peaks[0] / 5.0, sqrt(1.2 * peaks[1] / 3.0), cbrt(1.2 * peaks[2] / 40.0) if degree == 5 else 0.0)
    assert timed_spline(positions, limits, free(1), degree).lengths == pytest.approx([needed], rel=1e-12)


@fewer
@given(problem=problems, degree=st.sampled_from(DEGREES))
def test_the_shortest_spline_uses_its_limits_up_and_breaks_none(problem, degree) -> None:
    positions, limits = problem
    try:
        spline = timed_spline(positions, limits, free(len(positions) - 1), degree)
    except PositionOvershoot as error:
        bound = limits.position.upper if error.value > error.limit else limits.position.lower
        assert bound[error.joint] == error.limit
        assert np.isfinite(limits.position.upper).all()
        return
    worst, overshoot = excess(spline, limits, degree)
    assert worst.max() <= 1.0 + 1e-9
    assert worst.max() >= 0.999
    assert overshoot <= 1e-9
    values = samples(spline, count=2)
    assert np.abs(values - np.stack([positions[:-1], positions[1:]], axis=1)).max() <= 1e-12


@pytest.mark.long_table
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("seed", range(6))
def test_the_shortest_is_as_short_as_an_independent_optimiser_makes_it(seed, degree) -> None:
    segments = 2 + seed % 4
    positions, limits = random_problem(seed, segments, 2)
    bounds = [limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower][: (degree + 1) // 2]
    unit = np.linspace(0.0, 1.0, 21)

    def slack(u):
        durations = np.exp(u)
        spline = reference(positions, durations, degree)
        times = np.concatenate([[0.0], np.cumsum(durations)[:-1]])[:, None] + unit * durations[:, None]
        return np.concatenate(
            [
                (1.0 - (spline.derivative(order)(times) / bound[:, None]) ** 2).ravel()
                for order, bound in enumerate(bounds, start=1)
            ]
        )

    start = timed_spline(positions, limits, free(segments), degree).lengths
    rng = np.random.default_rng(seed)
    totals = []
    for _ in range(3):
        u = np.log(start * rng.uniform(0.8, 2.0, segments))
        result = minimize(
            lambda u: np.exp(u).sum(),
            u,
            jac=np.exp,
            method="SLSQP",
            bounds=[(x - 1.5, x + 1.5) for x in u],
            constraints={"type": "ineq", "fun": slack},
            options={"maxiter": 60},
        )
        if result.success and slack(result.x).min() > -1e-4:
            totals.append(np.exp(result.x).sum())
    assert totals
    assert start.sum() <= 1.02 * min(totals)


@pytest.mark.parametrize("seed", range(4))
def test_a_cubic_through_dense_waypoints_on_one_line_is_as_fast_as_one_without_them(seed) -> None:
    """One cubic over the whole line is also a spline through its waypoints: an upper bound of the shortest duration."""
    shares = np.linspace(-1.0, 1.0, 42)
    line = np.random.default_rng(seed).uniform(0.1, 0.5, 3)
    positions = (np.sign(shares) * shares**2)[:, None] * line
    totals = []
    for waypoints in (positions, positions[[0, -1]]):
        segments = len(waypoints) - 1
        rates = (np.full((segments, 3), x) for x in (5.0, 7.0, 70.0))
        limits = spline_limits(*np.full((2, 3), INF) * [[-1], [1]], *rates)
        totals.append(timed_spline(waypoints, limits, free(segments), 3).lengths.sum())
    assert totals[0] <= totals[1]


@fewer
@given(problem=problems, degree=st.sampled_from(DEGREES))
def test_there_and_back_take_as_long(problem, degree) -> None:
    positions, limits = problem
    unbounded = np.full(positions.shape[1], INF)
    rates = (limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower)
    there = timed_spline(positions, spline_limits(-unbounded, unbounded, *rates), free(len(positions) - 1), degree)
    mirrored = spline_limits(-unbounded, unbounded, *(rate[::-1] for rate in rates))
    back = timed_spline(positions[::-1], mirrored, there.lengths[::-1], degree)
    forwards = samples(there)
    assert np.abs(samples(back)[::-1, ::-1] - forwards).max() <= 1e-9


@pytest.mark.parametrize("degree", DEGREES)
def test_a_waypoint_met_twice_is_passed(degree) -> None:
    positions, limits = random_problem(3, 5, 3)
    positions[3] = positions[2]
    spline = timed_spline(positions, limits, free(5), degree)
    assert excess(spline, limits, degree)[0].max() <= 1.0 + 1e-9


@pytest.mark.parametrize("degree", DEGREES)
def test_a_segment_without_limits_is_timed_by_its_neighbours(degree) -> None:
    positions, limits = random_problem(4, 3, 2)
    for rate in (limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower):
        rate[1] = INF
    assert excess(timed_spline(positions, limits, free(3), degree), limits, degree)[0].max() <= 1.0 + 1e-9


@pytest.mark.parametrize("degree", DEGREES)
def test_nothing_that_limits_is_said(degree) -> None:
    positions, limits = random_problem(4, 3, 2)
    none = np.full((3, 2), INF)
    with pytest.raises(NothingLimits):
        timed_spline(positions, spline_limits(*limits.position, none, none, none), free(3), degree)


# At requested durations.


@fewer
@given(problem=problems, degree=st.sampled_from(DEGREES), data=st.data())
def test_asked_durations_are_kept_or_refused_with_what_would_do(problem, degree, data) -> None:
    positions, limits = problem
    segments = len(positions) - 1
    some = st.one_of(st.just(np.nan), st.floats(0.05, 8.0))
    requested = np.array(data.draw(st.lists(some, min_size=segments, max_size=segments)))
    given_ones = ~np.isnan(requested)
    try:
        spline = timed_spline(positions, limits, requested, degree)
    except PositionOvershoot:
        assert np.isfinite(limits.position.upper).all()
        return
    except DurationsTooShort as error:
        assert given_ones.any()
        assert error.factor == pytest.approx(
            (error.value / error.limit) ** (1.0 / (1 + "vaj".index(error.quantity[0])))
        )
        assert error.durations[given_ones] == pytest.approx(error.factor * requested[given_ones])
        enough = timed_spline(positions, limits, error.durations, degree)
        worst, overshoot = excess(enough, limits, degree)
        assert worst.max() <= 1.0 + 1e-9
        assert worst.argmax() == error.segment or worst[error.segment] >= 0.99
        assert overshoot <= 1e-9
        with pytest.raises(DurationsTooShort):
            timed_spline(positions, limits, error.durations * (1.0 - 1e-6), degree)
        return
    assert np.array_equal(spline.lengths[given_ones], requested[given_ones])
    worst, overshoot = excess(spline, limits, degree)
    assert worst.max() <= 1.0 + 1e-9
    assert overshoot <= 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("share", [0.4, 0.8, 1.2])
@pytest.mark.parametrize("seed", range(7))
def test_a_free_duration_beside_an_asked_one_is_the_shortest_of_all(seed, share, degree) -> None:
    positions, limits = random_problem(seed, 2, 2)
    requested = share * timed_spline(positions, limits, free(2), degree).lengths[0]
    bounds = [limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower][: (degree + 1) // 2]

    def worst(other):
        durations = np.array([requested, other])
        coefficients = reference(positions, durations, degree)
        times = np.array([[0.0], [requested]]) + np.linspace(0.0, 1.0, 101) * durations[:, None]
        return max(
            (np.abs(coefficients.derivative(order)(times)) / bound[:, None]).max() ** (1.0 / order)
            for order, bound in enumerate(bounds, start=1)
        )

    others = np.geomspace(0.05, 12.0, 150)
    excesses = np.array([worst(other) for other in others])
    try:
        spline = timed_spline(positions, limits, np.array([requested, np.nan]), degree)
    except DurationsTooShort as error:
        assert excesses.min() > 1.0 - 2e-3
        assert error.factor <= 1.1 * excesses.min()
    else:
        shortest = others[excesses <= 1.0].min(initial=INF)
        assert spline.lengths[1] <= 1.02 * shortest


# Position limits.


@pytest.mark.long_table
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("room", [0.002, 0.01, 0.03, 0.1])
@pytest.mark.parametrize("seed", range(7))
def test_position_limits_are_kept_where_a_ratio_of_two_durations_keeps_them(seed, room, degree) -> None:
    positions, limits = random_problem(seed, 2, 2, room)
    overshoots = []
    for ratio in np.geomspace(0.02, 50.0, 200):
        durations = np.array([1.0, ratio])
        values = reference(positions, durations, degree)(np.linspace(0.0, 1.0 + ratio, 400))
        overshoots.append(max((values - limits.position.upper).max(), (limits.position.lower - values).max()))
    try:
        spline = timed_spline(positions, limits, free(2), degree)
    except PositionOvershoot:
        assert min(overshoots) > -0.001
    else:
        assert excess(spline, limits, degree)[1] <= 1e-9


@pytest.mark.parametrize("degree", DEGREES)
def test_an_overshoot_is_named(degree) -> None:
    positions = np.array([[0.0, 0.0], [0.5, 1.0], [0.5, 0.95], [1.0, 0.0]])
    rates = np.full((3, 2), 100.0)
    limits = spline_limits(np.full(2, -0.5), np.array([1.1, 1.01]), rates, rates, 100.0 * rates)
    durations = np.array([1.0, 1.0, 1.0])
    with pytest.raises(PositionOvershoot) as caught:
        timed_spline(positions, limits, durations, degree)
    values = reference(positions, durations, degree)(np.linspace(0.0, 3.0, 30001))[:, 1]
    assert (caught.value.segment, caught.value.joint, caught.value.limit) == (int(values.argmax() / 10000), 1, 1.01)
    assert caught.value.value == pytest.approx(values.max(), rel=1e-7)


# By its ratios alone.


def ratios_of(positions, limits, degree):
    """Make a function from durations to the worst ratio of each segment, by samples of scipy's spline."""
    unit = np.linspace(0.0, 1.0, 101)

    def evaluate(durations):
        spline = reference(positions, durations, degree)
        times = np.concatenate([[0.0], np.cumsum(durations)[:-1]])[:, None] + unit * durations[:, None]
        worst = np.zeros(len(durations))
        for order, quantity in enumerate(("velocity", "acceleration", "jerk")[: (degree + 1) // 2], start=1):
            ratios = np.abs(spline.derivative(order)(times)[..., 0]) / limits.magnitudes(quantity)
            worst = np.maximum(worst, ratios.max(axis=1) ** (1.0 / order))
        return worst

    return evaluate


def everywhere(evaluate):
    """Make a function of durations that returns an evaluation whose `near` evaluates the whole motion."""
    return lambda durations: Evaluation(evaluate(durations), evaluate)


@pytest.mark.parametrize("degree", DEGREES)
def test_durations_found_by_ratios_alone_are_nearly_as_short(degree) -> None:
    longer = []
    for seed in range(9):
        positions, limits = random_problem(seed, 1 + seed, 1)
        evaluate = ratios_of(positions, limits, degree)
        durations, ratios = shortest_durations(everywhere(evaluate), np.ones(1 + seed), free(1 + seed))
        assert ratios.max() == pytest.approx(1.0, abs=1e-9)
        longer.append(durations.sum() / timed_spline(positions, limits, free(1 + seed), degree).lengths.sum())
    assert np.median(longer) <= 1.01
    assert max(longer) <= 1.1


@pytest.mark.parametrize("degree", DEGREES)
def test_durations_found_by_ratios_alone_keep_the_asked_ones(degree) -> None:
    positions, limits = random_problem(5, 6, 1)
    evaluate = ratios_of(positions, limits, degree)
    shortest = shortest_durations(everywhere(evaluate), np.ones(6), free(6))[0]
    requested = np.where(np.arange(6) == 2, 1.3 * shortest, np.nan)
    durations, ratios = shortest_durations(everywhere(evaluate), shortest, requested)
    assert durations[2] == requested[2]
    assert ratios == pytest.approx(evaluate(durations))
    assert ratios.max() <= 1.0
    assert durations.sum() <= 1.15 * shortest.sum()

    requested[2] = 0.2 * shortest[2]
    durations, ratios = shortest_durations(everywhere(evaluate), shortest, requested)
    assert durations[2] == requested[2]
    assert evaluate(durations * ratios.max()).max() == pytest.approx(1.0)
    assert ratios.max() > 1.0
