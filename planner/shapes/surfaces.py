"""The surfaces of shapes as triangles, to be looked at."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.shapes.hulls import ConvexHull
from planner.shapes.primitives import Box, Capsule, Cylinder, Sphere
from planner.shapes.shape import Shape
from planner.spatial import FloatArray

SEGMENTS = 24
"""Number of sides of a drawn circle; their middles are 1 % of the radius inside."""

KEPT_SURFACES = 128
"""The largest number of shapes whose surfaces a process keeps; carried objects are drawn at every waypoint."""


class Surface(NamedTuple):
    """Triangles with common corners, around something convex or of a mesh.

    Attributes:
        vertices: The corners (N, 3), m.
        faces: The triangles (F, 3) by the numbers of their corners, counterclockwise seen from outside.
    """

    vertices: FloatArray
    faces: np.ndarray


@lru_cache(maxsize=KEPT_SURFACES)
def surface(shape: Shape) -> Surface:
    """Return the surface of a shape in its frame, with so many sides where it is round.

    Raises:
        TypeError: The shape has no end, as a half space.
    """
    turn = 2.0 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(SEGMENTS)])
    match shape:
        case ConvexHull():
            return Surface(shape.vertices, shape.faces)
        case Box(size=size):
            return surface_around(np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T * size)
        case Cylinder(radius=radius, length=length):
            ends = [radius * ring + np.array([0.0, 0.0, end * length]) for end in (-0.5, 0.5)]
            return surface_around(np.concatenate(ends))
        case Sphere(radius=radius):
            return surface_around(_ball(radius, ring))
        case Capsule(radius=radius, length=length):
            ball = _ball(radius, ring)
            return surface_around(ball + 0.5 * length * np.sign(ball[:, 2:]) * np.array([0.0, 0.0, 1.0]))
    raise TypeError(f"a {type(shape).__name__} has no surface that ends")


def surface_around(points: FloatArray) -> Surface:
    """Compute the surface of the hull of points (N, 3), m, of any size and place.

    A flat hull gets a thickness of 1e-4 of its extent.

    Raises:
        InvalidShape: There are fewer than four points, or they have no hull that can be computed.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle, extent = 0.5 * (low + high), max(float((high - low).max()), np.finfo(float).tiny)
    hull = ConvexHull((points - middle) / extent)
    vertices = middle + extent * hull.vertices
    vertices.flags.writeable = False
    return Surface(vertices, hull.faces)


def _ball(radius: float, ring: FloatArray) -> FloatArray:
    """Return points of a ball on circles of latitude, none of them on the equator."""
    latitudes = (np.arange(SEGMENTS // 2) + 0.5) * np.pi / (SEGMENTS // 2) - np.pi / 2.0
    circles = [np.cos(angle) * ring + np.array([0.0, 0.0, np.sin(angle)]) for angle in latitudes]
    return radius * np.concatenate([*circles, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]])
