"""Paths of the tool: a straight line, a circle. Poses as functions of u, from 0 at the start to 1 at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
import pinocchio as pin

from planner.kinematics.search import pose_errors
from planner.kinematics.turns import TURN
from planner.spatial import ROTATION_TOLERANCE, FloatArray, Pose, rotation_vector
from planner.tolerances import POSITION_TOLERANCE

COLLINEAR = 1e-6
"""Three points whose triangle has a height below this share of its longest side lie on a line."""


UNUSED_ORIENTATION = "an orientation is given on the way to a waypoint without one"
"""Message about the orientation of a pose on a path whose end has no orientation."""


class NoPath(ValueError):
    """A motion of the tool through whose poses there is no path.

    Attributes:
        field: Which field of the motion is at fault.
    """

    def __init__(self, message: str, *field: str | int) -> None:
        super().__init__(message)
        self.field = field


class PosePath(Protocol):
    """The poses that the tool takes, C2 in u; its speed along u is constant, the linear one or else the angular one."""

    @property
    def breakpoints(self) -> FloatArray:
        """The parameters (pieces + 1,), from 0 to 1, between which the path is smooth."""
        ...

    def pose(self, u: float) -> Pose:
        """Return the pose at u; without a rotation where any orientation will do."""
        ...

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u, in the base's axes; (3,) without a rotation."""
        ...


class PiecedPath(PosePath, Protocol):
    """A path of the tool whose poses and twists are computed for many parameters at once."""

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,); None: none is given."""
        ...

    def twists(self, u: FloatArray) -> FloatArray:
        """Return the linear over the angular velocities (N, 6) by u at parameters (N,); (N, 3) without a rotation."""
        ...

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        positions, rotations = self.poses(np.array([u]))
        return Pose(positions[0], None if rotations is None else rotations[0])

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u; (3,) without a rotation."""
        (twist,) = self.twists(np.array([u]))
        return np.asarray(twist)


ONE_PIECE = np.array([0.0, 1.0])
"""The breakpoints, without unit, of a path that is smooth from end to end."""


@dataclass(frozen=True, eq=False)
class Turn:
    """A rotation that changes from R(0) = `start` as R(u) = start exp(w(u)), w(u) = first u + second u^2.

    Attributes:
        start: (3, 3).
        first: (3,), rad.
        second: (3,), rad; zero for the rotation about one axis at constant speed.
    """

    start: FloatArray
    first: FloatArray
    second: FloatArray

    @classmethod
    def between(cls, start: FloatArray, end: FloatArray) -> Turn:
        """Return the shortest rotation: about one axis (document 004, axis and angle of R = R0^T R1)."""
        return cls(start, rotation_vector(start.T @ end), np.zeros(3))

    @classmethod
    def by_way_of(cls, start: FloatArray, via: FloatArray, end: FloatArray, u: float) -> Turn:
        """Build the smooth turn to `via` at `u` and on to the end, each the way of the shortest rotation."""
        to_via, whole = start.T @ via, rotation_vector(start.T @ end)
        half, angle = rotation_vector(to_via), float(np.linalg.norm(whole))
        if angle > ROTATION_TOLERANCE:
            both = half + to_via @ rotation_vector(via.T @ end)
            other = whole * (1.0 - TURN / angle)
            whole = min(whole, other, key=lambda turn: float(np.linalg.norm(both - turn)))
        second = (half - u * whole) / (u * u - u)
        return cls(start, whole - second, second)

    def rotation(self, u: float) -> FloatArray:
        """Return the rotation (3, 3) at u."""
        result: FloatArray = self.start @ pin.exp3(self.first * u + self.second * u * u)
        return result

    def velocity(self, u: float) -> FloatArray:
        """Return the angular velocity (3,), rad by u, in the base's axes."""
        w, rate = self.first * u + self.second * u * u, self.first + 2.0 * u * self.second
        result: FloatArray = self.start @ pin.exp3(w) @ (pin.Jexp3(w) @ rate)
        return result


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line with the shortest rotation (document 004, Section 7).

    Attributes:
        start: The first pose.
        end: The last. Without a rotation in both, any orientation will do on the way.
    """

    start: Pose
    end: Pose

    @property
    def breakpoints(self) -> FloatArray:
        """The ends of the path, which is smooth between them."""
        return ONE_PIECE

    @cached_property
    def turn(self) -> Turn | None:
        """The turn of the tool; None: any orientation will do."""
        if self.start.rotation is None or self.end.rotation is None:
            return None
        return Turn.between(self.start.rotation, self.end.rotation)

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        position = self.start.position + u * (self.end.position - self.start.position)
        return Pose(position, None if self.turn is None else self.turn.rotation(u))

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u; (3,) without a rotation."""
        linear = self.end.position - self.start.position
        return linear if self.turn is None else np.concatenate([linear, self.turn.velocity(u)])


@dataclass(frozen=True, eq=False)
class Reversed:
    """A path from its end to its start.

    Attributes:
        path: The path forwards.
    """

    path: PosePath

    @property
    def breakpoints(self) -> FloatArray:
        """The breakpoints of the path, counted from its end."""
        return 1.0 - self.path.breakpoints[::-1]

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        return self.path.pose(1.0 - u)

    def twist(self, u: float) -> FloatArray:
        """Return the twist per unit of u, (3,) or (6,)."""
        return -self.path.twist(1.0 - u)


@dataclass(frozen=True, eq=False)
class Arc:
    """The arc of a circle from one position to another by way of a third.

    Attributes:
        center: (3,), m.
        axis: (3,), unit: the tool goes around it counter-clockwise.
        angle: rad, in (0, 2 pi), from the start to the end.
        start: (3,), m.
        turn: The turn of the tool; None: any orientation will do.
    """

    center: FloatArray
    axis: FloatArray
    angle: float
    start: FloatArray
    turn: Turn | None

    @classmethod
    def through(cls, start: Pose, via: Pose, end: Pose) -> Arc:
        """Return the arc through three poses.

        A rotation in `via` is passed there; else the tool turns by the shortest rotation from start to end.

        Raises:
            NoPath: The three positions lie on a line, or two are the same: there is no one circle. Or `via` has a
                rotation, and an end leaves it open.
        """
        if via.rotation is not None and (start.rotation is None or end.rotation is None):
            raise NoPath(UNUSED_ORIENTATION, "via", "orientation")
        a, b = via.position - start.position, end.position - start.position
        normal = np.cross(a, b)
        area = float(np.linalg.norm(normal))
        longest = max(np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(a - b))
        if area <= COLLINEAR * longest**2:
            message = "start, via and end lie on a line, or two of them are the same: no one circle goes there"
            raise NoPath(message, "via")
        offset = (np.dot(a, a) * np.cross(b, normal) - np.dot(b, b) * np.cross(a, normal)) / (2.0 * area**2)
        center = start.position + offset
        axis = normal / area
        at_via, at_end = (_angle(-offset, point - center, axis) for point in (via.position, end.position))
        turn = None
        if start.rotation is not None and end.rotation is not None:
            turn = Turn.between(start.rotation, end.rotation)
            if via.rotation is not None:
                turn = Turn.by_way_of(start.rotation, via.rotation, end.rotation, at_via / at_end)
        return cls(center, axis, at_end, start.position, turn)

    @property
    def breakpoints(self) -> FloatArray:
        """The ends of the path, which is smooth between them."""
        return ONE_PIECE

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        return Pose(self.center + self._spoke(u), None if self.turn is None else self.turn.rotation(u))

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u; (3,) without a rotation."""
        linear: FloatArray = self.angle * np.cross(self.axis, self._spoke(u))
        return linear if self.turn is None else np.concatenate([linear, self.turn.velocity(u)])

    def _spoke(self, u: float) -> FloatArray:
        spoke: FloatArray = pin.exp3(self.axis * (self.angle * u)) @ (self.start - self.center)
        return spoke


def _angle(start: FloatArray, end: FloatArray, axis: FloatArray) -> float:
    """Return the angle in (0, 2 pi), rad, from one spoke to another about the axis."""
    angle = float(np.arctan2(np.dot(axis, np.cross(start, end)), np.dot(start, end)))
    return angle if angle > 0.0 else angle + 2.0 * np.pi


LEAST_POSE_DISTANCE = 1e-6
"""Distance of two different poses, m, relative to the whole path.

Closer ones, with the tool turned, would make it turn on the spot.
"""


class ViaPoses(NamedTuple):
    """Two or more poses, no two neighbours of which are at one position.

    Attributes:
        positions: (N, 3), m.
        rotations: (N, 3, 3); None: any orientation will do.
        indices: (N,), of each among the poses of the motion; -1: the start; their number: the end.
    """

    positions: FloatArray
    rotations: FloatArray | None
    indices: np.ndarray

    @property
    def lengths(self) -> FloatArray:
        """The distances (N - 1,) from each to the next, m."""
        lengths: FloatArray = np.linalg.norm(np.diff(self.positions, axis=0), axis=1)
        return lengths


def via_poses(start: Pose, between: Sequence[Pose], end: Pose) -> ViaPoses:
    """List the poses of a motion.

    The rotation of a pose without one is interpolated on the shortest turn between the nearest poses with a rotation,
    by length of the path.

    Args:
        start: The pose of the waypoint before.
        between: The poses of the motion.
        end: The pose of the waypoint that it leads to. Without a rotation in both, any orientation will do.

    Raises:
        NoPath: A pose has a rotation but the end has none, the tool would turn on the spot, or the path has no length.
    """
    is_open = start.rotation is None or end.rotation is None
    for k, pose in enumerate(between):
        if is_open and pose.rotation is not None:
            raise NoPath(UNUSED_ORIENTATION, "poses", k)
    if is_open:
        start, end = Pose(start.position), Pose(end.position)
    kept, indices = [start], [-1]
    for k, pose in enumerate((*between, end)):
        distance, angle = pose_errors(pose, kept[-1])
        if max(distance, angle or 0.0) > POSITION_TOLERANCE:
            kept.append(pose)
            indices.append(k)
        elif kept[-1].rotation is None:
            kept[-1] = pose
    positions = np.array([pose.position for pose in kept])
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    for k in np.flatnonzero(lengths <= LEAST_POSE_DISTANCE * lengths.sum()).tolist():
        message = "the tool would have to turn where it is: leave this pose out, or make it a waypoint"
        raise NoPath(message, "poses", min(indices[k + 1], len(between) - 1))
    if len(kept) < 2:
        raise NoPath("all poses are equal to the poses of the waypoints at its ends", "poses")
    rotations = None if is_open else _filled([pose.rotation for pose in kept], lengths)
    return ViaPoses(positions, rotations, np.array(indices))


def _filled(rotations: Sequence[FloatArray | None], lengths: FloatArray) -> FloatArray:
    """Interpolate missing rotations (N, 3, 3) between known ones; the first and the last are known."""
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    known = [k for k, rotation in enumerate(rotations) if rotation is not None]
    filled = [np.asarray(rotations[0])]
    for first, last in pairwise(known):
        turn = Turn.between(filled[-1], np.asarray(rotations[last]))
        shares = (at[first + 1 : last] - at[first]) / (at[last] - at[first])
        filled += [*map(turn.rotation, shares.tolist()), np.asarray(rotations[last])]
    return np.array(filled)


def stands_still(path: PosePath) -> bool:
    """Tell whether a line has no length, and the tool does not turn on it."""
    if not isinstance(path, Line):
        return False
    distance, angle = pose_errors(path.pose(0.0), path.pose(1.0))
    return max(distance, angle or 0.0) <= POSITION_TOLERANCE
