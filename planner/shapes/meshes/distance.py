"""The distance of a convex shape from a mesh itself, where its convex pieces are coarser."""

from __future__ import annotations

import coal
import numpy as np

from planner.shapes.meshes.mesh import Mesh
from planner.shapes.shape import Shape
from planner.spatial import FloatArray

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
