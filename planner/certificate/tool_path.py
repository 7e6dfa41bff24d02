"""The check of the tool's path: it keeps to its lines and circles, and near the corners that it cuts.

The poses of the tool are sampled. With the paths this check shares forward kinematics, which have tests against other
implementations; the geometry of lines, circles and corners is its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from planner.certificate.checks import Check
from planner.kinematics.forward import tool_pose, tool_poses
from planner.problem import BlendTransition, CircularMotion, JointMotion

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose
    from planner.trajectory import Trajectory
    from planner.waypoints.solve import SolvedWaypoint

STEPS = 2
"""Number of Gauss-Newton steps towards the nearest point on a path."""

AHEAD = 1e-4
"""Step of the difference quotients for that, as a share of the path."""

LEAST_SINE = 1e-6
"""Least sine of an angle by the angle: near half a turn a rotation hardly tells its axis; for first guesses only."""

SAMPLES = 9
"""Number of samples of each piece, both ends included: a piece is a quintic, whose error is largest in the middle."""


class _Deviation(NamedTuple):
    """The deviation of a sample from the path that is asked.

    Attributes:
        quantity: Name of the check that it belongs to.
        value: The deviation, m or rad.
        limit: The largest deviation allowed, m or rad.
        time: The time of the sample, s.
    """

    quantity: str
    value: float
    limit: float
    time: float


def certify_tool_path(
    trajectory: Trajectory, robot: Robot, waypoints: Sequence[AnyWaypoint], solved: Sequence[SolvedWaypoint]
) -> list[Check]:
    """Find the worst deviation from the lines and circles asked, and the largest distance from blended corners.

    Within the radius of a blend the tool may leave its line or circle; at the middle of the blend, where it passes the
    waypoint, it has to be within the radius.

    Args:
        trajectory: The trajectory to be checked.
        robot: The robot, with its tool.
        waypoints: The waypoints as they are asked.
        solved: The solved waypoints, with their poses.
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
    """The worst deviations on each segment whose tool path is asked, and at each blend."""
    corners = {}
    for k, waypoint in enumerate(waypoints):
        if isinstance(waypoint.transition, BlendTransition):
            corners[k] = solved[k].pose.position, waypoint.transition.radius
            time = float(trajectory.arrivals[k])
            tool = tool_pose(robot, trajectory.evaluate(np.array([time]), [0])[0][0])
            distance = float(np.linalg.norm(tool.position - solved[k].pose.position))
            yield _Deviation("blend_deviation", distance, waypoint.transition.radius, time)
    with_tool = [k - 1 for k, waypoint in enumerate(waypoints) if k and not isinstance(waypoint.motion, JointMotion)]
    segments, *sampled = _tool_poses(trajectory, robot, with_tool)
    for k, waypoint in enumerate(waypoints[1:], 1):
        motion = waypoint.motion
        if isinstance(motion, JointMotion):
            continue
        start = solved[k - 1].wanted if solved[k - 1].wanted.rotation is not None else solved[k - 1].pose
        tolerance = motion.tolerance_position, motion.tolerance_orientation
        end = solved[k].wanted
        path: _Line | _Circle = (
            _Circle(start, motion.via, end) if isinstance(motion, CircularMotion) else _Line(start, end)
        )
        times, positions, rotations = (samples[segments == k - 1] for samples in sampled)
        for position, radius in (corners[end] for end in (k - 1, k) if end in corners):
            away = np.linalg.norm(positions - position, axis=1) > radius
            times, positions, rotations = times[away], positions[away], rotations[away]
        if not len(times):
            continue
        distances, angles = _distances(path, positions, rotations, tolerance)
        worst = int(np.argmax(distances))
        yield _Deviation(
            "path_position_deviation", float(distances[worst]), motion.tolerance_position, float(times[worst])
        )
        if angles is not None:
            worst = int(np.argmax(angles))
            yield _Deviation(
                "path_orientation_deviation", float(angles[worst]), motion.tolerance_orientation, float(times[worst])
            )


def _tool_poses(
    trajectory: Trajectory, robot: Robot, segments: Sequence[int]
) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray]:
    """Sample all pieces: segments (N,), times (N,), s, and the tool's positions (N, 3), m, and rotations (N, 3, 3)."""
    pieces = np.flatnonzero(np.isin(trajectory.segments, segments))
    starts, lengths = trajectory.breakpoints[pieces], trajectory.lengths[pieces]
    times = (starts[:, None] + np.linspace(0.0, 1.0, SAMPLES) * lengths[:, None]).ravel()
    of_samples = np.repeat(trajectory.segments[pieces], SAMPLES)
    return of_samples, times, *tool_poses(robot, trajectory.evaluate(times, [0])[0])


def _distances(
    path: _Line | _Circle, positions: FloatArray, rotations: FloatArray, tolerance: tuple[float, float]
) -> tuple[FloatArray, FloatArray | None]:
    """Distances (N,), m, and angles (N,), rad, of the tool from the points of its path that are nearest by tolerances.

    Gauss and Newton's method finds these points, from those that are nearest by position.
    """

    def missed(u: FloatArray) -> FloatArray:
        """The deviations (N, 3 or 6) of the tool from the path at shares (N,) of it, by their tolerances."""
        position, rotation = path.poses(u)
        parts = [(position - positions) / tolerance[0]]
        if rotation is not None:
            parts.append(_logarithms(rotation.transpose(0, 2, 1) @ rotations) / tolerance[1])
        return np.hstack(parts)

    u = path.nearest(positions)
    for _ in range(STEPS):
        here, ahead = missed(u), missed(u + AHEAD)
        slope = (ahead - here) / AHEAD
        squared = (slope**2).sum(axis=1)
        step = (slope * here).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
        u = np.where(squared > 0.0, np.clip(u - step, 0.0, 1.0), u)
    position, rotation = path.poses(u)
    distances: FloatArray = np.linalg.norm(position - positions, axis=1)
    return distances, None if rotation is None else _angles(rotation.transpose(0, 2, 1) @ rotations)


class _Line:
    """The straight line from pose to pose; the tool turns about one axis in proportion."""

    def __init__(self, start: Pose, end: Pose) -> None:
        self.start, self.way = start, end.position - start.position
        self.turn = None if start.rotation is None or end.rotation is None else _logarithm(start.rotation, end.rotation)

    def nearest(self, points: FloatArray) -> FloatArray:
        """Shares (N,) of the way at which the line is nearest to points (N, 3); 0.5 where there is no way."""
        squared = float(self.way @ self.way)
        if squared == 0.0:
            return np.full(len(points), 0.5)
        return np.clip((points - self.start.position) @ self.way / squared, 0.0, 1.0)

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Positions (N, 3), m, and rotations (N, 3, 3) at shares (N,) of the way; None: none is asked."""
        positions = self.start.position + u[:, None] * self.way
        if self.turn is None or self.start.rotation is None:
            return positions, None
        return positions, self.start.rotation @ _rotations(u[:, None] * self.turn)


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
        self.end_angle = float(self._angles_of(c))
        self.turns = None
        if start.rotation is not None and end.rotation is not None:
            whole = _logarithm(start.rotation, end.rotation)
            self.turns = np.array([whole, np.zeros(3)])
            if via.rotation is not None:
                u = float(self._angles_of(b)) / self.end_angle
                half = _logarithm(start.rotation, via.rotation)
                self.turns = np.linalg.solve(np.array([[u, u * u], [1.0, 1.0]]), np.array([half, whole]))

    def nearest(self, points: FloatArray) -> FloatArray:
        """Shares (N,) of the way at which the arc is nearest to points (N, 3)."""
        angles = self._angles_of(points)
        # Beyond the arc: nearer to its end, or to its start.
        end = np.where(angles < (self.end_angle + 2.0 * np.pi) / 2.0, self.end_angle, 0.0)
        nearest: FloatArray = np.where(angles > self.end_angle, end, angles) / self.end_angle
        return nearest

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Positions (N, 3), m, and rotations (N, 3, 3) at shares (N,) of the way; None: none is asked."""
        u = u[:, None]
        angles = u * self.end_angle
        positions = self.center + np.cos(angles) * self.x + np.sin(angles) * self.y
        if self.turns is None or self.start.rotation is None:
            return positions, None
        return positions, self.start.rotation @ _rotations(self.turns[0] * u + self.turns[1] * u * u)

    def _angles_of(self, points: FloatArray) -> FloatArray:
        """Angles (N,), rad in [0, 2 pi), from the start about the centre, of points (N, 3)."""
        spokes = points - self.center
        angles: FloatArray = np.arctan2(spokes @ self.y, spokes @ self.x) % (2.0 * np.pi)
        return angles


def _logarithm(start: FloatArray | None, end: FloatArray | None) -> FloatArray:
    """The rotation vector (3,), rad, that leads from one rotation (3, 3) to another, in the axes of the first."""
    assert start is not None  # noqa: S101 - asked only where there are rotations
    assert end is not None  # noqa: S101
    return np.asarray(pin.log3(start.T @ end))


def _axial(rotations: FloatArray) -> FloatArray:
    """Axes (N, 3) of rotations (N, 3, 3), as long as the sines of their angles."""
    skew = (rotations - rotations.transpose(0, 2, 1)) / 2.0
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)


def _angles(rotations: FloatArray) -> FloatArray:
    """Angles (N,), rad, of rotations (N, 3, 3)."""
    cosines = (np.trace(rotations, axis1=1, axis2=2) - 1.0) / 2.0
    angles: FloatArray = np.arctan2(np.linalg.norm(_axial(rotations), axis=1), cosines)
    return angles


def _logarithms(rotations: FloatArray) -> FloatArray:
    """Rotation vectors (N, 3) of rotations (N, 3, 3) by less than half a turn."""
    vectors: FloatArray = _axial(rotations) / np.maximum(np.sinc(_angles(rotations) / np.pi), LEAST_SINE)[:, None]
    return vectors


def _rotations(vectors: FloatArray) -> FloatArray:
    """Rotations (N, 3, 3) by vectors (N, 3): Rodrigues' formula."""
    x, y, z = vectors.T
    none = np.zeros_like(x)
    skew = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    angles = np.linalg.norm(vectors, axis=1)[:, None, None]
    rotations: FloatArray = (
        np.eye(3) + np.sinc(angles / np.pi) * skew + 0.5 * np.sinc(angles / (2.0 * np.pi)) ** 2 * skew @ skew
    )
    return rotations
