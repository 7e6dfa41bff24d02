"""Concave meshes are cut so that their cavities stay free, by brute force over their triangles."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import planner
from planner.errors import StartInCollision
from planner.robots import load_robot
from planner.scene import AttachedObject, Scene, SceneObject
from planner.scene.separations import Placed, separation
from planner.shapes import Box, Sphere
from planner.shapes.meshes.mesh import Mesh, distance_from_mesh, winding_number
from planner.shapes.meshes.pieces import MOST_TIGHT_PIECES, convex_pieces, tight_pieces
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.planner.shapes.concave import bin_of, concave_meshes
from tests.planner.shapes.mesh_files import bodies, surface_of, tube

MESHES = concave_meshes()


def distances(triangles: FloatArray, points: FloatArray) -> FloatArray:
    """Return the distances (N,) of points (N, 3) from triangles (T, 3, 3), one by one."""
    least = []
    for point in points:
        nearest = trimesh.triangles.closest_point(triangles, np.tile(point, (len(triangles), 1)))
        least.append(np.linalg.norm(nearest - point, axis=1).min())
    return np.array(least)


@pytest.mark.parametrize("name", MESHES)
def test_pieces_are_as_far_away_as_the_triangles(name: str) -> None:
    triangles, rng = MESHES[name], np.random.default_rng(1)
    low, high = triangles.min(axis=(0, 1)) - 0.1, triangles.max(axis=(0, 1)) + 0.1
    points = rng.uniform(low, high, (60, 3))
    pieces = tight_pieces(Mesh.checked(triangles))
    assert len(pieces) <= 12
    speck = Sphere(1e-6)
    for point, truth in zip(points, distances(triangles, points), strict=True):
        apart = min(
            separation(Placed(speck, np.eye(3), point), Placed(piece, np.eye(3), np.zeros(3))).proved
            for piece in pieces
        )
        is_inside = winding_number(Mesh(triangles), point) > 0.5
        assert apart == pytest.approx(truth - 1e-6, abs=2e-7) or is_inside


@pytest.mark.long_table
@pytest.mark.parametrize("name", [*MESHES, *bodies()])
def test_tight_pieces_cover_the_surface(name: str) -> None:
    triangles = (MESHES | bodies())[name]
    pieces = tight_pieces(Mesh.checked(triangles))
    assert 1 <= len(pieces) <= MOST_TIGHT_PIECES
    size = max(1.0, float(np.abs(triangles).max()))
    for point in surface_of(triangles[:: 1 + len(triangles) // 60], 20, np.random.default_rng(1)):
        speck = Placed(Sphere(1e-6), np.eye(3), point)
        assert min(separation(speck, Placed(p, np.eye(3), np.zeros(3))).distance for p in pieces) < 1e-8 * size


def test_a_tube_is_left_open_by_many_pieces() -> None:
    rings = trimesh.creation.annulus(0.05, 0.06, 0.2, sections=24)
    pieces = tight_pieces(Mesh.checked(rings.triangles))
    middle = Placed(Sphere(0.045), np.eye(3), np.zeros(3))
    assert min(separation(middle, Placed(piece, np.eye(3), np.zeros(3))).proved for piece in pieces) > 0.0


def test_what_is_convex_stays_in_one_piece() -> None:
    for triangles in (bodies()["box"], trimesh.creation.icosphere(3).triangles):
        assert len(tight_pieces(Mesh.checked(triangles))) == 1


def test_distances_from_a_mesh_are_those_from_its_triangles() -> None:
    triangles, rng = MESHES["bin"], np.random.default_rng(2)
    points = rng.uniform([-0.1] * 3, [0.7, 0.5, 0.35], (100, 3))
    truth = distances(triangles, points)
    for point, apart in zip(points, truth, strict=True):
        is_wall = abs(winding_number(Mesh(triangles), point)) > 0.5
        found = distance_from_mesh(Mesh(triangles), Sphere(1e-6), np.eye(3), point)
        assert found == pytest.approx(0.0 if is_wall else apart - 1e-6, abs=1e-6)


def test_the_winding_number_tells_what_is_inside() -> None:
    tall = Mesh(tube([0.1, 0.1], [0.0, 1.0]))
    for point, inside in (([0.0, 0.0, 0.5], 1.0), ([0.09, 0.0, 0.9], 1.0), ([0.11, 0.0, 0.5], 0.0)):
        assert winding_number(tall, np.array(point)) == pytest.approx(inside, abs=1e-6)


def test_a_part_is_taken_from_a_bin_with_room() -> None:
    """With 78 mm of clearance on each side the part was refused, 59 micrometres inside the bin."""
    robot, size = load_robot("kuka_kr16_2"), (0.6, 0.4, 0.25)
    mesh = Mesh.checked(bin_of(size, 0.01))
    at, down = Pose([0.9, -0.2, 0.0]), rotation_from_rpy(np.pi, 0.0, 0.0)
    part = AttachedObject("part", (Box([0.1, 0.1, 0.1]),), Pose([0.0, 0.0, 0.25]))
    low, high = (planner.PoseWaypoint(Pose([1.2, 0.0, z], down)) for z in (0.35, 0.7))
    up = planner.PoseWaypoint(high.pose, motion=planner.LinearMotion())

    def problem(thing: SceneObject) -> planner.PlanningProblem:
        return planner.PlanningProblem(robot, [low, up], scene=Scene([thing], [part]))

    plan = planner.plan(problem(SceneObject("bin", tight_pieces(mesh), at, mesh=mesh)), "quintic")
    assert plan.certificate.clearance is not None
    with pytest.raises(StartInCollision, match=r"its mesh is 0\.0\d+ m away there: the convex pieces of bin fill"):
        planner.plan(problem(SceneObject("bin", convex_pieces(mesh, 1), at, mesh=mesh)), "quintic")
