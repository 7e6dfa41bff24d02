"""Waypoints that are passed with a velocity."""

from __future__ import annotations

from dataclasses import replace

from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot

ROBOT = load_robot("ngv_refuelling_arm")
POSITIONS = ((0.1, -0.4, 0.2, 0.0, 0.3, 0.0), (0.5, -0.1, 0.4, 0.3, 0.1, -0.2), (0.7, 0.4, 0.1, 0.5, 0.4, -0.5))
VELOCITY = (0.6, 0.8, 0.1, 0.4, 0.0, -0.5)


def passing_at(velocity: tuple[float, ...], **more: object) -> PlanningProblem:
    """Return three waypoints, the second one passed at this velocity."""
    start, middle, end = map(JointWaypoint, POSITIONS)
    passed = replace(middle, transition=ThroughTransition(velocity))
    return PlanningProblem(ROBOT, [start, passed, end], **more)
