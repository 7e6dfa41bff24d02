"""The certificate against brute force: 100,000 samples of every polynomial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.backends import QUANTITIES, Guarantee
from planner.certificate.limits import certificate_of
from planner.limits import Limits, segment_limits
from planner.planning import plan
from planner.problems.problem import PlanningProblem
from planner.robots import load_robot
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitude
from planner.trajectories.polynomials import PiecewisePolynomial, cumulative_sums
from planner.trajectories.trajectory import Trajectory

HARD = dict.fromkeys(QUANTITIES, Guarantee.HARD)


def trajectory_of(lengths: np.ndarray, coefficients: np.ndarray) -> Trajectory:
    ends = cumulative_sums(lengths)[[0, -1]]
    return Trajectory(lengths, coefficients, np.zeros(len(lengths), dtype=int), ends, ends)


def largest(coefficients: np.ndarray, lengths: np.ndarray, measure: np.ndarray) -> tuple[int, int, float, float]:
    """Return piece, joint, local time and value of the largest magnitude."""
    polynomials = derivatives_on_unit_time(PiecewisePolynomial(lengths, coefficients), 1)[0]
    piece, joint, u, value = largest_magnitude(polynomials, measure)
    return piece, joint, u * lengths[piece], value


@given(seed=st.integers(0, 2**32), order=st.integers(1, 8), pieces=st.integers(1, 4), joints=st.integers(1, 3))
def test_largest_magnitude_is_never_below_100_000_samples(seed: int, order: int, pieces: int, joints: int) -> None:
    rng = np.random.default_rng(seed)
    lengths = 10.0 ** rng.uniform(-3, 2, pieces)
    # Coefficients of wildly different sizes, some of them zero.
    coefficients = rng.normal(size=(pieces, joints, order)) * 10.0 ** rng.uniform(-3, 3, (pieces, joints, order))
    coefficients *= rng.random((pieces, joints, order)) < 0.8
    coefficients /= lengths[:, None, None] ** np.arange(order)
    measure = 10.0 ** rng.uniform(-2, 2, (pieces, joints))
    piece, joint, tau, value = largest(coefficients, lengths, measure)
    found = abs(value) / measure[piece, joint]
    assert np.polynomial.Polynomial(coefficients[piece, joint])(tau) == pytest.approx(value, rel=1e-9, abs=1e-300)
    brute = max(
        np.abs(np.polynomial.Polynomial(coefficients[i, j])(np.linspace(0.0, lengths[i], 100_000))).max()
        / measure[i, j]
        for i in range(pieces)
        for j in range(joints)
    )
    assert found >= brute * (1.0 - 1e-12)
    # The samples are at most half a step off the extremum, where the curve is flat.
    assert found <= brute * (1.0 + 1e-6) + 1e-12


def test_a_peak_between_two_samples_is_found() -> None:
    """A bump is a millionth of the piece wide: samples would miss it."""
    centre = 0.3123456789
    # -(t - c)^2 k + 1 on a piece of 2e-6 s in the middle of an idle second
    k = 1e12
    start = centre - 1e-6
    bump = np.array([1.0 - k * (start - centre) ** 2, -2 * k * (start - centre), -k])
    coefficients = np.zeros((3, 1, 3))
    coefficients[1, 0] = bump
    lengths = np.array([start, 2e-6, 1.0 - start - 2e-6])
    _, _, tau, value = largest(coefficients, lengths, np.ones((3, 1)))
    assert value == pytest.approx(1.0, abs=1e-9)
    assert start + tau == pytest.approx(centre, abs=1e-9)


def cubic_move(travel: float, duration: float) -> Trajectory:
    coefficients = np.zeros((1, 3, 4))
    coefficients[0, 1] = [0.0, 0.0, 3.0 * travel / duration**2, -2.0 * travel / duration**3]
    return trajectory_of(np.array([duration]), coefficients)


def test_checks_name_the_joint_the_limit_and_the_time() -> None:
    robot = load_robot("three_dof_arm")
    limits = segment_limits(robot, Limits(velocity=(0.5, 0.3, 0.2)), (None,))
    certificate = certificate_of(cubic_move(1.0, 2.5), robot, limits, HARD, np.array([[0, 0, 0], [0, 1.0, 0]], float))
    velocity = next(check for check in certificate.checks if check.quantity == "velocity")
    assert (velocity.joint, velocity.limit, velocity.method) == (robot.joint_names[1], 0.3, "exact")
    assert velocity.peak == pytest.approx(1.5 / 2.5)
    assert velocity.ratio == pytest.approx(2.0)
    assert velocity.time == pytest.approx(1.25)
    assert not certificate.satisfied
    assert certificate.waypoint_error == pytest.approx(0.0, abs=1e-15)


def test_position_limits_count_from_the_middle_of_the_range() -> None:
    robot = load_robot("date_sorting_arm")  # l1 from 0 to 0.5
    coefficients = np.zeros((1, 6, 2))
    coefficients[0, 1] = [0.25, 0.3]
    certificate = certificate_of(
        trajectory_of(np.array([1.0]), coefficients),
        robot,
        segment_limits(robot, Limits(), (None,)),
        HARD,
        np.array([coefficients[0, :, 0], coefficients[0].sum(axis=1)]),
    )
    position = certificate.checks[0]
    assert (position.joint, position.limit, position.time) == (robot.joint_names[1], 0.5, 1.0)
    assert position.peak == pytest.approx(0.55)
    assert position.ratio == pytest.approx(0.3 / 0.25)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ([0.0, 0.0, 1.0], [1.5, 2.0, -1.0], "none"),  # a jump of position
        ([0.0, 1.0], [1.0, -1.0], "C0"),
        ([0.0, 0.0, 1.0], [1.0, 2.0, -1.0], "C1"),
        ([0.0, 0.0, 0.0, 1.0], [1.0, 3.0, 3.0, -7.0], "C0"),  # does not end at rest
    ],
)
def test_continuity_counts_rest_before_and_after(first: list[float], second: list[float], expected: str) -> None:
    robot = load_robot("three_dof_arm")
    coefficients = np.zeros((2, 3, max(len(first), len(second))))
    coefficients[0, 0, : len(first)] = first
    coefficients[1, 0, : len(second)] = second
    certificate = certificate_of(
        trajectory_of(np.ones(2), coefficients), robot, segment_limits(robot, Limits(), (None,)), HARD, np.zeros((2, 3))
    )
    assert certificate.continuity == expected


def test_a_jump_of_velocity_breaks_an_enforced_acceleration_limit_whatever_the_pieces_say() -> None:
    robot = load_robot("three_dof_arm")
    coefficients = np.zeros((1, 3, 2))
    coefficients[0, 0] = [0.0, 0.01]
    certificate = certificate_of(
        trajectory_of(np.ones(1), coefficients), robot, segment_limits(robot, Limits(), (None,)), HARD, np.zeros((2, 3))
    )
    acceleration = next(check for check in certificate.checks if check.quantity == "acceleration")
    assert (acceleration.peak, acceleration.bounded, acceleration.ratio) == (0.0, False, None)
    assert not certificate.satisfied


def test_a_piece_of_no_length_changes_no_peak() -> None:
    """The bounds divided by its length, and did not end."""
    robot = load_robot("ur5e")
    whole = plan(PlanningProblem(robot, [[0.0, -1.0, 1.0, 0.0, 0.0, 0.0], [0.5, -1.2, 1.0, 0.0, 0.4, 0.0]])).trajectory
    halves = whole.split(np.full(len(whole.lengths), 2))
    row = len(halves.lengths) // 2
    inserted = replace(
        halves,
        lengths=np.insert(halves.lengths, row, 0.0),
        coefficients=np.insert(halves.coefficients, row, halves.coefficients[row], axis=0),
        segments=np.insert(halves.segments, row, 0),
    )
    ends, limits = whole.evaluate(whole.breakpoints[[0, -1]], [0])[0], segment_limits(robot, Limits(), (None,))
    expected, found = (certificate_of(motion, robot, limits, HARD, ends) for motion in (halves, inserted))
    assert [own.peak for own in found.checks] == pytest.approx([own.peak for own in expected.checks], rel=1e-12)
