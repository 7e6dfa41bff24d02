"""The continuous (RMS) torque of joints over a trajectory or a cycle, bounded by integration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.constraints.bounded import MOST_BOUND_PARTS, MOST_INTERVALS_OF_PIECE
from planner.dynamics import SegmentDynamics, inverse_dynamics
from planner.errors import InvalidProblem
from planner.kernels.bounded_peaks import Motion
from planner.kernels.library import TooManySamples
from planner.kernels.torque_squares import bound_torque_squares
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.sampled_peaks import TOO_FAR
from planner.trajectories.trajectory import Trajectory

SQUARES_KNOWN_TO = 1e-8
"""Share of a squared limit to which the mean of the squared torque is known."""


class RmsTorque(NamedTuple):
    """Limits of the RMS torque.

    Attributes:
        limits: (joints,), N m or N; infinite: none.
        cycle_time: Time from the start of the trajectory to its next start, s; the robot rests after its end. Less than
            the duration: the trajectory repeats at once.
    """

    limits: FloatArray
    cycle_time: float = 0.0

    def cycle(self, trajectory: Trajectory) -> float:
        """Return the time over which the mean is taken, s."""
        return max(self.cycle_time, trajectory.duration)


def held_at_the_end(dynamics: SegmentDynamics, trajectory: Trajectory) -> FloatArray:
    """Return the torques (joints,) that hold the arm after a trajectory; zero without inertias."""
    robot = dynamics.robots[int(dynamics.indices[-1])]
    (position,) = trajectory.evaluate(trajectory.duration, [0])
    still = np.zeros_like(position)
    return inverse_dynamics(robot, position, still, still) if robot.has_dynamics else still


def bound_rms_torque(
    dynamics: SegmentDynamics, trajectory: Trajectory, rms: RmsTorque
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds (joints,) on the RMS torques over the cycle of a trajectory.

    Raises:
        InvalidProblem: A joint travels so far that the bounds would take too many intervals.
    """
    derivatives = derivatives_on_unit_time(trajectory, 1)
    lower, upper = np.zeros((2, len(rms.limits)))
    robots = dynamics.indices_on(trajectory.segments)
    most = MOST_BOUND_PARTS + MOST_INTERVALS_OF_PIECE * len(robots)
    for index in np.unique(robots).tolist():
        rows, robot = np.flatnonzero(robots == index), dynamics.robots[index]
        if not robot.has_dynamics:
            continue
        motion = Motion(trajectory.lengths[rows], derivatives.coefficients[0][rows], derivatives.bernstein[0][rows])
        try:
            least, largest = bound_torque_squares(robot.chain, motion, SQUARES_KNOWN_TO * rms.limits**2, most)
        except TooManySamples:
            raise InvalidProblem([(("limits",), TOO_FAR)]) from None
        lower, upper = lower + least, upper + largest
    cycle = rms.cycle(trajectory)
    resting = (cycle - trajectory.duration) * held_at_the_end(dynamics, trajectory) ** 2
    lower, upper = (lower + resting) * (1.0 - ROUNDING), (upper + resting) * (1.0 + ROUNDING)
    return np.sqrt(lower / cycle), np.sqrt(upper / cycle)
