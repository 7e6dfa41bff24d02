"""Straight lines and circles of the tool as the certificate knows them: geometry of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.certificate.path_parts import PathParts, part_numbers
from planner.spatial import (
    ROTATION_TOLERANCE,
    FloatArray,
    Pose,
    rotation_vector,
    rotation_vectors,
    rotations_from_vectors,
)


@dataclass(frozen=True, eq=False)
class Line:
    """The straight line from pose to pose, where the tool turns about one axis in proportion.

    Attributes:
        start: (3, 3), rotation at the start; None: any orientation will do.
        turns: (2, 3), rad: the rotation vector from it by the share of the way and by its square.
        origin: (3,), m.
        way: (3,), m.
    """

    start: FloatArray | None
    turns: FloatArray
    origin: FloatArray
    way: FloatArray

    @classmethod
    def between(cls, start: Pose, end: Pose) -> Line:
        """Return the line from pose to pose."""
        return cls(*_turns(start, None, end, 0.5), start.position, end.position - start.position)

    @property
    def parts(self) -> PathParts:
        """The line as the one part of a path."""
        numbers = part_numbers(0.0, 1, self.start, self.turns[:1], self.origin, self.way[None])
        return PathParts(numbers[None], self.start is not None, 0.0)

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at fractions (N,) of the line; None: no orientation."""
        return self.origin + u[:, None] * self.way, _turned(self.start, self.turns, u)


@dataclass(frozen=True, eq=False)
class Circle:
    """The circle from pose to pose by way of a third.

    Attributes:
        start: (3, 3), rotation at the start; None: any orientation will do.
        turns: (2, 3), rad: the rotation vector from it by the share of the way and by its square.
        center: (3,), m.
        x: (3,), m, from the center to the start.
        y: (3,), m, as long, where the circle has gone by a quarter.
        end_angle: rad, from 0 to 2 pi.
    """

    start: FloatArray | None
    turns: FloatArray
    center: FloatArray
    x: FloatArray
    y: FloatArray
    end_angle: float

    @classmethod
    def through(cls, start: Pose, via: Pose, end: Pose) -> Circle:
        """Return the circle through three poses."""
        a, b, c = start.position, via.position, end.position
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        # In the plane, and as far from the first point as from the others.
        equations = np.array([normal, b - a, c - a])
        right = [normal @ a, (b @ b - a @ a) / 2.0, (c @ c - a @ a) / 2.0]
        center = np.linalg.solve(equations, right)
        x = a - center
        y = np.cross(normal, x)
        at_via, at_end = _angles_about(center, x, y, np.array([b, c])).tolist()
        return cls(*_turns(start, via, end, at_via / at_end), center, x, y, at_end)

    @property
    def parts(self) -> PathParts:
        """The circle as the one part of a path."""
        spokes = np.array([self.x, self.y])
        numbers = part_numbers(self.end_angle, 2, self.start, self.turns, self.center, spokes)
        return PathParts(numbers[None], self.start is not None, 0.0)

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at fractions (N,) of the arc; None: no orientation."""
        angles = (u * self.end_angle)[:, None]
        return self.center + np.cos(angles) * self.x + np.sin(angles) * self.y, _turned(self.start, self.turns, u)


def _angles_about(center: FloatArray, x: FloatArray, y: FloatArray, points: FloatArray) -> FloatArray:
    """Return angles (N,), rad, from 0 to 2 pi, of points (N, 3) in the plane of x and y."""
    spokes = points - center
    angles: FloatArray = np.arctan2((spokes * y).sum(axis=-1), (spokes * x).sum(axis=-1)) % (2.0 * np.pi)
    return angles


def _turns(start: Pose, via: Pose | None, end: Pose, u: float) -> tuple[FloatArray | None, FloatArray]:
    """Return the start rotation (3, 3) or None, and the turns (2, 3) through a third pose at u."""
    if start.rotation is None or end.rotation is None:
        return None, np.zeros((2, 3))
    whole = rotation_vector(start.rotation.T @ end.rotation)
    if via is None or via.rotation is None:
        return start.rotation, np.array([whole, np.zeros(3)])
    half = rotation_vector(start.rotation.T @ via.rotation)
    rest = start.rotation.T @ via.rotation @ rotation_vector(via.rotation.T @ end.rotation)
    ends = np.array([half, _by_way_of(whole, half + rest)])
    return start.rotation, np.linalg.solve(np.array([[u, u * u], [1.0, 1.0]]), ends)


def _by_way_of(whole: FloatArray, parts: FloatArray) -> FloatArray:
    """Return the rotation vector (3,) of the rotation of `whole` that turns about its axis the way of two `parts`."""
    angle = float(np.linalg.norm(whole))
    if angle <= ROTATION_TOLERANCE or parts @ whole / angle >= angle - np.pi:
        return whole
    return whole / angle * (angle - 2.0 * np.pi)


def _turned(start: FloatArray | None, turns: FloatArray, u: FloatArray) -> FloatArray | None:
    """Return rotations (N, 3, 3) at fractions (N,), from `start` (3, 3) by `turns` (2, 3)."""
    if start is None:
        return None
    rotations: FloatArray = start @ rotations_from_vectors(turns[0] * u[:, None] + turns[1] * (u * u)[:, None])
    return rotations


def angles_of(rotations: FloatArray) -> FloatArray:
    """Return the angles (N,), rad, of rotations (N, 3, 3)."""
    angles: FloatArray = np.linalg.norm(rotation_vectors(rotations), axis=1)
    return angles
