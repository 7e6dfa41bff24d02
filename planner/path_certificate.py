"""The check of where the tool goes: on its lines and circles, and near the corners it cuts.

Sampled, by forward kinematics of the trajectory and by geometry of its own: it shares no code with the paths.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from planner.certificate import Check
from planner.kinematics.forward import tool_pose
from planner.problem import BlendTransition, CircularMotion, JointMotion

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.kinematics.poses import FloatArray, Pose
    from planner.kinematics.sequence import SolvedWaypoint
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.trajectory import Trajectory

SAMPLES = 9
"""On each piece, both ends included; what lies between two knots is a quintic, whose error is largest in the middle."""


class _Deviation(NamedTuple):
    """How far a sample is from where it should be.

    Attributes:
        quantity: Of the check.
        value: m or rad.
        limit: m or rad.
        time: s.
    """

    quantity: str
    value: float
    limit: float
    time: float


def certify_tool_path(
    trajectory: Trajectory, robot: Robot, waypoints: Sequence[AnyWaypoint], solved: Sequence[SolvedWaypoint]
) -> list[Check]:
    """The worst deviation from the lines and circles asked, and the largest distance from corners that are blended.

    Within the radius of a blend the tool may leave its line or circle; at the middle of the blend, where it passes the
    waypoint, it has to be within the radius.

    Args:
        trajectory: To be checked.
        robot: With its tool.
        waypoints: As asked.
        solved: The same, with their poses.
    """
    worst: dict[str, _Deviation] = {}
    for deviation in _deviations(trajectory, robot, waypoints, solved):
        known = worst.get(deviation.quantity)
        if known is None or deviation.value / deviation.limit > known.value / known.limit:
            worst[deviation.quantity] = deviation
    return [
        Check(
            quantity=quantity,
            joint=None,
            peak=deviation.value,
            limit=deviation.limit,
            ratio=deviation.value / deviation.limit,
            time=deviation.time,
            method="sampled",
            enforced=True,
            bounded=True,
        )
        for quantity, deviation in sorted(worst.items(), reverse=True)
    ]


def _deviations(
    trajectory: Trajectory, robot: Robot, waypoints: Sequence[AnyWaypoint], solved: Sequence[SolvedWaypoint]
) -> Iterator[_Deviation]:
    corners = {}
    for k, waypoint in enumerate(waypoints):
        if isinstance(waypoint.transition, BlendTransition):
            corners[k] = solved[k].pose.position, waypoint.transition.radius
            time = float(trajectory.arrivals[k])
            tool = tool_pose(robot, trajectory.evaluate(np.array([time]), [0])[0][0])
            distance = float(np.linalg.norm(tool.position - solved[k].pose.position))
            yield _Deviation("blend_deviation", distance, waypoint.transition.radius, time)
    for k, waypoint in enumerate(waypoints[1:], 1):
        motion = waypoint.motion
        if isinstance(motion, JointMotion):
            continue
        start = solved[k - 1].wanted if solved[k - 1].wanted.rotation is not None else solved[k - 1].pose
        due = _Circle(start, motion.via, solved[k].wanted) if isinstance(motion, CircularMotion) else None
        line = _Line(start, solved[k].wanted)
        for time, tool in _tool_poses(trajectory, robot, k - 1):
            near = (corners[end] for end in (k - 1, k) if end in corners)
            if any(np.linalg.norm(tool.position - corner) <= radius for corner, radius in near):
                continue
            distance, angle = (due or line).deviation(tool)
            yield _Deviation("path_position_deviation", distance, motion.tolerance_position, time)
            if angle is not None:
                yield _Deviation("path_orientation_deviation", angle, motion.tolerance_orientation, time)


def _tool_poses(trajectory: Trajectory, robot: Robot, segment: int) -> Iterator[tuple[float, Pose]]:
    for piece in np.flatnonzero(trajectory.segments == segment):
        times = trajectory.breakpoints[piece] + np.linspace(0.0, trajectory.lengths[piece], SAMPLES)
        for time, position in zip(times.tolist(), trajectory.evaluate(times, [0])[0], strict=True):
            yield time, tool_pose(robot, position)


class _Line:
    """The straight line from pose to pose; the tool turns about one axis in proportion."""

    def __init__(self, start: Pose, end: Pose) -> None:
        self.start, self.way = start, end.position - start.position
        self.squared = float(self.way @ self.way)
        self.turn = None if start.rotation is None or end.rotation is None else _logarithm(start.rotation, end.rotation)

    def deviation(self, tool: Pose) -> tuple[float, float | None]:
        """Distance (m) from the line, and angle (rad) from the orientation due at the nearest place on it."""
        offset = tool.position - self.start.position
        turned = None if self.turn is None else _logarithm(self.start.rotation, tool.rotation)
        if self.squared > 0.0:
            share = float(np.clip(offset @ self.way / self.squared, 0.0, 1.0))
        elif turned is not None and self.turn is not None and np.any(self.turn):
            share = float(np.clip(turned @ self.turn / (self.turn @ self.turn), 0.0, 1.0))
        else:
            share = 0.0
        distance = float(np.linalg.norm(offset - share * self.way))
        if self.turn is None:
            return distance, None
        return distance, _angle(self.start.rotation, share * self.turn, tool.rotation)


class _Circle:
    """The circle from pose to pose by way of a third."""

    def __init__(self, start: Pose, via: Pose, end: Pose) -> None:
        a, b, c = start.position, via.position, end.position
        normal = np.cross(b - a, c - a)
        self.normal = normal / np.linalg.norm(normal)
        # In the plane, and as far from the first point as from the others.
        equations = np.array([self.normal, b - a, c - a])
        right = [self.normal @ a, (b @ b - a @ a) / 2.0, (c @ c - a @ a) / 2.0]
        self.center = np.linalg.solve(equations, right)
        self.radius = float(np.linalg.norm(a - self.center))
        self.start = start
        self.x = (a - self.center) / self.radius
        self.y = np.cross(self.normal, self.x)
        self.end_angle, at_via = self._angle_of(c), self._angle_of(b)
        self.turns = None
        if start.rotation is not None and end.rotation is not None:
            whole = _logarithm(start.rotation, end.rotation)
            self.turns = (whole, np.zeros(3))
            if via.rotation is not None:
                u = at_via / self.end_angle
                system = np.array([[u, u * u], [1.0, 1.0]])
                first, second = np.linalg.solve(system, np.array([_logarithm(start.rotation, via.rotation), whole]))
                self.turns = (first, second)

    def deviation(self, tool: Pose) -> tuple[float, float | None]:
        """Distance (m) from the arc, and angle (rad) from the orientation due at the nearest place on it."""
        angle = self._angle_of(tool.position)
        if angle > self.end_angle:  # beyond the arc: nearer to its end, or to its start
            angle = self.end_angle if angle < (self.end_angle + 2.0 * np.pi) / 2.0 else 0.0
        nearest = self.center + self.radius * (np.cos(angle) * self.x + np.sin(angle) * self.y)
        distance = float(np.linalg.norm(tool.position - nearest))
        if self.turns is None:
            return distance, None
        u = angle / self.end_angle
        return distance, _angle(self.start.rotation, self.turns[0] * u + self.turns[1] * u * u, tool.rotation)

    def _angle_of(self, point: FloatArray) -> float:
        spoke = point - self.center
        return float(np.arctan2(spoke @ self.y, spoke @ self.x)) % (2.0 * np.pi)


def _logarithm(start: FloatArray | None, end: FloatArray | None) -> FloatArray:
    assert start is not None  # noqa: S101 - asked only where there are rotations
    assert end is not None  # noqa: S101
    return np.asarray(pin.log3(start.T @ end))


def _angle(start: FloatArray | None, turn: FloatArray, reached: FloatArray | None) -> float:
    assert start is not None  # noqa: S101 - asked only where there are rotations
    return float(np.linalg.norm(_logarithm(start @ pin.exp3(turn), reached)))
