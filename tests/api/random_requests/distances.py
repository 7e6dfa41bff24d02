"""Distances of points from the shapes of requests, by closed forms, triangles and k-d trees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, KDTree, QhullError

Distance = Callable[[np.ndarray], np.ndarray]
"""Signed distances (N,) of points (N, 3), m: negative inside."""

CLOSED_FORMS = {"sphere", "half_space", "capsule", "box", "cylinder"}
"""Kinds of shapes whose distances have a closed form."""

MOST_PAIRS = 256_000
"""Number of pairs of a point and a triangle computed together."""


def distance_to(shape: dict[str, Any]) -> Distance:
    """Return the distance from a shape in its own frame; for a mesh, from its surface."""
    match shape["kind"]:
        case "sphere":
            return lambda points: np.linalg.norm(points, axis=1) - shape["radius"]
        case "half_space":
            normal = np.array(shape["normal"])
            length = np.linalg.norm(normal)
            return lambda points: points @ (normal / length) - shape["offset"]
        case "capsule":
            return lambda points: np.linalg.norm(_beyond_axis(points, shape["length"]), axis=1) - shape["radius"]
        case "box":
            return lambda points: _from_excess(np.abs(points) - np.array(shape["size"]) / 2.0)
        case "cylinder":

            def from_cylinder(points: np.ndarray) -> np.ndarray:
                around = np.hypot(points[:, 0], points[:, 1]) - shape["radius"]
                return _from_excess(np.stack([around, np.abs(points[:, 2]) - shape["length"] / 2.0], axis=1))

            return from_cylinder
        case "convex":
            return _from_hull(np.array(shape["vertices"]))
        case "mesh":
            return _from_triangles(np.array(shape["vertices"])[np.array(shape["triangles"])])
        case _:
            tree = KDTree(np.array(shape["points"]))
            return lambda points: tree.query(points)[0] - shape["radius"]


def _beyond_axis(points: np.ndarray, length: float) -> np.ndarray:
    off = points.copy()
    off[:, 2] -= np.clip(off[:, 2], -length / 2.0, length / 2.0)
    return off


def _from_excess(beyond: np.ndarray) -> np.ndarray:
    """Return the distance from a product of sets, by the excess of points beyond each set, (N, sets)."""
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


def _from_hull(vertices: np.ndarray) -> Distance:
    """Return the distance from a convex hull; if it is flat, from its corners, an upper bound."""
    try:
        hull = ConvexHull(vertices)
    except (QhullError, ValueError):
        return lambda points: KDTree(vertices).query(points)[0]
    outside, tree = _from_triangles(vertices[hull.simplices]), KDTree(vertices)

    def distance(points: np.ndarray) -> np.ndarray:
        """Return distances of points; of many points only the least is exact, the others are upper bounds."""
        beyond = (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        apart, asked = tree.query(points)[0], np.arange(len(points))
        if len(hull.simplices) * len(points) > MOST_PAIRS:
            asked = np.flatnonzero(beyond <= apart.min())
        for few in np.array_split(asked, 1 + len(hull.simplices) * len(asked) // MOST_PAIRS):
            apart[few] = outside(points[few])
        return np.where(beyond < 0.0, beyond, apart)

    return distance


def _from_triangles(triangles: np.ndarray) -> Distance:
    """Return the distance from triangles (T, 3, 3): from the plane above a triangle, otherwise from the sides."""
    a, b, c = triangles.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    units = normals / np.maximum(lengths, 1e-300)[:, None]

    def distance(points: np.ndarray) -> np.ndarray:
        to_points = points[:, None]
        above = ((to_points - a) * units).sum(axis=2)
        is_over = np.broadcast_to(lengths > 1e-12, above.shape)
        nearest = np.full(above.shape, np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            way = end - start
            since = to_points - start
            is_over = is_over & ((np.cross(way, since) * units).sum(axis=2) >= 0.0)
            share = np.clip((since * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
            nearest = np.minimum(nearest, np.linalg.norm(since - share[..., None] * way, axis=2))
        return np.where(is_over, np.abs(above), nearest).min(axis=1)

    return distance


def core_of(shape: dict[str, Any]) -> tuple[np.ndarray, float, bool]:
    """Return a shape's core points (P, 3) in its frame, their radius, m, and whether they form a line."""
    match shape["kind"]:
        case "sphere":
            return np.zeros((1, 3)), shape["radius"], True
        case "capsule":
            return np.outer(np.linspace(-0.5, 0.5, 5), [0.0, 0.0, shape["length"]]), shape["radius"], True
        case "box":
            grid = np.array(np.meshgrid(*[np.linspace(-0.5, 0.5, 4)] * 3)).reshape(3, -1).T
            return grid[np.abs(grid).max(axis=1) == 0.5] * np.array(shape["size"]), 0.0, False
        case "cylinder":
            turn = np.arange(16) * np.pi / 8.0
            rim = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(16)]) * shape["radius"]
            return (
                np.concatenate([rim + np.array([0.0, 0.0, z * shape["length"]]) for z in (-0.5, 0.0, 0.5)]),
                0.0,
                False,
            )
        case "convex":
            vertices = np.array(shape["vertices"])
            return np.concatenate([vertices, (vertices + np.roll(vertices, 1, axis=0)) / 2.0]), 0.0, False
        case _:
            corners = np.array(shape["vertices"])[np.array(shape["triangles"])]
            return np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)]), 0.0, False
