"""Points of the surfaces of shapes by their formulas, and their projections: independent of the planner.

Cameras are fitted by least squares to points with known positions in space.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.shapes import Box, Capsule, ConvexHull, Cylinder, Shape, Sphere

if TYPE_CHECKING:
    from planner.spatial import FloatArray

POINTS = 6000
"""The number of points on a ball, which leaves less than 3 degrees between neighbours."""

DIRECTIONS = np.column_stack([f(np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)) for f in (np.cos, np.sin)])
"""The directions along which outlines are compared."""


def points_of(shape: Shape) -> FloatArray:
    """Return points (N, 3), m, whose hull is the shape."""
    k = np.arange(POINTS) + 0.5
    height, turn = 1.0 - 2.0 * k / POINTS, np.pi * (1.0 + 5.0**0.5) * k
    ball = np.column_stack([np.sqrt(1.0 - height**2) * np.cos(turn), np.sqrt(1.0 - height**2) * np.sin(turn), height])
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    match shape:
        case Box(size=size):
            signs = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
            return np.array(signs) * size / 2.0
        case Sphere(radius=radius):
            return radius * ball
        case Cylinder(radius=radius, length=length):
            return np.concatenate([radius * ring + [0.0, 0.0, end * length / 2.0] for end in (-1.0, 1.0)])
        case Capsule(radius=radius, length=length):
            return np.concatenate([radius * ball + [0.0, 0.0, end * length / 2.0] for end in (-1.0, 1.0)])
        case ConvexHull(vertices=vertices):
            return vertices
    raise TypeError(shape)


def found_camera(points: FloatArray, seen: FloatArray) -> FloatArray:
    """Find the parallel projection (2, 4) of points (N, 3), m, to points of the picture (N, 2)."""
    rows, *_ = np.linalg.lstsq(np.column_stack([points, np.ones(len(points))]), seen, rcond=None)
    return np.asarray(rows.T)


def seen_by(camera: FloatArray, points: FloatArray) -> FloatArray:
    """Return where a camera sees points (N, 3), m: (N, 2)."""
    return np.asarray(np.column_stack([points, np.ones(len(points))]) @ camera.T)


def assert_same_outline(drawn: FloatArray, truth: FloatArray, within: float) -> None:
    """Assert that the hulls of points (N, 2) reach equally far in all directions.

    Round shapes are drawn with 24 sides: 1.3 % less.
    """
    reach, wanted = ((points @ DIRECTIONS.T).max(axis=0) for points in (drawn, truth))
    size = np.ptp(truth, axis=0).max()
    assert (reach <= wanted + within).all()
    assert (reach >= wanted - within - 0.013 * size).all()
