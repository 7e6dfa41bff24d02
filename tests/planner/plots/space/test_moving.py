"""Scenes in animations: objects are drawn where another projection has them, at the right times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from defusedxml.ElementTree import fromstring

from planner.backends import Trapezoidal
from planner.kinematics.forward import tool_pose
from planner.planning import plan
from planner.plots.view import stick_model
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from planner.scene import Attach, ConstantVelocity, PointCloud, Scene, SceneObject
from planner.shapes import Box, Cylinder, HalfSpace, Sphere
from planner.spatial import Pose
from tests.planner.plots.space.shape_points import assert_same_outline, found_camera, points_of, seen_by

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

    from planner.plans.result import Plan
    from planner.spatial import FloatArray

POINT = 0.5
"""Allowed error of a drawn corner, in points of the picture: coordinates are written to a tenth."""

ROWS = [(0.5, -1.2, 1.2, 0.0, 0.8, 0.0), (0.0, -1.4, 1.2, 0.0, 0.8, 0.0), (-0.5, -1.2, 1.2, 0.0, 0.8, 0.0)]
IN_TOOL = [0.0, 0.0, 0.1]
RADIUS = 0.08
BOX = Box([0.3, 0.1, 0.5])
BOX_POSE = Pose.from_rpy([0.3, 1.2, 0.6], (0.3, -0.2, 0.5))
POST = Cylinder(0.1, 1.0)
POST_POSE = Pose.from_rpy([0.4, -1.3, 0.5], (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def moved() -> Plan:
    """A ball is taken at the second waypoint and put down at the fourth, between a box, a post, a cloud and a floor."""
    robot = load_robot("kuka_kr16_2")
    tool = tool_pose(robot, np.array(ROWS[0]))
    waypoints = [
        JointWaypoint(ROWS[1]),
        JointWaypoint(ROWS[0], attach=[Attach("ball")], dwell=0.5),
        JointWaypoint(ROWS[1]),
        JointWaypoint(ROWS[2], detach=["ball"], dwell=0.5),
        JointWaypoint(ROWS[1]),
    ]
    grid = np.stack(np.meshgrid(*[np.arange(-0.1, 0.1, 0.04)] * 3), axis=-1).reshape(-1, 3)
    scene = Scene(
        [
            SceneObject("ball", [Sphere(RADIUS)], Pose(tool.position + tool.rotation @ IN_TOOL)),
            SceneObject("box & more", [BOX], BOX_POSE),
            SceneObject("post", [POST], POST_POSE),
            SceneObject("seen", [PointCloud(grid, 0.005)], Pose([-0.8, 0.0, 1.0])),
            SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0], -0.2)], Pose([0.0, 0.0, 0.0])),
        ]
    )
    return plan(PlanningProblem(robot, waypoints, scene=scene), Trapezoidal())


class Drawn:
    """An animation that is read back."""

    def __init__(self, solved: Plan, view: str) -> None:
        self.root = fromstring(solved.animate(view=view).svg)
        self.sticks = self.values(
            next(e for e in self.root if e.find("{*}animate") is not None and "polyline" in e.tag)
        )
        self.times = np.linspace(0.0, solved.trajectory.duration, len(self.sticks))
        (self.positions,) = solved.trajectory.evaluate(self.times, (0,))
        known = np.concatenate([stick_model(solved.path.robot, position) for position in self.positions])
        self.camera = found_camera(known, np.concatenate(self.sticks))
        assert seen_by(self.camera, known) == pytest.approx(np.concatenate(self.sticks), abs=0.11)

    def groups(self, name: str) -> list[ET.Element]:
        return [group for group in self.root if group.get("data-name") == name]

    def outline(self, group: ET.Element) -> FloatArray:
        """Return the filled path of a group."""
        (path,) = (path for path in group.findall("{*}path") if path.get("fill-opacity") is not None)
        return self.points(str(path.get("d")).strip("MZ"))

    @staticmethod
    def points(text: str) -> FloatArray:
        return np.array([pair.split(",") for pair in text.split()], dtype=float)

    def values(self, element: ET.Element) -> list[FloatArray]:
        (animate,) = element.findall("{*}animate")
        return [self.points(text) for text in str(animate.get("values")).split(";")]

    def shown(self, group: ET.Element) -> list[bool]:
        """Tell whether a group is visible at each of the times."""
        (animate,) = group.findall("{*}animate")
        assert animate.get("attributeName") == "visibility"
        assert animate.get("calcMode") == "discrete"
        begins = np.array(str(animate.get("keyTimes")).split(";"), dtype=float)
        states = str(animate.get("values")).split(";")
        share = np.linspace(0.0, 1.0, len(self.times)) + 1e-4
        return [states[k] == "visible" for k in np.searchsorted(begins, share, side="right") - 1]


@pytest.mark.parametrize("view", ["isometric", "xy", "xz", "yz"])
def test_what_stands_is_where_its_shape_is_seen(moved: Plan, view: str) -> None:
    drawn = Drawn(moved, view)
    for name, shape, pose in (("box & more", BOX, BOX_POSE), ("post", POST, POST_POSE)):
        (group,) = drawn.groups(name)
        assert group.find("{*}animate") is None
        truth = seen_by(drawn.camera, points_of(shape) @ pose.rotation.T + pose.position)
        assert_same_outline(drawn.outline(group), truth, POINT)
    assert len(drawn.groups("seen")) > 0
    assert len(drawn.groups("floor")) == 1


@pytest.mark.parametrize("view", ["isometric", "xz"])
def test_what_is_carried_moves_with_the_tool(moved: Plan, view: str) -> None:
    """The ball rests, is carried, and rests elsewhere: at each time one of the three drawings is visible."""
    drawn = Drawn(moved, view)
    parts = drawn.groups("ball")
    assert len(parts) == 3
    states = np.array([drawn.shown(part) for part in parts])
    assert (states.sum(axis=0) == 1).all()
    (carried,) = (k for k, part in enumerate(parts) if part.find("{*}polygon/{*}animate") is not None)
    begin, end = moved.trajectory.departures[1], moved.trajectory.arrivals[3]
    step = drawn.times[1]
    inside = (drawn.times > begin + step) & (drawn.times < end - step)
    assert states[carried][inside].all()
    apart = (drawn.times < moved.trajectory.arrivals[1]) | (drawn.times > moved.trajectory.departures[3] + step)
    assert not states[carried][apart].any()

    tools = [tool_pose(moved.path.robot, position) for position in drawn.positions]
    centers = np.array([tool.position + tool.rotation @ IN_TOOL for tool in tools])
    polygon = parts[carried].find("{*}polygon")
    assert polygon is not None
    animate = polygon.find("{*}animate")
    assert animate is not None
    rows = np.rint(np.array(str(animate.get("keyTimes")).split(";"), dtype=float) * (len(tools) - 1)).astype(int)
    outlines = drawn.values(polygon)
    assert len(outlines) == len(rows)
    assert set(np.flatnonzero(inside)) <= set(rows)
    for row, outline in zip(rows, outlines, strict=True):
        if states[carried][row]:
            truth = seen_by(drawn.camera, points_of(Sphere(RADIUS)) + centers[row])
            assert_same_outline(outline, truth, POINT)

    for part in parts:
        if part is not parts[carried]:
            tool = tool_pose(moved.path.robot, np.array(ROWS[0] if drawn.shown(part)[0] else ROWS[2]))
            truth = seen_by(drawn.camera, points_of(Sphere(RADIUS)) + tool.position + tool.rotation @ IN_TOOL)
            assert_same_outline(drawn.outline(part), truth, POINT)


def test_a_moving_object_is_drawn_along_its_motion() -> None:
    velocity, start = np.array([0.0, 0.3, 0.1]), Pose.from_rpy([0.3, -1.2, 0.9], (0.3, -0.2, 0.5))
    crate = SceneObject("crate", [BOX], start, motion=ConstantVelocity(velocity, 0.4))
    solved = plan(
        PlanningProblem(load_robot("kuka_kr16_2"), [JointWaypoint(row) for row in ROWS], scene=Scene([crate])),
        Trapezoidal(),
    )
    drawn = Drawn(solved, "isometric")
    (group,) = drawn.groups("crate")
    polygon = group.find("{*}polygon")
    assert polygon is not None
    outlines = drawn.values(polygon)
    assert len(outlines) == len(drawn.times)
    for time, outline in zip(drawn.times[::20], outlines[::20], strict=True):
        center = start.position + velocity * min(time, 0.4)
        truth = seen_by(drawn.camera, points_of(BOX) @ start.rotation.T + center)
        assert_same_outline(outline, truth, POINT)


def test_things_are_drawn_in_front_of_what_they_hide(moved: Plan) -> None:
    """The view onto xz looks along y: the box is behind the robot, and the post, drawn thinly, before it."""
    drawn = Drawn(moved, "xz")
    order = [element.get("data-name") for element in drawn.root]
    arm = next(k for k, e in enumerate(drawn.root) if "polyline" in e.tag and e.find("{*}animate") is not None)
    box, post = order.index("box & more"), order.index("post")
    assert box < arm < post
    thick, thin = (float(drawn.root[k].find("{*}path").get("fill-opacity")) for k in (box, post))
    assert thin < thick
    names = [text.text for text in drawn.root.findall("{*}text")]
    assert {"box & more", "post"} <= set(names)
    assert "ball" not in names


def test_without_a_scene_nothing_is_drawn_around(moved: Plan) -> None:
    robot = load_robot("kuka_kr16_2")
    alone = plan(PlanningProblem(robot, [JointWaypoint(ROWS[0]), JointWaypoint(ROWS[1])]), Trapezoidal())
    assert "data-name" not in alone.animate().svg
    assert "data-name" in moved.animate().svg
