"""Scenes in pictures: shapes are drawn where another projection has them, in front of the shapes that they hide."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.backends import Trapezoidal
from planner.kinematics.forward import tool_pose
from planner.planning import plan
from planner.plots.picture import draw_plan
from planner.plots.view import distinct_points, stick_model
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from planner.scene import Attach, AttachedObject, PointCloud, Scene, SceneObject
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere
from planner.spatial import Pose
from tests.documents.read_pictures import drawn_groups
from tests.planner.plots.space.shape_points import assert_same_outline, found_camera, points_of, seen_by

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.plans.result import Plan
    from planner.shapes import Shape
    from planner.spatial import FloatArray

VIEWS = {"isometric": (), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
POINT = 0.5
"""Allowed error of a drawn corner, in points of the picture."""

GEM = ConvexHull(0.2 * np.concatenate([np.eye(3), -np.eye(3)]))
TURNED = (0.4, -0.7, 1.1)

SCENES: dict[str, list[tuple[str, Shape, tuple[float, ...], tuple[float, ...]]]] = {
    "aligned": [
        ("table", Box([0.8, 1.0, 0.05]), (1.3, 0.0, 0.4), ()),
        ("on_it", Box([0.2, 0.2, 0.2]), (1.3, 0.3, 0.525), ()),
        ("pillar", Cylinder(0.05, 1.4), (0.4, -1.2, 0.7), ()),
        ("ball", Sphere(0.15), (1.3, -0.2, 0.575), ()),
        ("pipe", Capsule(0.06, 1.0), (0.2, 1.1, 1.2), ()),
    ],
    "turned": [
        ("box", Box([0.6, 0.1, 0.3]), (1.4, 0.2, 0.4), TURNED),
        ("drum", Cylinder(0.2, 0.3), (0.2, -1.2, 0.7), TURNED),
        ("pipe", Capsule(0.06, 0.7), (0.2, 1.2, 1.2), TURNED),
        ("gem", GEM, (1.5, -0.4, 0.3), TURNED),
    ],
    "tiny, thin": [
        ("grain", Sphere(1e-6), (1.3, 0.0, 0.4), ()),
        ("needle", Cylinder(1e-6, 1.0), (1.4, -0.3, 0.4), TURNED),
        ("sheet", Box([0.8, 0.8, 1e-6]), (1.4, 0.0, 0.2), (0.2, 0.0, 0.0)),
        ("flat", ConvexHull([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0.3, 0.3, 0]]), (0.3, -1.2, 0.4), ()),
    ],
    "behind and before the robot": [
        ("behind", Box([0.4, 0.1, 1.0]), (0.3, 1.1, 0.8), ()),
        ("before", Box([0.4, 0.1, 1.0]), (0.3, -1.1, 0.8), ()),
    ],
}  # fmt: skip


def planned(
    objects: Sequence[SceneObject], margin: float = 0.01, mounting: Pose | None = None, **scene: object
) -> Plan:
    robot = load_robot("kuka_kr16_2")
    robot = robot if mounting is None else robot.derived(mounting=mounting)
    stand = [("base_link", thing.id) for thing in objects]
    waypoints = [JointWaypoint(q) for q in ((0.5, -1.4, 1.2, 0.0, 0.8, 0.0), (-0.5, -1.2, 1.4, 0.3, 0.8, 0.0))]
    surroundings = Scene(objects, margin=margin, allowed_pairs=stand, **scene)
    return plan(PlanningProblem(robot, waypoints, scene=surroundings), Trapezoidal())


def sticks(solved: Plan) -> list[FloatArray]:
    return [distinct_points(stick_model(solved.path.robot, position)) for position in solved.path.positions]


def camera_of(solved: Plan, groups: dict[str, FloatArray], view: str) -> FloatArray:
    known = sticks(solved)
    seen = np.concatenate([groups[f"robot.{k}"] for k in range(len(known))])
    camera = found_camera(np.concatenate(known), seen)
    assert seen_by(camera, np.concatenate(known)) == pytest.approx(seen, abs=0.01)
    for row, column in enumerate(VIEWS[view]):
        assert camera[row, :3] == pytest.approx(np.eye(3)[column] * camera[row, column], abs=1e-3 * camera[row, column])
        assert camera[row, column] > 0.0
    return camera


def pieces(groups: dict[str, FloatArray], name: str) -> list[FloatArray]:
    return [points for key, points in groups.items() if key.rpartition(".")[0] == f"scene.{name}"]


@pytest.fixture(scope="module")
def plans() -> dict[str, Plan]:
    """A plan in each of the scenes."""
    return {
        name: planned([SceneObject(i, [s], Pose.from_rpy(p, r or (0.0, 0.0, 0.0))) for i, s, p, r in things])
        for name, things in SCENES.items()
    }


@pytest.mark.long_table
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", SCENES)
def test_outlines_are_where_the_shapes_are_seen(plans: dict[str, Plan], name: str, view: str) -> None:
    groups = drawn_groups(draw_plan(plans[name], ["robot"], view=view).svg())
    camera = camera_of(plans[name], groups, view)
    for thing, shape, position, rpy in SCENES[name]:
        pose = Pose.from_rpy(position, rpy or (0.0, 0.0, 0.0))
        (drawn,) = pieces(groups, thing)
        assert_same_outline(drawn, seen_by(camera, points_of(shape) @ pose.rotation.T + position), POINT)
        edges = groups.get(f"edges.{next(key for key in groups if key.startswith(f'scene.{thing}.'))}")
        assert edges is not None
        assert_same_outline(edges, drawn, POINT)
    assert any(key.startswith("speck.scene.grain.") for key in groups) == (name == "tiny, thin")


@pytest.mark.large_only
def test_what_is_before_the_robot_is_drawn_over_it_thinly(plans: dict[str, Plan]) -> None:
    """The view onto xz looks along y, and the view onto yz against x."""
    picture = draw_plan(plans["behind and before the robot"], ["robot"], view="xz")
    (behind,), (before,) = (
        [patch for patch in picture.figure.axes[0].patches if str(patch.get_gid()).startswith(f"scene.{name}.")]
        for name in ("behind", "before")
    )
    assert before.get_alpha() < 0.5 * behind.get_alpha() < 0.25
    order = list(drawn_groups(picture.svg()))
    at = [next(k for k, key in enumerate(order) if key.startswith(start)) for start in ("scene.behind", "robot.0")]
    assert at == sorted(at)
    assert order.index("robot.1") < next(k for k, key in enumerate(order) if key.startswith("scene.before"))


@pytest.mark.large_only
def test_a_huge_floor_leaves_the_robot_large() -> None:
    """A shape larger than the space around the robot is cut at the edges of the picture, and has no lines there."""
    solved = planned([SceneObject("floor", [Box([1000.0, 1000.0, 500.0])], Pose([0.0, 0.0, -250.0]))])
    graph = draw_plan(solved, ["robot"], view="xz")
    groups = drawn_groups(graph.svg())
    camera = camera_of(solved, groups, "xz")
    (drawn,) = pieces(groups, "floor")
    robot = np.concatenate([groups["robot.0"], groups["robot.1"]])
    assert np.ptp(robot, axis=0).max() > 0.5 * np.ptp(drawn[:, 0])
    top = seen_by(camera, np.zeros((1, 3)))[0, 1]
    assert drawn[:, 1].max() == pytest.approx(top, abs=POINT)
    axis = graph.figure.axes[0]
    ends = seen_by(camera, np.array([[x, 0.0, axis.get_ylim()[0]] for x in axis.get_xlim()]) / 1000.0)
    assert [drawn[:, 0].min(), drawn[:, 0].max()] == pytest.approx(ends[:, 0], abs=POINT)
    assert drawn[:, 1].min() == pytest.approx(ends[0, 1], abs=POINT)
    (edges,) = (points for key, points in groups.items() if key.startswith("edges.scene.floor"))
    assert edges[:, 1] == pytest.approx(top, abs=POINT)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.3, -0.2, 1.0)])
def test_half_spaces_are_patches_of_their_planes(normal: tuple[float, float, float]) -> None:
    """The corners of the patch are the points where the plane cuts the edges of the picture's box."""
    plane = HalfSpace(normal, -0.1)
    solved = planned([SceneObject("floor", [plane])])
    for view in ("isometric", "xz"):
        picture = draw_plan(solved, ["robot"], view=view)
        groups = drawn_groups(picture.svg())
        camera = camera_of(solved, groups, view)
        axis = picture.figure.axes[0]
        if view == "isometric":
            ends = np.array([axis.get_xlim(), axis.get_ylim(), axis.get_zlim()]).T / 1000.0
        (drawn,) = pieces(groups, "floor")
        corners = np.array(np.meshgrid(*ends.T)).reshape(3, 8).T
        heights = corners @ plane.normal - plane.offset
        pairs = [(a, b) for a in range(8) for b in range(a) if (corners[a] != corners[b]).sum() == 1]
        crossed = [
            corners[a] + heights[a] / (heights[a] - heights[b]) * (corners[b] - corners[a])
            for a, b in pairs
            if heights[a] * heights[b] < 0.0
        ]
        assert len(crossed) >= 3
        assert_same_outline(drawn, seen_by(camera, np.array(crossed)), 2.0 * POINT)


@pytest.mark.large_only
def test_clouds_are_dots_at_some_of_their_points() -> None:
    random = np.random.default_rng(0)
    points = random.uniform((1.3, -0.3, 0.2), (1.6, 0.3, 0.4), (30_000, 3))
    solved = planned([SceneObject("seen", [PointCloud(points, 0.005)], Pose([0.0, 0.1, 0.0]))])
    groups = drawn_groups(draw_plan(solved, ["robot"], view="isometric").svg())
    camera = camera_of(solved, groups, "isometric")
    (dots,) = (points for key, points in groups.items() if key.startswith("points.scene.seen."))
    assert 1000 < len(dots) <= 2000
    truth = seen_by(camera, points + np.array([0.0, 0.1, 0.0]))
    assert_same_outline(dots, truth, 0.08 * np.ptp(truth, axis=0).max())
    off = np.linalg.norm(dots[:200, None] - truth, axis=2).min(axis=1)
    assert off.max() < POINT + 0.01 * np.ptp(truth, axis=0).max()  # a ball stands for the points of a voxel of 5 mm


@pytest.mark.large_only
def test_what_is_carried_is_at_the_tool_at_every_waypoint() -> None:
    part = AttachedObject("part", [Box([0.1, 0.2, 0.3])], Pose.from_rpy([0.0, 0.05, 0.2], TURNED))
    solved = planned([SceneObject("post", [Cylinder(0.1, 1.0)], Pose([0.2, 1.2, 0.5]))], attached=[part])
    for view in ("isometric", "yz"):
        picture = draw_plan(solved, ["robot"], view=view)
        groups = drawn_groups(picture.svg())
        camera = camera_of(solved, groups, view)
        drawn = pieces(groups, "part")
        truths = []
        for position in solved.path.positions:
            tool = tool_pose(solved.path.robot, position)
            corners = points_of(part.shapes[0]) @ part.pose.rotation.T + part.pose.position
            truths.append(seen_by(camera, corners @ tool.rotation.T + tool.position))
        assert len(drawn) == len(truths)
        for truth in truths:
            nearest = min(drawn, key=lambda outline, truth=truth: np.linalg.norm(outline.mean(0) - truth.mean(0)))
            assert_same_outline(nearest, truth, POINT)


@pytest.mark.large_only
def test_things_of_the_world_are_drawn_in_the_base_frame() -> None:
    mounting = Pose.from_rpy([2.0, 1.0, 0.5], (0.0, 0.0, 0.7))
    shape, pose = Box([0.4, 0.2, 0.3]), Pose.from_rpy([1.2, 0.3, 0.4], (0.1, 0.2, 0.3))
    solved = planned([SceneObject("box", [shape], pose.from_frame(mounting))], mounting=mounting)
    groups = drawn_groups(draw_plan(solved, ["robot"], view="isometric").svg())
    (drawn,) = pieces(groups, "box")
    corners = points_of(shape) @ pose.rotation.T + pose.position
    assert_same_outline(drawn, seen_by(camera_of(solved, groups, "isometric"), corners), POINT)


def test_what_is_taken_and_put_down_is_drawn_where_it_stands_before_and_after() -> None:
    """A ball is taken at the first waypoint and put down at the third."""
    robot = load_robot("kuka_kr16_2")
    rows = [(0.5, -1.2, 1.2, 0.0, 0.8, 0.0), (0.0, -1.4, 1.2, 0.0, 0.8, 0.0), (-0.5, -1.2, 1.2, 0.0, 0.8, 0.0)]
    tools = [tool_pose(robot, np.array(row)) for row in rows]
    at = [tool.position + tool.rotation @ [0.0, 0.0, 0.1] for tool in tools]
    waypoints = [
        JointWaypoint(rows[0], attach=[Attach("ball")]),
        JointWaypoint(rows[1]),
        JointWaypoint(rows[2], detach=["ball"]),
        JointWaypoint(rows[1]),
    ]
    scene = Scene([SceneObject("ball", [Sphere(0.08)], Pose(at[0]))])
    solved = plan(PlanningProblem(robot, waypoints, scene=scene), Trapezoidal())
    picture = draw_plan(solved, ["robot"], view="xy")
    groups = drawn_groups(picture.svg())
    camera = camera_of(solved, groups, "xy")
    centers = np.array([0.5 * (ball.min(axis=0) + ball.max(axis=0)) for ball in pieces(groups, "ball")])
    truth = seen_by(camera, np.array(at))
    off = np.linalg.norm(centers[:, None] - truth, axis=2)
    assert off.min(axis=1).max() < 2.0 * POINT
    assert off.min(axis=0).max() < 2.0 * POINT


@pytest.mark.large_only
def test_margins_are_told() -> None:
    near, far = Pose([1.3, 0.0, 0.3]), Pose([90.0, 0.0, 0.3])
    for objects, told in (
        ([SceneObject("a", [Sphere(0.1)], near)], ["scene, margin 10 mm"]),
        ([SceneObject("a", [Sphere(0.1)], near, 0.025), SceneObject("b", [Sphere(0.1)], far)], ["a 25 mm, b 10 mm"]),
        (
            [SceneObject(f"n{k}", [Sphere(0.1)], far if k else near, 0.002 * k) for k in range(5)],
            ["scene, margins from 0 to 8 mm", "out of the picture: 4 things"],
        ),
        ([SceneObject("b", [Sphere(0.1)], far)], ["out of the picture: b"]),
    ):
        svg = draw_plan(planned(objects), ["path"]).svg().decode()
        for text in told:
            assert re.search(rf"<!-- .*{text} -->", svg)


@pytest.mark.large_only
def test_names_are_drawn_as_they_are() -> None:
    """A name is never read as a formula or a tag."""
    name = r'$\frac{<g id="1">$'
    solved = planned([SceneObject(name, [Box([0.2, 0.2, 0.2])], Pose([1.3, 0.0, 0.3]))])
    svg = draw_plan(solved, ["robot"], title=name).svg()
    assert f"scene.{name}.0" in drawn_groups(svg)


@pytest.mark.large_only
def test_pictures_without_a_scene_tell_nothing_of_one() -> None:
    robot = load_robot("three_dof_arm")
    solved = plan(PlanningProblem(robot, [JointWaypoint((0.0, 0.5, 0.5)), JointWaypoint((1.0, 1.0, 0.0))]))
    svg = draw_plan(solved, ["path", "robot"]).svg()
    assert b"scene" not in svg
    assert b"margin" not in svg
