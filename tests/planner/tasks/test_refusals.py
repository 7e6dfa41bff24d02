"""Faults and refusals of tasks: each names its task, and what of it is wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planner
from tests.planner.tasks.parts import DOWN, HOME, ROBOT, joint_waypoint, over_table

POINT = joint_waypoint(np.array(HOME) + 0.1)
START = planner.PlanningProblem(ROBOT, ["home"])
LINE = planner.LinearMotion()
RELATIVE = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, 0.1)))


def task(*waypoints: planner.Waypoint, **fields: Any) -> planner.Task:
    return planner.Task(waypoints or (POINT,), **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("tasks", "field"),
    [
        ([], ("tasks",)),
        ([planner.Task([])], ("tasks", 0, "waypoints")),
        ([task(closed=True)], ("tasks", 0, "closed")),
        ([task(), task(replace(POINT, tool=planner.Pose(np.zeros(3))))], ("tasks", 1, "waypoints", 0, "tool")),
        ([task(RELATIVE)], ("tasks", 0, "waypoints", 0)),
        ([task(actions=[planner.SetOutput(planner.AtWaypoint(1), "a", True)])], ("tasks", 0, "actions", 0, "at")),
        ([task(actions=[planner.SetOutput(planner.AtTime(0.1), "a", True)])], ("tasks", 0, "actions", 0, "at")),
        ([task(actions=[planner.Wait(planner.AtWaypoint(0), 1.0)])], ("tasks", 0, "actions", 0, "duration")),
        (
            [task(POINT, POINT, reversible=True, actions=[planner.SetOutput(planner.AtWaypoint(0), "a", True)])],
            ("tasks", 0, "reversible"),
        ),
        (
            [
                task(),
                task(
                    planner.PoseWaypoint(over_table(0.4, 0.0)),
                    planner.PoseWaypoint(
                        over_table(0.4, 0.1), motion=planner.PolylineMotion([over_table(0.4, -0.1)], 0.01)
                    ),
                    reversible=True,
                ),
            ],
            ("tasks", 1, "waypoints", 1, "motion", "poses", 0),
        ),
        (
            [
                task(
                    planner.PoseWaypoint(over_table(0.4, 0.0), motion=planner.CircularMotion(over_table(0.4, 0.0))),
                    planner.PoseWaypoint(over_table(0.4, 0.1), motion=LINE),
                    closed=True,
                )
            ],
            ("tasks", 0, "waypoints", 0, "motion", "via"),
        ),
        ([task(POINT, RELATIVE, reversible=True)], ("tasks", 0, "waypoints", 1)),
        (
            [task(POINT, planner.PoseWaypoint(over_table(0.4, 0.0), motion=LINE, free="rotation_z"))],
            ("tasks", 0, "waypoints", 1, "free"),
        ),
        ([task(POINT, replace(POINT, put_down=True), reversible=True)], ("tasks", 0, "reversible")),
        ([task(replace(POINT, motion=LINE))], ("tasks", 0, "waypoints", 0, "motion")),
        (
            [task(replace(POINT, transition=planner.BlendTransition(0.01)))],
            ("tasks", 0, "waypoints", 0, "transition"),
        ),
        ([task(name="a"), task(name="a")], ("tasks", 1, "name")),
        ([task(), task(after=["b"])], ("tasks", 1, "after", 0)),
        ([task(name="a", after=["a"])], ("tasks", 0, "after", 0)),
        ([task(name="a", after=["b"]), task(name="b", after=["a"])], ("tasks", 0, "after")),
        (
            [task(name="a", group="g"), task(name="b", after=["a"]), task(name="c", group="g", after=["b"])],
            ("tasks", 0, "after"),
        ),
        ([task(), task(planner.JointWaypoint([0.0]))], ("tasks", 1, "waypoints", 0, "position")),
        ([task(POINT, replace(POINT, minimum_duration=-1.0))], ("tasks", 0, "waypoints", 1, "minimum_duration")),
    ],
)
def test_fault_names_its_field(tasks: list[planner.Task], field: tuple[str | int, ...]) -> None:
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.order_tasks(START, tasks)
    assert [fault.field for fault in refusal.value.faults] == [field]


@pytest.mark.parametrize(
    ("changes", "travel", "field"),
    [
        ({"waypoints": ["home", "home", "home"]}, None, ("waypoints",)),
        ({"waypoints": ["home", RELATIVE]}, None, ("waypoints", 1)),
        ({"actions": [planner.SetOutput(planner.AtTime(0.0), "a", True)]}, None, ("actions", 0, "at")),
        ({}, LINE, ("travel",)),
        ({}, planner.FreeMotion(optimise="duration", time_budget=1.0), ("travel", "time_budget")),
    ],
)
def test_fault_of_the_problem_names_its_field(
    changes: dict[str, Any], travel: planner.Motion | None, field: tuple[str | int, ...]
) -> None:
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.order_tasks(replace(START, **changes), [task()], travel=travel)
    assert field in [fault.field for fault in refusal.value.faults]


def test_refusal_of_an_unreachable_task_names_it() -> None:
    far = planner.PoseWaypoint(planner.Pose(np.array([2.0, 0.0, 0.1]), DOWN))
    with pytest.raises(planner.UnreachableWaypoint, match=r"waypoint 0 of task 1 \('far'\)"):
        planner.order_tasks(START, [task(), task(far, name="far")])


@pytest.mark.large_only
def test_refusal_of_a_seam_that_leaves_the_workspace_names_its_waypoint() -> None:
    start = planner.PoseWaypoint(over_table(0.5, 0.0))
    end = planner.PoseWaypoint(over_table(1.5, 0.0), motion=LINE)
    with pytest.raises(planner.PlanningError, match="waypoint 1 of task 0"):
        planner.order_tasks(START, [task(start, end)])


@pytest.mark.large_only
def test_straight_travel_that_would_collide_leads_to_another_order() -> None:
    wall = planner.SceneObject("wall", [planner.Box((0.2, 0.02, 0.5))], planner.Pose(np.array([0.5, 0.0, 0.2])))
    scene = planner.Scene([wall])
    left, right = over_table(0.5, -0.2), over_table(0.5, 0.2)
    above = planner.Pose(np.array([0.45, 0.0, 0.75]), DOWN)
    problem = replace(START, scene=scene)
    tasks = [planner.Task([planner.PoseWaypoint(pose)]) for pose in (left, right, above)]
    straight = planner.order_tasks(problem, tasks, "trapezoidal", travel=planner.JointMotion())
    assert straight.plan.certificate.clearance is not None
    assert straight.planned_orders > 1
    free = planner.order_tasks(problem, tasks, "trapezoidal")
    assert free.plan.trajectory.duration <= straight.plan.trajectory.duration * 1.001
    assert free.bound <= free.plan.trajectory.duration


@pytest.mark.parametrize("seconds", [-1.0, 0.0, float("nan")])
def test_a_time_that_is_not_positive_is_a_fault(seconds: float) -> None:
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.order_tasks(START, [task()], seconds=seconds)
    assert [fault.field for fault in refusal.value.faults] == [("seconds",)]
