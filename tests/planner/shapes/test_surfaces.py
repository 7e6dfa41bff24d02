"""Drawn surfaces are as large as their shapes, of any size, and closed."""

from __future__ import annotations

import numpy as np
import pytest

from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from planner.shapes.surfaces import SEGMENTS, surface, surface_around

SHAPES: list[Shape] = [
    Box([0.2, 0.4, 0.6]),
    Box([1e-6, 1e-6, 1e-6]),
    Box([1e3, 1e3, 1e3]),
    Sphere(0.1),
    Sphere(1e-6),
    Sphere(1e3),
    Cylinder(0.1, 0.6),
    Cylinder(1e3, 1e3),
    Cylinder(1e-6, 1e-6),
    Capsule(0.1, 0.6),
    Capsule(1e3, 1e3),
    Capsule(1e-6, 1e-6),
    ConvexHull([[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0, 0, 0.3]]),
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: f"{type(shape).__name__}")
def test_surfaces_reach_as_far_as_their_shapes(shape: Shape) -> None:
    vertices, faces = surface(shape)
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach, truth = (directions @ vertices.T).max(axis=1), shape.support(directions)
    size = np.abs(truth).max()
    assert (reach <= truth + 1e-9 * size).all()
    assert (reach >= truth - 2.0 * (1.0 - np.cos(np.pi / SEGMENTS)) * size).all()
    edges = {(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}
    assert edges == {(b, a) for a, b in edges}
    assert len(edges) == 3 * len(faces)


@pytest.mark.parametrize("thin", [Box([1.0, 1.0, 1e-6]), Cylinder(1e-6, 1e3), Cylinder(1e3, 1e-6), Capsule(1e-6, 1e3)])
def test_thin_things_are_a_ten_thousandth_of_their_extent_thick(thin: Shape) -> None:
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    vertices, _ = surface(thin)
    reach, truth = (directions @ vertices.T).max(axis=1), thin.support(directions)
    assert (np.abs(reach - truth) <= 2e-4 * truth.max()).all()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_hulls_of_points_are_found_at_any_scale_and_place(scale: float) -> None:
    corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])).reshape(3, 8).T
    vertices, faces = surface_around(scale * (corners + 5.0))
    assert len(vertices) == 8
    assert len(faces) == 12
    assert vertices.min(axis=0) == pytest.approx(5.0 * scale)
    assert vertices.max(axis=0) == pytest.approx(6.0 * scale)


def test_what_has_no_end_has_no_surface() -> None:
    with pytest.raises(TypeError, match="HalfSpace"):
        surface(HalfSpace([0.0, 0.0, 1.0]))
