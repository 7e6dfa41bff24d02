"""Moves from the pose of the waypoint before: Cartesian, cylindrical and spherical."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.spatial import FloatArray, rotation_y, rotation_z


@dataclass(frozen=True)
class CartesianMove:
    """A move by a translation and a rotation.

    Attributes:
        translation: (x, y, z), m.
        rotation: (3, 3); None keeps the orientation.
    """

    translation: tuple[float, float, float]
    rotation: FloatArray | None = None

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Return rotation (3, 3) and translation (3,) of the move."""
        rotation = np.eye(3) if self.rotation is None else self.rotation
        return rotation, np.array(self.translation)


@dataclass(frozen=True)
class CylindricalMove:
    """A move in cylindrical coordinates, Trans(0, 0, l) Rot(z, alpha) Trans(r, 0, 0): document 001, Section III.A.

    Attributes:
        r: Radius, m.
        alpha: Angle about z, rad.
        l: Height, m.
    """

    r: float
    alpha: float
    l: float  # noqa: E741 - the document's letter, and the contract's

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Return rotation (3, 3) and translation (3,) of the move."""
        rotation = rotation_z(self.alpha)
        return rotation, np.array([0.0, 0.0, self.l]) + self.r * rotation[:, 0]


@dataclass(frozen=True)
class SphericalMove:
    """A move in spherical coordinates, Rot(z, gamma) Rot(y, beta) Trans(0, 0, r): document 001, Section III.A, E15.

    Attributes:
        r: Radius, m.
        beta: Angle from the z axis, rad.
        gamma: Angle about the z axis, rad.
    """

    r: float
    beta: float
    gamma: float

    def transform(self) -> tuple[FloatArray, FloatArray]:
        """Return rotation (3, 3) and translation (3,) of the move."""
        rotation = rotation_z(self.gamma) @ rotation_y(self.beta)
        return rotation, self.r * rotation[:, 2]


Move = CartesianMove | CylindricalMove | SphericalMove
"""Type of a move from the pose of the waypoint before."""
