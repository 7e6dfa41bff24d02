"""The triangles of a mesh, once they are known to be usable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from planner.shapes.shape import MOST_SIZE
from planner.spatial import FloatArray

MAX_BYTES = 2**24
"""Largest size of a file, bytes: 335,000 triangles of a binary STL; the finest published robots have 45,000."""

MAX_TRIANGLES = 200_000
"""Number of triangles that a mesh may have."""


class InvalidMesh(ValueError):
    """A file that is no usable mesh; the message says why."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface of triangles.

    Attributes:
        triangles: Their corners (T, 3, 3), m, all finite.
    """

    triangles: FloatArray

    @classmethod
    def checked(cls, triangles: ArrayLike) -> Mesh:
        """Make a mesh of triangles (T, 3, 3) from a file.

        Raises:
            InvalidMesh: There are none or too many, or one has a corner that is no point of a cell.
        """
        corners = np.asarray(triangles, dtype=np.float64)
        check_count(len(corners))
        if not np.isfinite(corners).all():
            raise InvalidMesh("a corner of a triangle is not finite")
        _check_extent(corners)
        return cls(corners)

    def scaled(self, scale: FloatArray) -> Mesh:
        """Return the mesh with its x, y and z multiplied by factors (3,).

        Raises:
            InvalidMesh: It is too large then.
        """
        corners = self.triangles * scale
        _check_extent(corners)
        return Mesh(corners)

    @property
    def size(self) -> FloatArray:
        """Lengths of the sides of the box around it (3,), m."""
        corners = self.triangles.reshape(-1, 3)
        size: FloatArray = corners.max(axis=0) - corners.min(axis=0)
        return size

    @property
    def volume(self) -> float:
        """The volume that a closed mesh has, m^3: the sum of the tetrahedra over its triangles."""
        corners = self.triangles - self.triangles.reshape(-1, 3).mean(axis=0)
        products = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        return abs(float(products.sum())) / 6.0


def check_count(count: int) -> None:
    """Refuse a number of triangles before they are made.

    Raises:
        InvalidMesh: There are none, or too many.
    """
    if count < 1:
        raise InvalidMesh("it has no triangle")
    if count > MAX_TRIANGLES:
        raise InvalidMesh(f"it has {count} triangles, more than {MAX_TRIANGLES}")


def _check_extent(corners: FloatArray) -> None:
    largest = float(np.abs(corners).max())
    if not largest <= MOST_SIZE:
        raise InvalidMesh(f"a corner of a triangle is {largest:g} m from the origin, more than {MOST_SIZE:g}")
