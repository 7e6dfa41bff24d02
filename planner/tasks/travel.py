"""Estimated durations of the joint motions between tasks, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.kinematics.turns import counted_velocity
from planner.limits import segment_limits
from planner.problems.problem import PlanningProblem
from planner.spatial import FloatArray

UNUSABLE = 1e6
"""The duration, s, of a motion that has no plan."""


@dataclass(frozen=True, eq=False)
class JointSpeeds:
    """The widest limits of the joints in a problem.

    Attributes:
        velocity: (joints,), rad/s or m/s; a joint without a limit counts 1.
        acceleration: (joints,), rad/s^2 or m/s^2; infinite: no limit.
        shaping: The time, s, by which shaping lengthens each motion from rest to rest.
    """

    velocity: FloatArray
    acceleration: FloatArray
    shaping: float = 0.0

    @classmethod
    def of(cls, problem: PlanningProblem, *, stops: bool) -> JointSpeeds:
        """Find the widest limits of a trajectory.

        Args:
            problem: The robot, the limits of the whole trajectory, and the vibration mode.
            stops: Whether the robot stops at every waypoint; otherwise accelerations do not count.

        Raises:
            InvalidProblem: A limit is invalid.
        """
        robot, mode = problem.robot, problem.residual_vibration
        resolved = segment_limits(robot, problem.limits, (None,))
        velocity, acceleration = (
            np.maximum(-each.lower[0], each.upper[0]) for each in (resolved.velocity, resolved.acceleration)
        )
        shaping = mode.period if mode is not None and mode.suppress and stops else 0.0
        return cls(counted_velocity(velocity), acceleration if stops else np.full(robot.dof, np.inf), shaping)

    def durations(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Return the least durations (...), s, of joint motions from rest to rest, by the slowest joint.

        Args:
            starts: (..., joints), rad or m.
            ends: (..., joints), rad or m.
        """
        longest: FloatArray = np.zeros(np.broadcast_shapes(starts.shape, ends.shape)[:-1])
        ramps = self.velocity / self.acceleration
        for ramp in np.unique(ramps).tolist():
            travels = np.zeros_like(longest)
            for joint in np.flatnonzero(ramps == ramp).tolist():
                away = np.abs(starts[..., joint] - ends[..., joint])
                away /= self.velocity[joint]
                np.maximum(travels, away, out=travels)
            np.maximum(longest, _rest_to_rest(travels, ramp), out=longest)
        return longest

    def least_durations(self, travels: FloatArray) -> FloatArray:
        """Return lower bounds (...), s, for motions whose slowest joint travels for that long at full speed.

        Args:
            travels: (...), s: the largest of the joints' distances over their velocity limits.
        """
        return _rest_to_rest(travels, float((self.velocity / self.acceleration).min()))

    def requested(self, durations: FloatArray, minimum: FloatArray | float, fixed: FloatArray | float) -> FloatArray:
        """Return the durations (...), s, of motions with requested durations, shaped if the robot moves.

        Args:
            durations: (...), s: the least durations by the limits.
            minimum: (...), s: the requested least durations.
            fixed: (...), s: the requested durations; 0: none.
        """
        shaped = np.maximum(durations, minimum) + np.where(durations > 0.0, self.shaping, 0.0)
        return np.asarray(np.maximum(shaped, fixed), dtype=np.float64)


def _rest_to_rest(travels: FloatArray, ramp: float) -> FloatArray:
    """Return the durations, s, of `travels`, s, at full speed, with ramps of `ramp`, s, at both ends."""
    if ramp == 0.0:
        return travels
    return np.where(travels >= ramp, travels + ramp, 2.0 * np.sqrt(travels * ramp))
