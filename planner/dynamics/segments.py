"""A robot that puts down and picks up payloads on its way, and changes its tool: its torques, and the tool's motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner.dynamics.inverse import check_dynamics, inverse_dynamics, torques_by_pace
from planner.robots import Robot
from planner.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class SegmentDynamics:
    """The robot on each segment of a path, with its payload and tool there.

    Both change only where the robot stops, so a segment group has one payload and one tool.

    Attributes:
        robots: The robot with each payload that it carries and each tool, the one at the start first.
        indices: (segments + 1,), index of the robot on each segment, and of the one after the last waypoint.
    """

    robots: tuple[Robot, ...]
    indices: np.ndarray

    @classmethod
    def unchanged(cls, robot: Robot) -> SegmentDynamics:
        """Return the dynamics of a robot with the same payload and tool on all segments."""
        return cls((robot,), np.zeros(1, dtype=int))

    @classmethod
    def of_robots(cls, robots: Sequence[Robot]) -> SegmentDynamics:
        """Return the dynamics of the robots (segments + 1,) on each segment and after the last one."""
        distinct = tuple(dict.fromkeys(robots))
        return cls(distinct, np.array([distinct.index(robot) for robot in robots]))

    @property
    def has_dynamics(self) -> bool:
        """Whether torques can be computed, on one segment at least; on the others they are taken for zero."""
        return any(robot.has_dynamics for robot in self.robots)

    @property
    def changes(self) -> list[tuple[int, Robot]]:
        """The waypoints at which payload or tool change, each with the robot that goes on from there."""
        at = np.flatnonzero(np.diff(self.indices)) + 1
        return [(waypoint, self.robots[self.indices[waypoint]]) for waypoint in at.tolist()]

    def robot_on(self, segment: int) -> Robot:
        """Return the robot with its payload and tool on a segment."""
        return self.robots[0] if len(self.robots) == 1 else self.robots[self.indices[segment]]

    def indices_on(self, segments: np.ndarray) -> np.ndarray:
        """Return the indices of the robots on segments."""
        return np.zeros_like(segments) if len(self.robots) == 1 else self.indices[segments]

    def by_robot(
        self, function: Callable[..., tuple[FloatArray, ...]], segments: np.ndarray, *states: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Combine the results of a function for each robot and the states (..., joints) on its segments (...)."""
        if len(self.robots) == 1:
            return function(self.robots[0], *states)
        indices = np.broadcast_to(self.indices[segments], states[0].shape[:-1])
        used = np.unique(indices).tolist()
        if len(used) <= 1:
            return function(self.robots[used[0] if used else 0], *states)
        results: tuple[FloatArray, ...] = ()
        for index in used:
            rows = indices == index
            parts = function(self.robots[index], *(state[rows] for state in states))
            results = results or tuple(np.empty((*indices.shape, *part.shape[1:])) for part in parts)
            for result, part in zip(results, parts, strict=True):
                result[rows] = part
        return results

    def torques(
        self, segments: np.ndarray, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray
    ) -> FloatArray:
        """Compute the joint torques of a motion, those against gravity and of the payload included.

        Args:
            segments: (...), index of the segment of each state.
            positions: (..., joints), rad or m.
            velocities: Of the same shape, rad/s or m/s.
            accelerations: Of the same shape, rad/s^2 or m/s^2.

        Returns:
            Torques of the same shape, N m; forces in N for prismatic joints.

        Raises:
            MissingDynamics: The robot has neither inertias nor a payload on any segment.
        """
        if not self.has_dynamics:
            check_dynamics(self.robots[0])

        def of(robot: Robot, *states: FloatArray) -> tuple[FloatArray]:
            return (inverse_dynamics(robot, *states) if robot.has_dynamics else np.zeros(states[0].shape),)

        (torques,) = self.by_robot(of, segments, positions, velocities, accelerations)
        return torques

    def torques_by_pace(self, segments: np.ndarray, *states: FloatArray) -> tuple[FloatArray, ...]:
        """Return the coefficients of 1, x and x^2, each (N, joints), of the torques at the pace x.

        Args:
            segments: (N,), index of the segment of each state.
            states: Positions, velocities and accelerations at the pace 1, each (N, joints).
        """

        def of(robot: Robot, *states: FloatArray) -> tuple[FloatArray, ...]:
            return torques_by_pace(robot, *states) if robot.has_dynamics else (np.zeros(states[0].shape),) * 3

        return self.by_robot(of, segments, *states)
