"""Inputs that kill coal's process, or make it report no collision: none of them reaches it.

Other traps stand beside their subject: sizes and hulls in `test_shapes.py`, files in `test_mesh_readers.py`.
"""

from __future__ import annotations

import gc

import numpy as np
import pytest

import planner
from planner import ConvexHull, InvalidShape, Robot, Shape, Sphere, load_robot
from planner.kernels.clearance import Distances
from planner.scene import CollisionChecker, PointCloud, Scene, SceneObject
from planner.scene.separations import Placed, separation
from planner.shapes.meshes.files import mesh_pieces
from planner.spatial import Pose
from tests.planner.shapes.mesh_files import bodies, box, stl, tube


def gap(shape: Shape, ball: Sphere, at: list[float]) -> float:
    return separation(Placed(ball, np.eye(3), np.array(at)), Placed(shape, np.eye(3), np.zeros(3))).proved


def test_a_ball_inside_a_mesh_is_not_free() -> None:
    """coal's meshes are hollow."""
    (cube,) = mesh_pieces("cube.stl", stl(box((-1, -1, -1), (1, 1, 1)))).hulls
    assert gap(cube, Sphere(0.01), [0.0, 0.0, 0.0]) < -0.9


@pytest.mark.parametrize("name", ["sheet", "one_triangle", "one_point", "needle", "fine_disc"])
def test_flat_and_finely_tessellated_meshes_have_hulls(name: str) -> None:
    """coal's hull of points in one plane ends the process; a fan with 300 triangles has too many neighbours for it."""
    triangles = bodies()[name]
    for hull in mesh_pieces("a.stl", stl(triangles)).hulls:
        corner = hull.vertices[0]
        assert gap(hull, Sphere(0.01), corner.tolist()) < 0.0
        assert gap(hull, Sphere(0.01), (corner + [3.0, 0.0, 0.0]).tolist()) > 0.0  # noqa: RUF005


def test_a_hull_of_a_finely_tessellated_cylinder_is_closed() -> None:
    hull = ConvexHull(tube([0.1, 0.1], [0.0, 0.2], sides=1000).reshape(-1, 3))
    assert np.bincount(hull.faces.ravel()).max() < 255
    edges = np.sort(np.concatenate([hull.faces[:, [0, 1]], hull.faces[:, [1, 2]], hull.faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert gap(hull, Sphere(0.01), [0.0, 0.0, 0.1]) < 0.0


def test_an_empty_hull_is_refused() -> None:
    for vertices in ([], np.zeros((0, 3))):
        with pytest.raises(InvalidShape, match="vertices"):
            ConvexHull(vertices)


NAN, INFINITE = float("nan"), float("inf")


@pytest.mark.parametrize(
    "points", [[], [[NAN, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0, -INFINITE, 0.0]], [[0.0, 1e30, 0.0]]]
)
def test_no_point_cloud_is_made_of_nonsense(points: list[list[float]]) -> None:
    """coal's octree of a NaN collides with nothing, and an empty one ends the process."""
    with pytest.raises(InvalidShape, match="points"):
        PointCloud(points, 0.01)


@pytest.mark.large_only
def test_a_quick_look_outlives_what_it_was_made_from() -> None:
    """The kernels read arrays by their addresses: the process would end if these were freed."""
    robot = load_robot("kuka_kr16_2")
    still = np.zeros((1, robot.dof))
    tool = planner.tool_pose(robot, still[0]).position

    def look(away: float) -> Distances:
        hull = ConvexHull(tube([0.1, 0.1], [0.0, 0.2], sides=30).reshape(-1, 3))
        thing = SceneObject("thing", [hull, Sphere(0.1)], Pose(tool + np.array([away, 0.0, 0.0])))
        return CollisionChecker(robot, Scene([thing]), self_collision=False).distances

    looks = [look(away) for away in (0.0, 1.0, 0.0, 2.0)]
    for _ in range(2):
        gc.collect()
        others = [np.full(10**6, np.nan) for _ in range(8)]  # where the memory went that nobody keeps
        assert [one.first_collision(still, 0.0) is None for one in looks] == [False, True, False, True]
        del others


def test_a_capsule_of_a_urdf_is_not_dropped() -> None:
    joint = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/>'
    robot = Robot.from_urdf(
        f"""<robot name="r"><link name="base"/><link name="arm">
        <collision><geometry><capsule radius="0.1" length="0.5"/></geometry></collision></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="arm"/>{joint}</joint></robot>"""
    )
    assert [type(shape.shape).__name__ for shape in robot.collision_shapes] == ["Capsule"]
