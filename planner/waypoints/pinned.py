"""Robots some of whose external axes a waypoint pins: the arm that is left to reach its pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import Remedy
from planner.kinematics.inverse import InverseKinematicsResult, inverse_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.problem import AnyWaypoint, PoseWaypoint
from planner.robots import Robot
from planner.robots.derived.changes import with_locked
from planner.robots.findings import Findings, shown
from planner.spatial import FloatArray, Pose


@dataclass(frozen=True, eq=False)
class Pinned:
    """A robot with the external axes that a waypoint fixes, if any.

    Attributes:
        robot: The robot without them, with its tool.
        left: (joints of all,), bool: the joints that it has.
        values: (joints of all,), rad or m: positions of the fixed axes; 0 for the remaining joints.
    """

    robot: Robot
    left: np.ndarray
    values: FloatArray

    @property
    def is_pinned(self) -> bool:
        """Whether there are fixed axes."""
        return not self.left.all()

    def whole(self, positions: FloatArray) -> FloatArray:
        """Return positions (..., joints of all) that include the fixed axes."""
        if not self.is_pinned:
            return positions
        found = np.broadcast_to(self.values, (*positions.shape[:-1], len(self.values))).copy()
        found[..., self.left] = positions
        return found

    def own(self, positions: FloatArray) -> FloatArray:
        """Return positions (..., joints) of the joints that are left."""
        return positions[..., self.left]

    def options(self, options: InverseKinematicsOptions) -> InverseKinematicsOptions:
        """Return the options for the joints that are left."""
        if options.reference is None or not self.is_pinned:
            return options
        return replace(options, reference=tuple(self.own(np.array(options.reference)).tolist()))

    def solutions(self, solutions: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        """Return solutions (joints of all,)."""
        return tuple(map(self.whole, solutions))

    def failure(self, result: InverseKinematicsResult) -> InverseKinematicsResult:
        """Return why there is no solution, with the position of all joints."""
        return replace(result, position=self.whole(result.position))


def pinned_robots(robots: Sequence[Robot], waypoints: Sequence[AnyWaypoint]) -> list[Pinned]:
    """Return the remaining robot for each waypoint; equal fixed positions share one robot."""
    known: dict[tuple[int, tuple[tuple[str, float], ...]], Pinned] = {}
    found = []
    for robot, waypoint in zip(robots, waypoints, strict=True):
        pins = dict(waypoint.external or {}) if isinstance(waypoint, PoseWaypoint) else {}
        key = id(robot), tuple(sorted(pins.items()))
        if key not in known:
            known[key] = pinned_at(robot, pins)
        found.append(known[key])
    return found


def pinned_at(robot: Robot, pins: dict[str, float]) -> Pinned:
    """Return the robot with joints held at positions (rad or m) within their limits, by their names."""
    left = np.array([name not in pins for name in robot.joint_names])
    values = np.array([pins.get(name, 0.0) for name in robot.joint_names])
    return Pinned(with_locked(robot, pins, Findings()), left, values)


def without_pins(robot: Robot, index: int, waypoint: AnyWaypoint, pose: Pose, near: FloatArray) -> Iterator[Remedy]:
    """Yield the remedy of a pose that can be reached where external axes are not pinned.

    The robot has all its joints, and comes from the joint position `near` (joints,).
    """
    if not isinstance(waypoint, PoseWaypoint) or not waypoint.external:
        return
    result = inverse_kinematics(robot, pose, reference=near)
    if result.status == "solved":
        there = dict(zip(robot.joint_names, result.position.tolist(), strict=True))
        where = ", ".join(f"{shown(name)} at {there[name]:.4g}" for name in waypoint.external)
        yield Remedy(("waypoints", index, "external"), None, f"the waypoint can be reached with {where}")
