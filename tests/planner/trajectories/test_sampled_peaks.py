"""Bounds on torque and tool speed against 20,000 samples, of real plans and of random ones; a million in soaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS
from planner.certificate.checks import Check
from planner.certificate.limits import certificate_of
from planner.dynamics import inverse_dynamics
from planner.errors import InvalidProblem, PlanningError
from planner.guarantees import QUANTITIES, Guarantee
from planner.kinematics import tool_speeds
from planner.limits import Bounds, Limits, SegmentLimits, segment_limits
from planner.planning import plan
from planner.problems.problem import PlanningProblem
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.trajectories.polynomials import cumulative_sums, quintic_hermite
from planner.trajectories.sampled_peaks import MOST_PEAK_PARTS, sampled_peaks
from planner.trajectories.trajectory import Trajectory
from tests.planner.backends.toppra.toppra_problems import KUKA, robot_limits, through, tool_problem
from tests.planner.problems_of_tests import random_position
from tests.sizes import NAME

HARD = dict.fromkeys(QUANTITIES, Guarantee.HARD)
SAMPLES = 1_000_000 if NAME == "soak" else 20_000

ROUNDING_OF_SAMPLES = 1e-11
"""Relative amount by which rounding alone may put a sample above a bound."""

ABOVE = 1e-4
"""Relative amount by which a bound may exceed the samples, which miss the peak."""


def brute_force(trajectory: Trajectory, robot: Robot) -> dict[str, np.ndarray]:
    """Sample the largest torque of each joint and the tool's speeds, evenly in time and on each piece.

    Samples of a piece include its ends.
    """
    count = len(trajectory.lengths)
    each = np.linspace(0.0, 1.0, max(50, SAMPLES // count))
    pieces = np.repeat(np.arange(count), len(each))
    tau = np.tile(each, count) * trajectory.lengths[pieces]
    pieces, tau = (
        np.concatenate(parts)
        for parts in zip((pieces, tau), trajectory.locate(np.linspace(0.0, trajectory.duration, SAMPLES)), strict=True)
    )
    states = []
    for k in range(3):
        powers = trajectory.derivative_coefficients(k)[pieces]
        states.append((powers * tau[:, None, None] ** np.arange(powers.shape[2])).sum(axis=2))
    linear, angular = tool_speeds(robot, *states[:2])
    worst = {"tcp_linear_velocity": linear.max(), "tcp_angular_velocity": angular.max()}
    if robot.has_dynamics:
        worst["torque"] = np.abs(inverse_dynamics(robot, *states)).max(axis=0)
    return worst


def problem(motion: str) -> PlanningProblem:
    limits = replace(robot_limits(load_robot(KUKA), 0.4), tcp_linear_velocity=0.7)
    if motion == "tool":
        return tool_problem(BlendTransition(0.05), limits=limits)
    transition = ThroughTransition() if motion == "through" else StopTransition()
    return replace(through(KUKA, 11, 5, 0.5, transition), limits=limits)


def checks_of(trajectory: Trajectory, robot: Robot, limits: SegmentLimits) -> dict[str, Check]:
    checks = certificate_of(trajectory, robot, limits, HARD, np.zeros((len(trajectory.arrivals), robot.dof))).checks
    return {check.quantity: check for check in checks if check.method == "bounded"}


@pytest.mark.long_table
@pytest.mark.parametrize("motion", ["stop", "through", "tool"])
@pytest.mark.parametrize("kind", [*BACKENDS])
def test_no_sample_of_a_real_plan_exceeds_its_bound(kind: str, motion: str) -> None:
    result = plan(problem(motion), BACKENDS[kind]())
    robot, limits = result.path.robot, result.path.limits
    worst = brute_force(result.trajectory, robot)
    for check in checks_of(result.trajectory, robot, limits).values():
        bound = limits.magnitudes(check.quantity)[0]  # the same on every segment
        ratio = (np.atleast_1d(worst[check.quantity]) / bound).max()
        assert check.satisfied
        assert ratio <= 1.0 + 1e-6
        assert ratio * (1.0 - ROUNDING_OF_SAMPLES) <= check.ratio <= ratio * (1.0 + ABOVE)


@pytest.mark.long_table
@pytest.mark.parametrize("motion", ["stop", "through", "tool"])
@pytest.mark.parametrize("kind", ["quintic", "trapezoidal", "toppra"])
def test_a_limit_a_millionth_below_the_peak_is_found_broken(kind: str, motion: str) -> None:
    result = plan(problem(motion), BACKENDS[kind]())
    robot, limits = result.path.robot, result.path.limits
    worst = brute_force(result.trajectory, robot)
    for joint, peak in enumerate(worst["torque"]):
        torque = np.full_like(limits.torque.narrower, np.inf)
        torque[:, joint] = peak * (1.0 - 1e-6)
        check = checks_of(result.trajectory, robot, replace(limits, torque=Bounds.of_magnitudes(torque)))["torque"]
        assert check.joint == robot.joint_names[joint]
        assert not check.satisfied
    for quantity in ("tcp_linear_velocity", "tcp_angular_velocity"):
        of_tool = {quantity: np.full(len(limits.torque.upper), worst[quantity] * (1.0 - 1e-6))}
        assert not checks_of(result.trajectory, robot, replace(limits, of_tool=of_tool))[quantity].satisfied


@settings(max_examples=min(60, max(4, settings.default.max_examples // 8)))
@given(seed=st.integers(0, 2**32), count=st.integers(1, 6), spread=st.floats(0.0, 3.0))
def test_quintics_of_any_shape_and_length(seed: int, count: int, spread: float) -> None:
    """Pieces have very different lengths, and independent velocities and accelerations."""
    robot, rng = load_robot(KUKA), np.random.default_rng(seed)
    lengths = 10.0 ** rng.uniform(-spread, 0.0, count)
    knots = np.array([random_position(robot, rng) for _ in range(count + 1)])
    rates = rng.uniform(-3.0, 3.0, knots.shape), rng.uniform(-20.0, 20.0, knots.shape)
    states = (knots, *rates)
    coefficients = quintic_hermite(lengths, tuple(state[:-1] for state in states), tuple(state[1:] for state in states))
    ends = cumulative_sums(lengths)[[0, -1]]
    trajectory = Trajectory(lengths, coefficients, np.zeros(count, dtype=int), ends, ends)
    worst = brute_force(trajectory, robot)
    limits = segment_limits(robot, Limits(tcp_linear_velocity=1.0, tcp_angular_velocity=1.0), (None,))
    for quantity, check in checks_of(trajectory, robot, limits).items():
        bound = robot.limit("torque") if quantity == "torque" else 1.0
        assert check.ratio is not None
        assert (worst[quantity] / bound).max() * (1.0 - ROUNDING_OF_SAMPLES) <= check.ratio


@settings(max_examples=min(15, max(2, settings.default.max_examples // 30)))
@given(
    robot_id=st.sampled_from([KUKA, "ngv_refuelling_arm", "date_sorting_arm"]),
    seed=st.integers(0, 2**32),
    travel=st.floats(-3.0, 0.0),
)
def test_quintics_that_hardly_move(robot_id: str, seed: int, travel: float) -> None:
    """Their travel needs few samples, but speeds may rise and fall within a twentieth of a piece."""
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    limits = segment_limits(robot, Limits(tcp_linear_velocity=1.0, tcp_angular_velocity=1.0), (None,))
    for length in 10.0 ** rng.uniform(-2.0, 1.0, 6):
        start, end = (
            tuple(10.0**travel * rng.uniform(-1.0, 1.0, (1, robot.dof)) / length**k for k in range(3)) for _ in range(2)
        )
        coefficients = quintic_hermite(np.array([length]), start, end)
        coefficients[..., 0] += random_position(robot, rng)
        ends = np.array([0.0, length])
        trajectory = Trajectory(ends[1:], coefficients, np.zeros(1, dtype=int), ends, ends)
        worst = brute_force(trajectory, robot)
        for quantity, check in checks_of(trajectory, robot, limits).items():
            bound = robot.limit("torque") if quantity == "torque" else 1.0
            assert (worst[quantity] / bound).max() * (1.0 - ROUNDING_OF_SAMPLES) <= (check.ratio or 0.0)


def test_what_no_limited_joint_feels_is_no_use_of_a_limit() -> None:
    """Joint 1 is upright: at rest it bears nothing."""
    robot = load_robot(KUKA)
    coefficients = np.array(random_position(robot, np.random.default_rng(1)))[None, :, None]
    limits = segment_limits(robot, Limits(), (None,))
    torque = np.full_like(limits.torque.narrower, np.inf)
    torque[0, 0] = 100.0
    check = checks_of(
        Trajectory(np.ones(1), coefficients, np.zeros(1, dtype=int), np.array([0.0, 1.0]), np.array([0.0, 1.0])),
        robot,
        replace(limits, torque=Bounds.of_magnitudes(torque)),
    )["torque"]
    assert check.satisfied
    assert check.peak == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=min(40, settings.default.max_examples // 4))
@given(
    kind=st.sampled_from(["cubic", "quintic", "trapezoidal", "toppra"]),
    seed=st.integers(0, 2**32),
    exponent=st.floats(-2.0, 0.0),
    strength=st.floats(1.02, 2.0),
)
@example("cubic", 33, -0.4, 1.1)
@example("trapezoidal", 5, -0.5, 1.3)
def test_no_plan_is_refused_for_a_torque_between_the_samples_of_its_back_end(
    kind: str, seed: int, exponent: float, strength: float
) -> None:
    """Seventeen samples a segment were too few: one in twenty plans with tight torques exceeded them."""
    made = through(KUKA, seed, 4, 10.0**exponent)
    positions = np.array([waypoint.position for waypoint in made.waypoints])
    still = np.zeros_like(positions)
    gravity = np.abs(inverse_dynamics(made.robot, positions, still, still)).max(axis=0)
    own = made.robot.limit("torque")
    torque = np.minimum(own, np.maximum(strength * gravity, 0.02 * own))
    tight = replace(made, limits=Limits(torque=tuple(torque.tolist())))
    try:
        assert plan(tight, BACKENDS[kind]()).certificate.satisfied
    except PlanningError as refusal:  # gravity, or a spline beyond a position limit
        assert "would reach" not in str(refusal)


def test_peaks_that_would_take_millions_of_samples_are_refused_and_none_is_left_out() -> None:
    one = np.zeros(1, dtype=int)

    def wave(_: np.ndarray, units: np.ndarray) -> np.ndarray:
        return np.cos(1e6 * units)[:, None]

    with pytest.raises(InvalidProblem, match="limits: on a motion on which a joint travels this far"):
        sampled_peaks(wave, one + MOST_PEAK_PARTS, one, one)
