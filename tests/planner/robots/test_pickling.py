"""Robots, problems and plans are pickled, and the copies plan the same."""

from __future__ import annotations

import pickle
from typing import Any, TypeVar

import numpy as np
import pytest

import planner
from planner.problems.motion_around import FreeMotion

T = TypeVar("T")


def again(value: T) -> T:
    """Return a value after pickling and unpickling."""
    result: Any = pickle.loads(pickle.dumps(value))  # noqa: S301 - what this test wrote
    return result  # type: ignore[no-any-return]


def plan_of(robot: planner.Robot) -> planner.Plan:
    """Return a plan of a short joint motion from the middle of the limits."""
    start = robot.middle
    points = [planner.JointWaypoint(start), planner.JointWaypoint(np.clip(start + 0.01, *limits_of(robot)))]
    return planner.plan(planner.PlanningProblem(robot, points))


def limits_of(robot: planner.Robot) -> tuple[np.ndarray, np.ndarray]:
    return robot.limit("lower"), robot.limit("upper")


@pytest.mark.parametrize("id", planner.catalogue_ids())
def test_every_robot_of_the_catalogue_plans_the_same_after_pickling(id: str) -> None:
    robot = planner.load_robot(id)
    plan = plan_of(robot)  # what was computed with it goes along, or not
    for other in (again(robot), again(plan).problem.robot):
        assert plan_of(other).trajectory.duration == plan.trajectory.duration
        assert (
            planner.tool_pose(other, robot.middle).position == planner.tool_pose(robot, robot.middle).position
        ).all()
    loaded = again(plan)
    assert (loaded.trajectory.coefficients == plan.trajectory.coefficients).all()
    assert loaded.certificate == plan.certificate


def test_a_robot_with_meshes_has_its_shapes_after_pickling() -> None:
    robot = planner.load_robot("kuka_kr16_2").derived(id="own", tool=planner.Pose([0.0, 0.0, 0.1]))
    shapes = robot.collision_shapes
    other = again(robot)
    assert [shape.shape for shape in other.collision_shapes] == [shape.shape for shape in shapes]
    assert [pair.reason for pair in other.collision_pairs] == [pair.reason for pair in robot.collision_pairs]


def test_a_plan_around_an_object_is_pickled_and_planned_again() -> None:
    robot = planner.load_robot("ur5e")
    hull = planner.ConvexHull(np.vstack([np.zeros(3), 0.1 * np.eye(3)]))
    scene = planner.Scene(
        [planner.SceneObject("thing", [hull, planner.Box([0.1, 0.1, 0.1])], planner.Pose([2.0, 0, 0]))]
    )
    points = [
        planner.JointWaypoint([0.0, -1.5, 1.0, 0.0, 0.5, 0.0]),
        planner.JointWaypoint([0.5, -1.2, 1.0, 0.0, 0.5, 0.0], motion=FreeMotion()),
    ]
    plan = planner.plan(planner.PlanningProblem(robot, points, scene=scene))
    loaded = again(plan)
    assert planner.plan(loaded.problem).trajectory.duration == plan.trajectory.duration
    assert loaded.certificate == plan.certificate
