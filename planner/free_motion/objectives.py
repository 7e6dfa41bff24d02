"""Objectives of free motions: exact for a trajectory, estimated for a path without time."""

from __future__ import annotations

import numpy as np

from planner.dynamics import SegmentDynamics
from planner.limits import SegmentLimits
from planner.paths import JointPath
from planner.problems.motion_around import Objective
from planner.spatial import FloatArray
from planner.trajectories.integrals import Nodes
from planner.trajectories.trajectory import Trajectory

LEAST_UNIT_TIME = 1e-3
"""The least time for a radian or a metre, s, assumed for joints without a velocity limit."""


def value_of(objective: Objective, path: JointPath, trajectory: Trajectory) -> float:
    """Compute the value of a trajectory, see `planner.problems.motion_around.Objective`.

    Args:
        objective: The objective.
        path: The path of the trajectory, with its limits and dynamics.
        trajectory: The trajectory along the path.
    """
    if objective == "duration" or not trajectory.duration:
        return trajectory.duration
    weights, segments, (q, dq, ddq, _) = Nodes.of(trajectory)
    if objective == "path_length":
        return float(weights @ np.linalg.norm(dq, axis=1))
    return float(weights @ effort_rates(path.dynamics, path.limits, segments, q, dq, ddq))


def effort_rates(
    dynamics: SegmentDynamics,
    limits: SegmentLimits,
    segments: np.ndarray,
    q: FloatArray,
    dq: FloatArray,
    ddq: FloatArray,
) -> FloatArray:
    """Compute the effort per second (N,) in states (N, joints) on segments (N,).

    It is the sum over joints of (torque / limit)^2, or of (acceleration / limit)^2 where torques or their limits are
    unknown.
    """
    torque = limits.torque.narrower[segments]
    if dynamics.has_dynamics and np.isfinite(torque).any():
        shares = dynamics.torques(segments, q, dq, ddq) / torque
    else:
        shares = ddq / limits.acceleration.narrower[segments]
    return np.asarray((shares**2).sum(axis=1), dtype=np.float64)


class Estimate:
    """The estimated cost of a path, with straight legs at full speed and corners at full acceleration.

    A leg takes as long as its slowest joint at its velocity limit. At each corner and at both ends, a change u of the
    velocities takes max|u / a|. Half of it is lost time, as for straight legs joined by parabolas. See Craig,
    Introduction to Robotics, section 7.3. On short paths everything is slower by the factor that minimises the sum.
    """

    def __init__(self, objective: Objective, path: JointPath, segment: int) -> None:
        """Prepare for paths whose legs have the limits, the payload and the tool of a segment of a path."""
        self._objective: Objective = objective
        self._path, self._segment = path, segment
        limits = path.limits
        self._velocity, self._acceleration = (own.narrower[segment] for own in (limits.velocity, limits.acceleration))

    def __call__(self, positions: FloatArray) -> float:
        """Estimate the cost of a path (positions, joints), in the units of its objective."""
        steps = positions[1:] - positions[:-1]
        legs = np.sqrt(np.square(steps).sum(axis=1))
        if self._objective == "path_length":
            return float(legs.sum())
        if not legs.all():
            return self(positions[np.append(legs > 0.0, True)]) if legs.any() else 0.0
        times = np.maximum((np.abs(steps) / self._velocity).max(axis=1), LEAST_UNIT_TIME * legs)
        rates = np.zeros((len(steps) + 2, steps.shape[1]))
        rates[1:-1] = steps / times[:, None]
        changes = rates[1:] - rates[:-1]
        turns = (np.abs(changes) / self._acceleration).max(axis=1)
        going, turning = float(times.sum()), 0.5 * float(turns.sum())
        slower = max(1.0, (turning / going) ** 0.5)
        if self._objective == "duration":
            return float(going * slower + turning / slower)
        held = self._effort(positions[:-1] + steps / 2.0, np.zeros_like(steps)) @ times
        bent = self._effort(positions, changes / np.where(turns > 0.0, turns, 1.0)[:, None]) @ turns
        return float(held * slower + 0.5 * bent / slower)

    def farthest(self, cost: float) -> FloatArray:
        """Return the estimated largest travel of the joints (joints,) on a path within a cost, rad or m."""
        if self._objective == "effort":
            return np.full(len(self._velocity), np.inf)
        return self._velocity * cost if self._objective == "duration" else np.full(len(self._velocity), cost)

    def _effort(self, positions: FloatArray, accelerations: FloatArray) -> FloatArray:
        segments = np.full(len(positions), self._segment)
        still = np.zeros_like(positions)
        return effort_rates(self._path.dynamics, self._path.limits, segments, positions, still, accelerations)
