"""Hulls of points that are hard for Qhull and coal: they contain all points, are closed, and coal accepts them."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner import ConvexHull, InvalidShape, Shape, Sphere
from planner.scene.separations import Placed, separation
from planner.shapes.meshes.files import mesh_pieces
from tests.locations import ROOT
from tests.planner.shapes.mesh_files import stl, tube

if TYPE_CHECKING:
    from planner.spatial import FloatArray

MOST_AT_A_CORNER = 254
"""Number of neighbours of a corner above which coal says "Too many neighbors"."""

THICKNESS = 1e-4
"""Thickness added to flat hulls, m."""

TIP = 1e-5
"""Width added to a tip, m, or as a share of the hull."""


def ring(sides: int, height: float, radius: float = 0.1, turned: float = 0.0) -> FloatArray:
    angles = 2.0 * np.pi * (np.arange(sides) + turned) / sides
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(sides, height)])


def unit_vectors(count: int) -> FloatArray:
    vectors = np.random.default_rng(count).normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def nearly_flat(noise: float) -> FloatArray:
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 30), np.linspace(-0.1, 0.1, 30))
    return np.column_stack([x.ravel(), y.ravel(), noise * np.random.default_rng(3).normal(size=900)])


def solids() -> dict[str, FloatArray]:
    tip, foot = np.array([[0.0, 0.0, 0.2]]), np.array([[0.0, 0.0, -0.2]])
    cylinder = np.concatenate([ring(600, 0.0), ring(600, 0.2), np.zeros((1, 3)), tip])
    cone = np.concatenate([ring(600, 0.0), tip])
    shaken = 1e-12 * np.random.default_rng(1).normal(size=cylinder.shape)
    found = {
        "cylinder": cylinder,
        "cylinder with thousands of corners": np.concatenate([ring(2000, 0.0), ring(2000, 0.2)]),
        "cylinder, hardly shaken": cylinder + shaken,
        "cylinder, twisted": np.concatenate([ring(600, 0.0), ring(600, 0.2, turned=0.5)]),
        "stump of a cone": np.concatenate([ring(600, 0.0), ring(600, 0.2, radius=0.05)]),
        "cone with 255 sides": np.concatenate([ring(255, 0.0), tip]),
        "cone": cone,
        "cone on a cone": np.concatenate([cone, foot]),
        "cone, flat": np.concatenate([ring(600, 0.0), 5e-3 * tip]),
        "cone on a cone, one very flat": np.concatenate([ring(600, 0.0), 5e-6 * tip, foot]),
        "cone, needle": np.concatenate([ring(600, 0.0, radius=1e-3), 10.0 * tip]),
        "cone, cut": np.concatenate([ring(4000, 0.0)[:900], tip, np.zeros((1, 3))]),
        "ball": 0.1 * unit_vectors(2000),
        "points twice and more": np.repeat(0.1 * unit_vectors(20), 50, axis=0),
        "points nearly twice": np.repeat(0.1 * unit_vectors(20), 50, axis=0) + 1e-13 * unit_vectors(1000),
        "grid in a cube": np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 9)] * 3), axis=-1).reshape(-1, 3),
        "far corners": np.concatenate([1e-6 * unit_vectors(100), 999.0 * np.eye(3)]),
        **{f"flat to {noise:g} m": nearly_flat(noise) for noise in (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 0.9e-4, 1e-4)},
    }
    for name in ("cylinder", "cone", "flat to 1e-12 m", "flat to 1e-06 m"):
        found |= {f"{name}, {scale:g} times": scale * found[name] for scale in (1e-6, 1e-3, 1e3)}
        found |= {f"{name}, far away, {scale:g} times": scale * found[name] + 900.0 for scale in (1e-3, 1.0)}
    return found


SOLIDS = solids()


@cache
def hull_of(name: str) -> ConvexHull:
    return ConvexHull(SOLIDS[name])


def gap(shape: Shape, ball: Sphere, at: FloatArray) -> float:
    return separation(Placed(ball, np.eye(3), at), Placed(shape, np.eye(3), np.zeros(3))).proved


@pytest.mark.long_table
@pytest.mark.parametrize("name", SOLIDS)
def test_a_hull_contains_its_points_and_little_more(name: str) -> None:
    """The check covers its triangles, which are closed, and its support."""
    points = SOLIDS[name]
    hull = hull_of(name)
    extent, reach = float(np.ptp(points, axis=0).max()), float(np.abs(points).max())
    rounding = 1e-10 * extent + 1e-14 * reach
    directions = np.concatenate([unit_vectors(500), np.eye(3), -np.eye(3)])
    more = hull.support(directions) - (points @ directions.T).max(axis=0)
    assert more.min() >= -rounding
    assert more.max() <= 1.5 * THICKNESS + TIP * max(1.0, extent)
    assert np.bincount(hull.faces.ravel(), minlength=len(hull.vertices)).min() >= 3
    edges = np.sort(hull.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = (hull.vertices[hull.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    wide = lengths > 1e-4 * lengths.max()  # others have no direction that survives rounding
    normals = normals[wide] / lengths[wide, None]
    normals *= np.sign(np.einsum("ij,ij->i", a[wide] - hull.vertices.mean(axis=0), normals))[:, None]
    heights = (points @ normals.T).max(axis=0) - np.einsum("ij,ij->i", a[wide], normals)
    assert heights.max() <= 1e4 * rounding


@pytest.mark.parametrize("name", SOLIDS)
def test_coal_takes_a_hull(name: str) -> None:
    """Coal takes it without "Too many neighbors", and tells points inside from points beside it."""
    points = SOLIDS[name]
    hull, size = hull_of(name), float(np.ptp(points, axis=0).max()) + 0.01
    assert np.bincount(hull.faces.ravel()).max() < MOST_AT_A_CORNER
    assert gap(hull, Sphere(0.01), points.mean(axis=0)) < -0.009
    for way in (*np.eye(3), *-np.eye(3)):
        beside = points.mean(axis=0) + 2.0 * size * way
        truth = float(beside @ way - hull.support(way[None])[0]) - 0.01  # at most as near as the plane across the way
        assert 0.99 * truth - 1e-6 <= gap(hull, Sphere(0.01), beside) <= 2.0 * size


def test_the_same_points_have_the_same_hull() -> None:
    """The hull is equal even where Qhull perturbs points at random."""
    for name in ("cylinder", "cone", "cone on a cone, one very flat"):
        first, second = hull_of(name), ConvexHull(SOLIDS[name].copy())
        assert first == second
        assert (first.faces == second.faces).all()


def test_a_mesh_with_a_fine_tip_has_pieces() -> None:
    triangles = tube([0.1, 0.1, 1e-9], [0.0, 0.1, 0.3], sides=600)
    pieces = mesh_pieces("tip.stl", stl(triangles)).hulls
    assert min(gap(piece, Sphere(0.01), np.array([0.0, 0.0, 0.3])) for piece in pieces) < 0.0
    assert min(gap(piece, Sphere(0.01), np.array([0.0, 0.0, 0.32])) for piece in pieces) == pytest.approx(
        0.01, abs=1e-4
    )


@pytest.mark.large_only
def test_a_tip_that_is_too_fine_and_flat_is_refused() -> None:
    points = np.concatenate([ring(5000, 0.0), [[0.0, 0.0, 1e-6], [0.0, 0.0, -0.2]]])
    with pytest.raises(InvalidShape, match="more than 200 faces at one of them"):
        ConvexHull(points)


def test_what_of_coal_ends_the_process_is_not_used() -> None:
    """The planner uses no octree, height field, file reader or unchecked hull of coal, and one tree of boxes only."""
    source = "\n".join(
        path.read_text() for folder in ("planner", "api", "cli") for path in (ROOT / folder).rglob("*.py")
    )
    assert "coal.Convex(" in source
    assert not re.search(
        r"convexHull\b|buildConvex|\bBVH(?!ModelOBBRSS\(\))|OcTree|HeightField|MeshLoader|buildGeom|from coal|hppfcl",
        source,
    )
    assert set(re.findall(r"qhull_options=(\S+)\)", source)) == {'"QJ"'}
