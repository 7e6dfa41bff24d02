"""A fixed pose takes the branch whose next line is collision-free, checked by trying every branch as a start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.kinematics.inverse import all_solutions
from planner.robots import load_robot
from planner.scene import CollisionChecker, Scene, SceneObject, collisions_at
from planner.shapes import Box
from planner.spatial import Pose, rotation_from_rpy

DOWN = rotation_from_rpy(np.pi, 0.0, 0.0)


def pose_and_line(seed: int) -> planner.PlanningProblem:
    """Return a pose among six boxes, and a line of some 0.2 m from it."""
    rng = np.random.default_rng(seed)
    boxes = [
        SceneObject(
            f"box {k}",
            [Box(rng.uniform(0.05, 0.3, 3))],
            Pose([rng.uniform(-0.5, 0.7), rng.uniform(-0.6, 0.6), rng.uniform(0.0, 0.8)]),
        )
        for k in range(6)
    ]
    start = Pose([rng.uniform(0.3, 0.6), rng.uniform(-0.35, 0.35), rng.uniform(0.2, 0.5)], DOWN)
    end = planner.PoseWaypoint(Pose(start.position + rng.uniform(-0.25, 0.25, 3), DOWN), motion=planner.LinearMotion())
    return planner.PlanningProblem(load_robot("ur5"), [planner.PoseWaypoint(start), end], scene=Scene(boxes))


def has_a_branch(problem: planner.PlanningProblem) -> bool:
    """Tell whether any solution of the first pose, given as joint position, is planned."""
    first = problem.waypoints[0]
    assert isinstance(first, planner.PoseWaypoint)
    for solution in all_solutions(load_robot("ur5"), first.pose_in_base):
        try:
            planner.plan(replace(problem, waypoints=[planner.JointWaypoint(solution.tolist()), problem.waypoints[1]]))
        except planner.PlanningError:
            continue
        return True
    return False


@pytest.mark.parametrize("seed", [85, 96, 138, 21, 2])
def test_a_pose_before_a_line_is_planned_where_any_branch_is(seed: int) -> None:
    """The first three were refused as `collision`: the shortest branch cannot follow the line, but another one can."""
    problem = pose_and_line(seed)
    if not has_a_branch(problem):
        with pytest.raises(planner.PlanningError):
            planner.plan(problem)
        return
    trajectory = planner.plan(problem).trajectory
    positions = trajectory.evaluate(np.linspace(0.0, trajectory.duration, 400), [0])[0]
    assert set(collisions_at(CollisionChecker(load_robot("ur5"), problem.scene), positions)) == {None}


def test_a_requested_configuration_is_kept() -> None:
    """A branch that leads on is chosen within the requested configuration only."""
    problem = pose_and_line(85)
    chosen = planner.plan(problem).path.positions[0]
    first = problem.waypoints[0]
    (requested,) = planner.configurations(load_robot("ur5"), chosen[None])
    again = planner.plan(replace(problem, waypoints=[replace(first, configuration=requested), problem.waypoints[1]]))
    assert planner.configurations(load_robot("ur5"), again.path.positions[:1])[0] == requested
