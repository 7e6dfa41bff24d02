"""Balls inside of convex shapes, and how near points are to shapes at most: what proves that things collide.

A ball inside of the one shape whose center is nearer than its radius to the other one shows that the two overlap,
whatever an algorithm for distances says of them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.scene.bodies import bounding_capsule
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere

if TYPE_CHECKING:
    from planner.shapes import Shape
    from planner.spatial import FloatArray

TRIED = 6000
"""The number of points of a shape that are tried as centers of balls: every 8 mm or so of a link's piece."""

LEAST_SHARE = 0.4
"""The least radius of a ball, as a share of the largest one in its shape: thinner ones block hardly anything."""

LEFT_OUT = 0.04
"""How far a ball may be beyond another one to be left out, as a share of the largest radius: some 2 mm."""

AT_ONCE = 16
"""The number of faces of a hull that points are held against together: all of many would take hundreds of MiB."""

MOST_SHAPES = 256
"""Number of shapes whose balls a process keeps: some robots' pieces."""


@lru_cache(maxsize=MOST_SHAPES)
def inner_balls(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Return balls inside of a shape that has an end: centers (balls, 3) in its frame and radii (balls,), m."""
    capsule = bounding_capsule(shape)
    low = np.minimum(capsule.start, capsule.end) - capsule.radius
    size = np.maximum(capsule.start, capsule.end) + capsule.radius - low
    pitch = float(size.prod() / TRIED) ** (1.0 / 3.0)
    counts = 2 * np.round(size / pitch / 2.0).astype(int) + 1  # odd ones: in most shapes the largest balls are amidst
    axes = [a + s * (np.arange(n) + 0.5) / n for a, s, n in zip(low, size, counts.tolist(), strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    radii = -distance_bounds(shape, points)
    order = np.argsort(-radii, kind="stable")
    order = order[radii[order] > max(0.0, LEAST_SHARE * float(radii.max()))]
    points, radii = points[order], radii[order]
    allowed = LEFT_OUT * float(radii.max(initial=0.0))
    left, kept = np.arange(len(points)), []
    while len(left):
        largest = int(left[0])
        kept.append(largest)
        beyond = np.linalg.norm(points[left] - points[largest], axis=1) + radii[left] - radii[largest]
        left = left[beyond > allowed]
    return points[kept], radii[kept]


def distance_bounds(shape: Shape, points: FloatArray) -> FloatArray:
    """Compute upper bounds of the signed distances of points from a shape, negative inside, m.

    They are exact, but for points outside of a convex hull, about which they say nothing: infinite.

    Args:
        shape: The shape, in its own frame.
        points: (..., 3), m.

    Returns:
        (...).
    """
    if isinstance(shape, HalfSpace):
        return np.asarray(points @ shape.normal - shape.offset, dtype=np.float64)
    if isinstance(shape, ConvexHull):
        planes, height = faces(shape), np.full(points.shape[:-1], -np.inf)
        for k in range(0, len(planes), AT_ONCE):
            some = planes[k : k + AT_ONCE]
            np.maximum(height, (points @ some[:, :3].T + some[:, 3]).max(axis=-1), out=height)
        return np.where(height <= 0.0, height, np.inf)
    if isinstance(shape, Box):
        beyond = np.abs(points) - shape.size / 2.0
    elif isinstance(shape, Cylinder):
        beyond = np.stack(
            [np.hypot(points[..., 0], points[..., 1]) - shape.radius, np.abs(points[..., 2]) - shape.length / 2.0],
            axis=-1,
        )
    elif isinstance(shape, Sphere | Capsule):
        half = shape.length / 2.0 if isinstance(shape, Capsule) else 0.0
        axis = np.clip(points[..., 2], -half, half)
        from_axis = np.stack([points[..., 0], points[..., 1], points[..., 2] - axis], axis=-1)
        return np.asarray(np.linalg.norm(from_axis, axis=-1) - shape.radius, dtype=np.float64)
    else:
        raise TypeError(f"nothing is known of the inside of a {type(shape).__name__}")
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0), dtype=np.float64)


@lru_cache(maxsize=MOST_SHAPES)
def faces(hull: ConvexHull) -> FloatArray:
    """Return the planes (faces, 4) of a hull, in whose inside n . x + d is negative."""
    from scipy.spatial import ConvexHull as Qhull  # here only: most processes never need it

    return np.asarray(Qhull(np.asarray(hull.geometry.points())).equations, dtype=np.float64)
