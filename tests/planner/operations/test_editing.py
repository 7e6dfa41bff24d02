"""Trajectories reversed, cut, joined and sampled again, against scipy's evaluation of their polynomials."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner.certificate import certify_samples, interpolated
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.limits import Limits
from planner.operations import join_trajectories, resample_trajectory, reverse_trajectory, slice_trajectory
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory
from tests.planner.operations.curves import by_scipy, inner_times, kuka, planned

KINDS = ("cubic", "quintic", "trapezoidal", "ruckig", "toppra")
ORDERS = range(4)


def scale(trajectory: Trajectory, order: int) -> float:
    return float(np.abs(by_scipy(trajectory, inner_times(trajectory), order)).max())


def two_pieces(first: list[float], second: list[float], joints: int = 6) -> Trajectory:
    """Return the same polynomial of all joints on two pieces of 1 s."""
    coefficients = np.tile(np.array([first, second])[:, None], (1, joints, 1))
    ends = np.array([0.0, 2.0])
    return Trajectory(np.ones(2), coefficients, np.zeros(2, dtype=int), ends, ends)


def resting(position: FloatArray) -> Trajectory:
    """Return one second at a joint position (joints,)."""
    ends = np.array([0.0, 1.0])
    return Trajectory(np.ones(1), position[None, :, None], np.zeros(1, dtype=int), ends, ends)


@pytest.mark.parametrize("kind", KINDS)
def test_the_reverse_is_where_the_trajectory_is_at_its_end_less_the_time(kind: str) -> None:
    given = planned(kind)
    back = reverse_trajectory(kuka(), given)
    assert back.trajectory.duration == given.duration
    assert back.trajectory.lengths.tolist() == given.lengths[::-1].tolist()
    assert back.trajectory.coefficients.shape == given.coefficients.shape
    times = inner_times(given)
    for order in ORDERS:
        wanted = (-1.0) ** order * by_scipy(given, given.duration - times, order)
        found = by_scipy(back.trajectory, times, order)
        assert np.abs(found - wanted).max() <= 1e-9 * (1.0 + scale(given, order)), order
    assert back.trajectory.arrivals == pytest.approx(given.duration - given.departures[::-1], abs=1e-12)
    (at_arrivals,) = back.trajectory.evaluate(back.trajectory.arrivals, [0])
    assert at_arrivals == pytest.approx(given.evaluate(given.departures, [0])[0][::-1], abs=1e-9)
    again = reverse_trajectory(kuka(), back.trajectory).trajectory
    assert np.abs(by_scipy(again, times) - by_scipy(given, times)).max() < 1e-12
    assert (again.segments == given.segments).all()


@pytest.mark.parametrize("kind", KINDS)
def test_a_slice_is_the_trajectory_between_two_times(kind: str) -> None:
    given = planned(kind)
    random = np.random.default_rng(5)
    pairs = [np.sort(random.uniform(0.0, given.duration, 2)) for _ in range(5)]
    middle = given.breakpoints[len(given.breakpoints) // 2]
    pairs += [
        (0.0, given.duration),
        (given.breakpoints[1], middle),
        (0.0, 1e-4),
        (given.duration - 1e-4, given.duration),
    ]
    for start, end in pairs:
        if end <= start:
            continue
        part = slice_trajectory(kuka(), given, start, end)
        assert part.trajectory.duration == pytest.approx(end - start, rel=1e-9)
        times = inner_times(part.trajectory, 50)
        for order in ORDERS:
            wanted = by_scipy(given, start + times, order)
            difference = np.abs(by_scipy(part.trajectory, times, order) - wanted).max()
            assert difference <= 1e-9 * (1.0 + scale(given, order))
        (velocity,) = given.evaluate(start, [1])
        assert part.initial.velocity == pytest.approx(velocity, abs=1e-9)
        codes = {warning.code for warning in part.warnings}
        assert ("starts_in_motion" in codes) == (np.abs(velocity).max() > 1e-8)


def test_a_slice_keeps_the_waypoints_of_its_segments() -> None:
    given = planned("quintic")
    part = slice_trajectory(kuka(), given, float(given.arrivals[1]) / 2, float(given.arrivals[2]) + 0.1).trajectory
    assert part.segments.tolist() == sorted(part.segments.tolist())
    assert part.arrivals[1] == pytest.approx(given.arrivals[1] / 2)
    assert part.departures[-1] == pytest.approx(part.duration)


def test_a_slice_of_two_nanoseconds_ends_with_itself() -> None:
    """Its last arrival exceeded its end by the rounding of its start."""
    given = planned("cubic")
    for start in np.linspace(0.1, 0.9, 23) * given.duration:
        part = slice_trajectory(kuka(), given, float(start), float(start) + 2e-9 * given.duration).trajectory
        assert part.arrivals.max() <= part.duration


def test_a_slice_at_a_breakpoint_makes_no_piece_of_rounding() -> None:
    given = planned("ruckig")
    start, end = float(given.breakpoints[2]), float(given.breakpoints[5])
    part = slice_trajectory(kuka(), given, start * (1 + 1e-15), end * (1 - 1e-15)).trajectory
    assert part.lengths == pytest.approx(given.lengths[2:5], rel=1e-12)


@pytest.mark.parametrize(
    ("start", "end", "field"),
    [(-0.1, 0.5, "start"), (0.5, 99.0, "end"), (0.5, 0.5, "end"), (0.6, 0.5, "end"), (np.nan, 0.5, "start")],
)
def test_times_of_a_slice_that_are_refused(start: float, end: float, field: str) -> None:
    with pytest.raises(InvalidProblem) as refused:
        slice_trajectory(kuka(), planned("cubic"), start, end)
    assert refused.value.faults[0].field == (field,)


@pytest.mark.parametrize("kind", KINDS)
def test_slices_that_are_joined_are_the_trajectory(kind: str) -> None:
    given = planned(kind)
    cuts = [0.0, *np.sort(np.random.default_rng(3).uniform(0.0, given.duration, 3)), given.duration]
    parts = [slice_trajectory(kuka(), given, start, end).trajectory for start, end in pairwise(cuts)]
    whole = join_trajectories(kuka(), parts)
    times = inner_times(given)
    for order in ORDERS:
        difference = np.abs(by_scipy(whole.trajectory, times, order) - by_scipy(given, times, order)).max()
        assert difference <= 1e-8 * (1.0 + scale(given, order))
    assert [junction.time for junction in whole.junctions] == pytest.approx(cuts[1:-1], abs=1e-9)
    assert whole.certificate.continuity == reverse_trajectory(kuka(), given).certificate.continuity


def test_trajectories_that_meet_within_the_tolerance_are_shifted() -> None:
    given = planned("ruckig")
    there_and_back = reverse_trajectory(kuka(), given).trajectory
    off = replace(there_and_back, coefficients=there_and_back.coefficients.copy())
    off.coefficients[:, 2, 0] += 5e-7
    whole = join_trajectories(kuka(), [given, off, given])
    assert whole.junctions[0].position_gap == pytest.approx([0, 0, -5e-7, 0, 0, 0], abs=1e-12)
    assert whole.junctions[1].position_gap == pytest.approx([0, 0, 5e-7, 0, 0, 0], abs=1e-12)
    assert whole.certificate.continuity == "C2"
    (end,) = whole.trajectory.evaluate(whole.trajectory.duration, [0])
    assert end == pytest.approx(given.evaluate(given.duration, [0])[0], abs=1e-12)


def test_trajectories_that_do_not_meet_say_where_and_by_how_much() -> None:
    given = planned("ruckig")
    with pytest.raises(InvalidProblem, match=r"position of joint_a1 is 0 .* but 0.5 .* 0.5 apart") as refused:
        join_trajectories(kuka(), [given, given])
    assert refused.value.faults[0].field == ("trajectories", 1)
    moving = slice_trajectory(kuka(), given, 0.0, 0.2).trajectory
    at = moving.evaluate(moving.duration, [0])[0]
    still = Trajectory(
        np.ones(1), at[None, :, None], np.zeros(1, dtype=int), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    )
    with pytest.raises(InvalidProblem, match=r"the velocity of .* is 0 at its start"):
        join_trajectories(kuka(), [moving, still])
    with pytest.raises(InvalidProblem, match="at least one"):
        join_trajectories(kuka(), [])


@pytest.mark.parametrize("kind", KINDS)
def test_resampling_has_the_derivatives(kind: str) -> None:
    given = planned(kind)
    found = resample_trajectory(kuka(), given, inner_times(given))
    for order, values in enumerate((found.position, found.velocity, found.acceleration, found.jerk)):
        wanted = by_scipy(given, inner_times(given), order)
        assert np.abs(values - wanted).max() <= 1e-9 * (1.0 + scale(given, order))
    periodic = resample_trajectory(kuka(), given, 0.004)
    assert periodic.time[-1] == given.duration
    assert np.diff(periodic.time[:-1]) == pytest.approx(0.004)


@pytest.mark.parametrize(
    ("at", "field"),
    [([0.0, 0.2, 0.1], ("times", 2)), ([0.0, 99.0], ("times", 1)), ([np.nan], ("times", 0)), (0.0, ("period",))],
)
def test_times_of_resampling_that_are_refused(at: object, field: tuple[object, ...]) -> None:
    with pytest.raises(InvalidProblem) as refused:
        resample_trajectory(kuka(), planned("cubic"), at)  # type: ignore[arg-type]
    assert refused.value.faults[0].field == field


def test_samples_that_are_read_are_what_the_certificate_of_samples_checks() -> None:
    given = planned("quintic")
    time = given.sample_times(0.02)
    position, velocity, acceleration = given.evaluate(time)
    for columns in ((position,), (position, velocity), (position, velocity, acceleration)):
        read = interpolated(kuka(), 3.0 + time, *columns)
        peaks = {check.quantity: check.peak for check in certify_samples(kuka(), time, *columns).checks}
        found = resample_trajectory(kuka(), read, 0.01, enforced=("position",)).certificate
        for check in found.checks:
            assert check.peak == pytest.approx(peaks[check.quantity], rel=1e-6)


def test_jerk_is_kept_where_it_is_bounded_and_reported_where_accelerations_jump() -> None:
    for kind, bounded in (("cubic", False), ("ruckig", True)):
        for done in (reverse_trajectory(kuka(), planned(kind)), slice_trajectory(kuka(), planned(kind), 0.1, 0.3)):
            [jerk] = [check for check in done.certificate.checks if check.quantity == "jerk"]
            assert jerk.enforced == bounded
    narrow = Limits(jerk=tuple(0.5 * kuka().limit("jerk")))
    with pytest.raises(LimitsUnsatisfiable, match="jerk"):
        reverse_trajectory(kuka(), planned("ruckig"), limits=narrow)
    allowed = reverse_trajectory(kuka(), planned("ruckig"), limits=narrow, enforced=("position", "velocity"))
    assert not all(check.satisfied for check in allowed.certificate.checks)


def test_a_broken_limit_is_refused() -> None:
    fast = planned("quintic").scaled(0.8)
    for operation in (reverse_trajectory, slice_trajectory):
        with pytest.raises(LimitsUnsatisfiable) as refused:
            operation(kuka(), fast)
        assert refused.value.joint is not None
        assert refused.value.time is not None


def test_what_no_robot_can_do_is_refused() -> None:
    with pytest.raises(InvalidProblem, match="jumps"):
        reverse_trajectory(kuka(), two_pieces([0.0, 0.1], [0.2, 0.0]))
    with pytest.raises(InvalidProblem, match="2 joints"):
        slice_trajectory(kuka(), two_pieces([0.0, 0.1], [0.1, 0.0], joints=2), 0.5)


def test_a_robot_at_rest_can_be_reversed_cut_and_joined() -> None:
    home = planned("cubic").evaluate(0.0, [0])[0]
    rest = Trajectory(
        np.ones(1), home[None, :, None], np.zeros(1, dtype=int), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    )
    assert reverse_trajectory(kuka(), rest).warnings == ()
    halves = [slice_trajectory(kuka(), rest, *times).trajectory for times in ((0.0, 0.5), (0.5, 1.0))]
    assert join_trajectories(kuka(), halves).trajectory.duration == 1.0
