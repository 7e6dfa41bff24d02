"""The warning that an attached object is far away from the tool, by the distances in the requests."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.scene import Attach, AttachedObject, Scene, SceneObject
from planner.shapes import Box, Capsule
from planner.spatial import Pose

CODE = "attached_far_from_tool"
HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]


def warned(scene: Scene, **taken: list[Attach]) -> list[str]:
    waypoints = [planner.JointWaypoint(HOME, **taken), planner.JointWaypoint([0.3, *HOME[1:]])]  # type: ignore[arg-type]
    problem = planner.PlanningProblem(planner.load_robot("ur5e"), waypoints, scene=scene)
    return [warning.message for warning in planner.plan(problem).warnings if warning.code == CODE]


@pytest.mark.parametrize(("away", "is_far"), [(0.1, False), (0.3, False), (1.5, True)])
def test_a_box_that_is_attached_from_the_start(away: float, is_far: bool) -> None:
    found = warned(Scene(attached=[AttachedObject("part", [Box([0.1, 0.1, 0.1])], Pose([0.0, 0.0, away]))]))
    assert bool(found) == is_far
    if is_far:
        said = float(found[0].partition("at least ")[2].split()[0])
        assert away - 0.05 * np.sqrt(3.0) - 0.02 <= said <= away - 0.05


def test_a_bar_whose_end_is_at_the_tool() -> None:
    bar = Capsule(0.02, 1.0)
    assert not warned(Scene(attached=[AttachedObject("bar", [bar], Pose([0.0, 0.0, 0.55]))]))


def test_an_object_that_is_taken_far_away() -> None:
    robot = planner.load_robot("ur5e")
    tool = planner.tool_pose(robot, HOME)
    for away, is_far in ((0.1, False), (1.5, True)):
        standing = Pose(tool.position - np.array([0.0, away, 0.0]))
        found = warned(Scene([SceneObject("part", [Box([0.05, 0.05, 0.05])], standing)]), attach=[Attach("part")])
        assert bool(found) == is_far
