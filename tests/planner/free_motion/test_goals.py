"""A free motion to a goal region may end at several joint positions of it; all of them fulfil the request."""

from __future__ import annotations

import numpy as np

import planner
from planner.free_motion.ways import MOST_GOALS, apart, ends_of_way, find_ways
from planner.problems.regions import Region
from planner.robots import load_robot
from planner.scene import AttachedObject, Scene, SceneObject
from planner.shapes import Box
from planner.spatial import Pose, rotation_from_rpy

DOWN = rotation_from_rpy(np.pi, 0.0, 0.0)
SEED = 218
"""A case in which 60 motions led to a goal of the region, and to none of the pose that is nearest in it."""

MOST_CHECKS = 1000


def bar_among_boxes() -> planner.PlanningProblem:
    """A bar of half a metre at the tool, among six boxes, may be turned about the vertical where it is brought."""
    rng, goal_rng = np.random.default_rng(SEED), np.random.default_rng(SEED + 1000)
    boxes = [
        SceneObject(
            f"box {k}",
            [Box(rng.uniform(0.05, 0.3, 3))],
            Pose([rng.uniform(-0.5, 0.7), rng.uniform(-0.6, 0.6), rng.uniform(0.0, 0.8)]),
        )
        for k in range(6)
    ]
    bar = AttachedObject("bar", (Box([0.5, 0.02, 0.02]),), Pose([0.0, 0.0, 0.02]))
    start = Pose([rng.uniform(0.3, 0.6), rng.uniform(-0.35, 0.35), rng.uniform(0.2, 0.5)], DOWN)
    goal = Pose([goal_rng.uniform(-0.6, 0.6), goal_rng.uniform(-0.6, 0.6), goal_rng.uniform(0.1, 0.5)], DOWN)
    free = planner.FreeMotion(most_checks=MOST_CHECKS)
    turned = planner.PoseWaypoint(goal, free=Region(rotation_z=(-np.pi, np.pi)), motion=free)
    return planner.PlanningProblem(load_robot("ur5"), [planner.PoseWaypoint(start), turned], scene=Scene(boxes, [bar]))


def test_every_goal_is_in_the_region() -> None:
    problem = bar_among_boxes()
    goal = problem.waypoints[1]
    assert isinstance(goal, planner.PoseWaypoint)
    goals = ends_of_way(problem, (), 1).goals
    assert len(goals) > 4
    for position in goals:
        reached = planner.tool_pose(load_robot("ur5"), position)
        assert reached.rotation is not None
        np.testing.assert_allclose(reached.position, goal.pose.position, atol=1e-6)
        np.testing.assert_allclose(reached.rotation[:, 2], DOWN[:, 2], atol=1e-6)


def test_the_goal_that_is_reached_is_planned() -> None:
    """The end of the path is one of the goals, and the plan is certified."""
    problem = bar_among_boxes()
    (found,) = find_ways(problem)
    goals = ends_of_way(problem, (), 1).goals
    assert np.abs(goals - found.positions[-1]).max(axis=1).min() < 1e-9
    plan = planner.plan(problem, "quintic")
    assert plan.certificate.clearance is not None


def test_goals_are_apart_and_few() -> None:
    rng = np.random.default_rng(3)
    positions = rng.uniform(-3.0, 3.0, (400, 6))
    found = apart(positions, np.zeros(6))
    assert len(found) == MOST_GOALS
    nearest = positions[np.linalg.norm(positions, axis=1).argmin()]
    assert (found[0] == nearest).all()
    assert len(apart(np.tile(positions[:1], (50, 1)), np.zeros(6))) == 1
