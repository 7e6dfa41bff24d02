"""The triangles of a mesh, once they are known to be usable, and the distance of a convex shape from it."""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
from numpy.typing import ArrayLike

from planner.shapes.shape import MOST_SIZE, Shape
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


INSIDE_WINDING = 0.5
"""Winding number above which a point is inside a mesh: it is 1 inside and 0 outside."""


def distance_from_mesh(mesh: Mesh, shape: Shape, rotation: FloatArray, translation: FloatArray) -> float:
    """Compute the distance of a shape from a mesh, m, in the mesh's frame; 0 for contact or inside."""
    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(mesh.triangles), 3 * len(mesh.triangles))
    for corners in mesh.triangles:
        surface.addTriangle(*corners)
    surface.endModel()
    at = coal.Transform3s(np.asarray(rotation), np.asarray(translation))
    distance = float(
        coal.distance(
            surface, coal.Transform3s.Identity(), shape.geometry, at, coal.DistanceRequest(), coal.DistanceResult()
        )
    )
    return 0.0 if distance <= 0.0 or winding_number(mesh, np.asarray(translation)) > INSIDE_WINDING else distance


def winding_number(mesh: Mesh, point: FloatArray) -> float:
    """Compute the winding number of a mesh about a point (3,): 1 inside a closed mesh, 0 outside.

    It is the sum of the solid angles of the triangles over 4 pi, of either orientation. See Van Oosterom and Strackee,
    IEEE Transactions on Biomedical Engineering 30, 1983.
    """
    a, b, c = np.moveaxis(mesh.triangles - point, 1, 0)
    lengths = [np.linalg.norm(corner, axis=1) for corner in (a, b, c)]
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    product = lengths[0] * lengths[1] * lengths[2]
    for one, other, length in ((a, b, lengths[2]), (b, c, lengths[0]), (c, a, lengths[1])):
        product += np.einsum("ij,ij->i", one, other) * length
    return abs(float(np.arctan2(volume, product).sum())) / (2.0 * np.pi)
