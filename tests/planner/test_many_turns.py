"""Joints that turn many times under sampled limits: no excess goes unseen, and excessive travel is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.corpus.promises import keeps_sampled_limits
from planner.backends import BACKENDS, BackEnd
from planner.certificate.limits import certificate_of
from planner.dynamics import SegmentDynamics, inverse_dynamics
from planner.errors import InvalidProblem
from planner.guarantees import QUANTITIES, Guarantee
from planner.limits import Bounds, Limits, segment_limits
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import StopTransition, ThroughTransition, Transition
from planner.robots import load_robot
from planner.robots.payload import Payload
from planner.time_scaling.sampled_limits import SampledLimits
from planner.trajectories.polynomials import quintic_hermite
from planner.trajectories.sampled_peaks import EASY_TRAVEL, MOST_TRAVEL
from planner.trajectories.trajectory import Trajectory
from tests.planner.backends.toppra.toppra_problems import KUKA

HARD = dict.fromkeys(QUANTITIES, Guarantee.HARD)
LIFTING = [1, 2, 4]
"""Joints of the arm with parallel axes: the torque of the last of them depends on the sum of their angles."""

SECONDS = 1e6
"""Duration at which only gravity counts."""


@pytest.mark.parametrize("is_quintic", [False, True])
@pytest.mark.parametrize(
    ("joints", "turns"), [(LIFTING, 128 / 3), (LIFTING, 40.0), ([4], 128.0), ([4], 256.0), ([4], 512.0)]
)
def test_a_torque_that_is_none_at_every_sample_of_a_coarse_grid_is_seen(
    joints: list[int], turns: float, is_quintic: bool
) -> None:
    """The last joint bears nothing at the start and at each half turn, and half of the most while the arm rests before.

    All of 257 samples of a piece were at such positions, whether the joint turned 128 times or three joints 43 times.
    """
    robot = load_robot(KUKA)

    def torque(q: np.ndarray) -> np.ndarray:
        still = np.zeros_like(q)
        return np.abs(inverse_dynamics(robot, q, still, still)[:, 4])

    angles = np.zeros((2, robot.dof))
    angles[1, 4] = np.pi / 2.0
    still = np.zeros_like(angles)
    across, along = inverse_dynamics(robot, angles, still, still)[:, 4]
    rest, start = np.zeros((2, robot.dof))
    rest[4] = np.arctan2(along, across) + np.pi / 3.0
    start[4] = np.arctan2(along, across) + np.pi / 2.0
    way = np.zeros(robot.dof)
    way[joints] = 2.0 * np.pi * turns

    coefficients = np.zeros((2, robot.dof, 6))
    coefficients[0, :, 0] = rest
    coefficients[1, :, 0], coefficients[1, :, 1] = start, way / SECONDS
    if is_quintic:
        still = np.zeros((1, robot.dof))
        states = ((at[None], still, still) for at in (start, start + way))
        coefficients[1] = quintic_hermite(np.array([SECONDS]), *states)[0]
    lengths, segments = np.array([1.0, SECONDS]), np.zeros(2, dtype=int)
    ends = np.array([0.0, lengths.sum()])
    trajectory = Trajectory(lengths, coefficients, segments, ends, ends)
    shares = np.linspace(0.0, 1.0, 64 * int(3 * turns))
    most = torque(start + shares[:, None] * way).max()
    assert torque(rest[None]).max() == pytest.approx(0.5 * most, rel=1e-3)
    assert torque(start + np.arange(3)[:, None] * np.pi * np.eye(robot.dof)[4]).max() < 1e-6 * most

    limits = segment_limits(robot, Limits(), (None,))
    bounds = np.full_like(limits.torque.narrower, np.inf)
    bounds[0, 4] = most
    limits = replace(limits, torque=Bounds.of_magnitudes(bounds))
    checks = certificate_of(trajectory, robot, limits, HARD, np.zeros((2, robot.dof))).checks
    (check,) = (check for check in checks if check.quantity == "torque")
    assert check.peak == pytest.approx(most, rel=1.1e-4)
    use = SampledLimits(SegmentDynamics.unchanged(robot), limits).use(trajectory, segments)
    assert use.max() == pytest.approx(1.0, rel=4e-4)


def spindle(turns: float, limits: Limits, transition: Transition) -> PlanningProblem:
    """Return a problem whose last joint, without position limits, passes a waypoint while it turns."""
    robot = load_robot("ngv_refuelling_arm")
    way = np.array([0.3, 0.2, -0.3, 0.1, 0.2, 2.0 * np.pi * turns])
    first, half, last = (tuple(robot.middle + share * way) for share in (0.0, 0.5, 1.0))
    waypoints = [JointWaypoint(first), JointWaypoint(half, transition=transition), JointWaypoint(last)]
    return PlanningProblem(robot, waypoints, limits=limits, payload=Payload(2.0))


SPINDLE_LIMITS = {
    "torque": Limits(torque=(14.0,) * 6),
    "tool": Limits(tcp_linear_velocity=0.02, tcp_angular_velocity=3.0),
    "accelerations": Limits(tcp_linear_acceleration=0.02, tcp_linear_jerk=0.5),
}


@pytest.mark.long_table
@pytest.mark.parametrize(
    "turns", [48.0, pytest.param(200.0, marks=pytest.mark.large_only), pytest.param(1e3, marks=pytest.mark.large_only)]
)
@pytest.mark.parametrize("limits", SPINDLE_LIMITS)
@pytest.mark.parametrize("backend", BACKENDS.values())
def test_a_spindle_turns_hundreds_of_times(backend: type[BackEnd], limits: str, turns: float) -> None:
    """A plan with fifty turns was refused."""
    keeps_sampled_limits(plan(spindle(turns, SPINDLE_LIMITS[limits], ThroughTransition()), backend()), 2000)


def turned_far(turned: float, limits: Limits, transition: Transition) -> PlanningProblem:
    """Return a problem in which all joints without position limits turn far, past a waypoint halfway."""
    robot = load_robot("ngv_refuelling_arm")
    way = turned * np.array([1.0, -0.9, 0.8, 0.7, -0.6, 0.5])
    half = JointWaypoint(position=tuple(robot.middle + 0.5 * way), transition=transition)
    ends = JointWaypoint(position=tuple(robot.middle)), JointWaypoint(position=tuple(robot.middle + way))
    return PlanningProblem(robot, [ends[0], half, ends[1]], limits=limits, payload=Payload(2.0))


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS.keys() - {"min_effort"}))  # whose tool is compared with too few chords
def test_all_joints_turn_fifty_times(kind: str) -> None:
    """The tool's speed rises and falls with sums of the angles, more than a hundred times."""
    made = turned_far(2.0 * np.pi * 50.0, Limits(tcp_linear_velocity=0.25), StopTransition())
    keeps_sampled_limits(plan(made, BACKENDS[kind]()), 2000)


@pytest.mark.parametrize("limits", SPINDLE_LIMITS)
@pytest.mark.parametrize("backend", BACKENDS.values())
def test_a_joint_sent_a_million_turns_far_is_refused_at_once(backend: type[BackEnd], limits: str) -> None:
    """Such a request took 42 s and 5 GiB with `ruckig`, and then ran out of memory."""
    far = 2.0 * np.pi * 1e6
    for turned, transition in ((-far, ThroughTransition()), (far, StopTransition())):
        made = turned_far(turned, SPINDLE_LIMITS[limits], transition)
        with pytest.raises(InvalidProblem, match=r"waypoints\[1\]: joint joint_1 travels"):
            plan(made, backend())


def test_turns_of_several_segments_count_together() -> None:
    turned = 1.9 * (MOST_TRAVEL + EASY_TRAVEL)  # half of it on each of two segments
    with pytest.raises(InvalidProblem, match=r"waypoints\[2\]: joint joint_1 travels"):
        plan(turned_far(turned, SPINDLE_LIMITS["tool"], StopTransition()))


@pytest.mark.large_only
@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal", "ruckig", "toppra"])
@pytest.mark.parametrize("limits", SPINDLE_LIMITS)
def test_what_is_not_refused_at_once_can_be_sampled(kind: str, limits: str) -> None:
    """No back end moves so unevenly that its samples are too many."""
    turns = 0.999 * MOST_TRAVEL / (2.0 * np.pi)
    keeps_sampled_limits(plan(spindle(turns, SPINDLE_LIMITS[limits], StopTransition()), BACKENDS[kind]()), 2000)


def test_a_joint_may_be_sent_a_million_radians_far_where_nothing_is_sampled() -> None:
    assert plan(turned_far(1e6, Limits(), ThroughTransition())).certificate.satisfied
