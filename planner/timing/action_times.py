"""When the actions of a problem happen on its trajectory, and where on the way of the tool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.dynamics import SegmentDynamics
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.kinematics import tool_velocities
from planner.problems.actions import Action, AtDistance, AtTime, AtWaypoint, Wait
from planner.spatial import FloatArray
from planner.tolerances import BISECTIONS, NEGLIGIBLE_SHARE
from planner.trajectories.trajectory import Trajectory

QUADRATURE = np.polynomial.legendre.leggauss(12)
"""The nodes and weights of Gauss and Legendre's rule on [-1, 1]: exact for polynomials up to degree 23."""

LEAST_PARTS = 400
"""The least number of parts for measuring the tool's path.

The tool's speed has a kink where the tool almost reverses. A quadrature rule for smooth functions is wrong there by
less than 1e-6 of the length.
"""


@dataclass(frozen=True)
class TimedAction:
    """An action with its time.

    Attributes:
        index: Index of the action in the problem.
        action: The action.
        time: Time of the action, s from the start of the trajectory; of a wait, its start.
        distance: Distance that the tool has travelled until then, m.
    """

    index: int
    action: Action
    time: float
    distance: float


def action_times(
    dynamics: SegmentDynamics, trajectory: Trajectory, actions: Sequence[Action]
) -> tuple[TimedAction, ...]:
    """Compute the times of actions.

    Args:
        dynamics: The robot with its tool on each segment.
        trajectory: The trajectory.
        actions: The actions.

    Returns:
        The actions in order of time.

    Raises:
        InvalidProblem: An action is after the end of the trajectory.
    """
    if not actions:
        return ()
    way = _WayOfTheTool(dynamics, trajectory)
    waited: dict[int, float] = {}
    times, faults = [], list[tuple["FieldPath", str]]()
    for i, action in enumerate(actions):
        match action.at:
            case AtWaypoint(waypoint):
                times.append(float(trajectory.arrivals[waypoint]) + waited.get(waypoint, 0.0))
                if isinstance(action, Wait):
                    waited[waypoint] = waited.get(waypoint, 0.0) + action.duration
            case AtTime(time):
                times.append(min(time, trajectory.duration))
                if time > trajectory.duration * (1.0 + NEGLIGIBLE_SHARE):
                    faults.append((("actions", i, "at", "time"), f"the trajectory ends at {trajectory.duration!r} s"))
            case AtDistance(distance):
                times.append(way.time_at(min(distance, way.length)))
                if distance > way.length * (1.0 + NEGLIGIBLE_SHARE):
                    faults.append((("actions", i, "at", "distance"), f"the tool goes {way.length!r} m in all"))
    if faults:
        raise InvalidProblem(faults)
    timed = [
        TimedAction(i, action, time, way.distance_at(time))
        for i, (action, time) in enumerate(zip(actions, times, strict=True))
    ]
    return tuple(sorted(timed, key=lambda one: one.time))


class _WayOfTheTool:
    """The distance travelled by the tool, by quadrature of its speed on parts of the trajectory's pieces."""

    def __init__(self, dynamics: SegmentDynamics, trajectory: Trajectory) -> None:
        self._dynamics = dynamics
        self._trajectory = trajectory
        ends = trajectory.breakpoints
        parts = -(-LEAST_PARTS // (len(ends) - 1))
        self._breakpoints = np.interp(np.arange((len(ends) - 1) * parts + 1) / parts, np.arange(len(ends)), ends)
        lengths = self._lengths(self._breakpoints[:-1], self._breakpoints[1:])
        self._reached = np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """The length of the whole way, m."""
        return float(self._reached[-1])

    def distance_at(self, time: float) -> float:
        """Return the distance that the tool has travelled at a time, m."""
        piece = int(np.clip(np.searchsorted(self._breakpoints, time, side="right") - 1, 0, len(self._reached) - 2))
        start = self._breakpoints[piece : piece + 1]
        return float(self._reached[piece] + self._lengths(start, np.array([time]))[0])

    def time_at(self, distance: float) -> float:
        """Find the first time at which the tool has gone so far, s."""
        piece = max(int(np.searchsorted(self._reached, distance, side="left")) - 1, 0)
        low, high = self._breakpoints[piece], self._breakpoints[piece + 1]
        if distance <= self._reached[piece]:
            return float(low)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            low, high = (middle, high) if self.distance_at(middle) < distance else (low, middle)
        return float(high)

    def _lengths(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Integrate the speed of the tool (m/s) between times (N,), s, by Gauss and Legendre's rule."""
        nodes, weights = QUADRATURE
        half = (ends - starts)[:, None] / 2.0
        times = (starts[:, None] + half * (1.0 + nodes)).ravel()
        position, velocity = self._trajectory.evaluate(times, [0, 1])
        segments = self._trajectory.segments[self._trajectory.locate(times)[0]]
        linear, _ = self._dynamics.by_robot(tool_velocities, segments, position, velocity)
        speeds = np.linalg.norm(linear, axis=1).reshape(len(starts), -1)
        lengths: FloatArray = (speeds * weights * half).sum(axis=1)
        return lengths
