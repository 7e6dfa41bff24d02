"""Time budgets of requests, within their deadlines."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from planner.planning import Budget
from planner.problems.any_of import AnyOf, WaypointSequence
from planner.problems.motion_around import FreeMotion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.cells import CellRobot
    from planner.problems.problem import AnyWaypoint, PlanningProblem

SHARE = 0.8
"""The share of the time until the deadline that budgets may use. The rest is for the attempt under way at their end,
and for the answer."""

LEAST = 1e-3
"""The time until a deadline that is counted with at least, s: there is no budget of no time."""


def attempts_until(deadline: float) -> Budget:
    """Return the budget of a plan whose attempts end before a deadline, s on the monotonic clock."""
    return Budget(seconds=SHARE * max(LEAST, deadline - time.monotonic()))


def within_deadline(problem: PlanningProblem, deadline: float) -> PlanningProblem:
    """Return a problem whose time budgets end before a deadline, s on the monotonic clock; shorter ones if need be."""
    left = SHARE * max(LEAST, deadline - time.monotonic())
    if problem.time_budget is not None:
        problem = replace(problem, time_budget=min(problem.time_budget, left))
    asked = sum(map(_budget, problem.waypoints))
    if asked <= left:
        return problem

    def shorter(waypoint: Any) -> Any:
        if isinstance(waypoint, AnyOf):
            return replace(waypoint, options=tuple(map(shorter, waypoint.options)))
        if isinstance(waypoint, WaypointSequence):
            return WaypointSequence(tuple(map(shorter, waypoint.waypoints)))
        motion = waypoint.motion
        if not isinstance(motion, FreeMotion) or motion.time_budget is None:
            return waypoint
        return replace(waypoint, motion=replace(motion, time_budget=motion.time_budget * left / asked))

    return replace(problem, waypoints=tuple(map(shorter, problem.waypoints)))


def within_shares(robots: Sequence[CellRobot], deadline: float) -> list[CellRobot]:
    """Return the robots of a cell with time budgets that end, in turn, before a deadline, s on the clock."""
    now = time.monotonic()
    share = now + (deadline - now) / (len(robots) + 1)  # the last share is for the waits
    return [replace(robot, problem=within_deadline(robot.problem, share)) for robot in robots]


def _budget(waypoint: AnyWaypoint | WaypointSequence) -> float:
    """Return the time budget, s, of the motion to a waypoint; of a goal set the largest of its options."""
    if isinstance(waypoint, AnyOf):
        return max(map(_budget, waypoint.options), default=0.0)
    if isinstance(waypoint, WaypointSequence):
        return sum(map(_budget, waypoint.waypoints))
    motion = waypoint.motion
    return motion.time_budget or 0.0 if isinstance(motion, FreeMotion) else 0.0
