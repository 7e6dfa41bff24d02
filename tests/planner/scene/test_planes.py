"""Planes found at one joint position bound distances at others: never beyond the distance, exact at their own."""

from __future__ import annotations

import numpy as np

from planner.robots import load_robot
from planner.scene import PointCloud, Scene, SceneObject
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.scene.reference.bounds import Items, ReferenceChecker
from tests.planner.scene.reference.planes import normals_at, plane_bounds

ARM = load_robot("date_sorting_arm")


def test_planes_never_prove_more_than_there_is() -> None:
    rng = np.random.default_rng(5)
    shapes = [
        Box([0.2, 0.1, 0.3]),
        Sphere(0.1),
        Cylinder(0.1, 0.2),
        Capsule(0.05, 0.3),
        HalfSpace([0.0, 0.0, 1.0], -0.5),
    ]
    shapes += [ConvexHull(rng.uniform(-0.2, 0.2, (12, 3)))]
    things = [
        SceneObject(f"thing_{k}", [shape], Pose(rng.uniform(-0.7, 0.7, 3), rotation_from_rpy(*rng.uniform(-3, 3, 3))))
        for k, shape in enumerate(shapes)
    ]
    things.append(SceneObject("cloud", [PointCloud(rng.uniform(-0.5, 0.5, (50, 3)), 0.01)]))
    checker = ReferenceChecker(ARM, Scene(things), self_collision=True)
    lower, upper = np.maximum(ARM.limit("lower"), -2.0), np.minimum(ARM.limit("upper"), 2.0)
    middles = rng.uniform(lower, upper, (6, ARM.dof))
    here = checker.bodies.at(middles)
    there = checker.bodies.at(middles + rng.uniform(-0.05, 0.05, middles.shape))
    count = checker.own_pairs + len(checker.bodies.pieces) * len(checker.obstacles.all)
    items = Items(*(part.ravel() for part in np.meshgrid(np.arange(6), np.arange(count), indexing="ij")))
    found = [checker.separate(here, row, pair) for row, pair in zip(*items, strict=True)]
    normals = normals_at(checker, here, items, np.array([apart.normal for apart in found]))
    seen = normals.any(axis=(1, 2))
    proved = np.array([apart.proved for apart in found])
    at_once = plane_bounds(checker, here, items, normals)
    np.testing.assert_allclose(at_once[seen], proved[seen], rtol=0.0, atol=1e-9)
    assert (at_once[~seen] == -np.inf).all()
    elsewhere = plane_bounds(checker, there, items, normals)
    distances = np.array([checker.separate(there, row, pair).distance for row, pair in zip(*items, strict=True)])
    assert (elsewhere <= distances + 1e-9).all()
    assert np.median(distances[seen] - elsewhere[seen]) < 5e-3
    assert 0.5 < seen.mean() < 1.0
