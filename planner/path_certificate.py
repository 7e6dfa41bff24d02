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

STEPS, AHEAD = 2, 1e-4
"""Towards the nearest place on a path, and the step of the difference quotients for that, of the way."""

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
        tolerance = motion.tolerance_position, motion.tolerance_orientation
        end = solved[k].wanted
        due: _Line | _Circle = (
            _Circle(start, motion.via, end) if isinstance(motion, CircularMotion) else _Line(start, end)
        )
        for time, tool in _tool_poses(trajectory, robot, k - 1):
            near = (corners[end] for end in (k - 1, k) if end in corners)
            if any(np.linalg.norm(tool.position - corner) <= radius for corner, radius in near):
                continue
            distance, angle = _deviation(due, tool, tolerance)
            yield _Deviation("path_position_deviation", distance, motion.tolerance_position, time)
            if angle is not None:
                yield _Deviation("path_orientation_deviation", angle, motion.tolerance_orientation, time)


def _tool_poses(trajectory: Trajectory, robot: Robot, segment: int) -> Iterator[tuple[float, Pose]]:
    for piece in np.flatnonzero(trajectory.segments == segment):
        times = trajectory.breakpoints[piece] + np.linspace(0.0, trajectory.lengths[piece], SAMPLES)
        for time, position in zip(times.tolist(), trajectory.evaluate(times, [0])[0], strict=True):
            yield time, tool_pose(robot, position)


def _deviation(due: _Line | _Circle, tool: Pose, tolerance: tuple[float, float]) -> tuple[float, float | None]:
    """Distance (m) and angle (rad) from the place of the path that the tool is nearest to, tolerances as units.

    Found by Gauss and Newton's method from the place that is nearest by position.
    """

    def missed(u: float) -> tuple[FloatArray, FloatArray]:
        position, rotation = due.pose(u)
        turn = np.zeros(3) if rotation is None else _logarithm(rotation, tool.rotation)
        return (position - tool.position) / tolerance[0], turn / tolerance[1]

    u = due.nearest(tool.position)
    for _ in range(STEPS):
        here, ahead = (np.concatenate(missed(at)) for at in (u, u + AHEAD))
        slope = (ahead - here) / AHEAD
        squared = float(slope @ slope)
        if squared == 0.0:
            break
        u = float(np.clip(u - slope @ here / squared, 0.0, 1.0))
    position, turn = missed(u)
    distance = float(np.linalg.norm(position)) * tolerance[0]
    return distance, None if due.pose(u)[1] is None else float(np.linalg.norm(turn)) * tolerance[1]


class _Line:
    """The straight line from pose to pose; the tool turns about one axis in proportion."""

    def __init__(self, start: Pose, end: Pose) -> None:
        self.start, self.way = start, end.position - start.position
        self.turn = None if start.rotation is None or end.rotation is None else _logarithm(start.rotation, end.rotation)

    def nearest(self, point: FloatArray) -> float:
        """Share of the way at which the line is nearest to a point; 0.5 where there is no way."""
        squared = float(self.way @ self.way)
        return float(np.clip((point - self.start.position) @ self.way / squared, 0.0, 1.0)) if squared > 0.0 else 0.5

    def pose(self, u: float) -> tuple[FloatArray, FloatArray | None]:
        """Position and rotation due at a share of the way."""
        position = self.start.position + u * self.way
        if self.turn is None or self.start.rotation is None:
            return position, None
        return position, self.start.rotation @ pin.exp3(u * self.turn)


class _Circle:
    """The circle from pose to pose by way of a third."""

    def __init__(self, start: Pose, via: Pose, end: Pose) -> None:
        a, b, c = start.position, via.position, end.position
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        # In the plane, and as far from the first point as from the others.
        equations = np.array([normal, b - a, c - a])
        right = [normal @ a, (b @ b - a @ a) / 2.0, (c @ c - a @ a) / 2.0]
        self.center = np.linalg.solve(equations, right)
        self.start, self.x = start, a - self.center
        self.y = np.cross(normal, self.x)
        self.end_angle = self._angle_of(c)
        self.turns = None
        if start.rotation is not None and end.rotation is not None:
            whole = _logarithm(start.rotation, end.rotation)
            self.turns = np.array([whole, np.zeros(3)])
            if via.rotation is not None:
                u = self._angle_of(b) / self.end_angle
                half = _logarithm(start.rotation, via.rotation)
                self.turns = np.linalg.solve(np.array([[u, u * u], [1.0, 1.0]]), np.array([half, whole]))

    def nearest(self, point: FloatArray) -> float:
        """Share of the way at which the arc is nearest to a point."""
        angle = self._angle_of(point)
        if angle > self.end_angle:  # beyond the arc: nearer to its end, or to its start
            angle = self.end_angle if angle < (self.end_angle + 2.0 * np.pi) / 2.0 else 0.0
        return angle / self.end_angle

    def pose(self, u: float) -> tuple[FloatArray, FloatArray | None]:
        """Position and rotation due at a share of the way."""
        angle = u * self.end_angle
        position = self.center + np.cos(angle) * self.x + np.sin(angle) * self.y
        if self.turns is None or self.start.rotation is None:
            return position, None
        return position, self.start.rotation @ pin.exp3(self.turns[0] * u + self.turns[1] * u * u)

    def _angle_of(self, point: FloatArray) -> float:
        spoke = point - self.center
        return float(np.arctan2(spoke @ self.y, spoke @ self.x)) % (2.0 * np.pi)


def _logarithm(start: FloatArray | None, end: FloatArray | None) -> FloatArray:
    assert start is not None  # noqa: S101 - asked only where there are rotations
    assert end is not None  # noqa: S101
    return np.asarray(pin.log3(start.T @ end))
