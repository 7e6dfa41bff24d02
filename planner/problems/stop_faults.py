"""What is wrong with what a robot is to do where it stops: actions, objects that are taken, tools that change."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from planner.problems.actions import AtWaypoint, Wait
from planner.problems.transitions import StopTransition
from planner.scene.faults import handling_faults
from planner.tolerances import DURATION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fields import FieldPath
    from planner.problems.problem import PlanningProblem


def action_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find actions at waypoints that there are not, and waits where the robot does not rest for as long."""
    waited = [0.0] * len(problem.waypoints)
    for i, action in enumerate(problem.actions):
        at = action.at
        if isinstance(at, AtWaypoint) and not 0 <= at.waypoint < len(waited):
            yield ("actions", i, "at", "waypoint"), f"the waypoints are 0 to {len(waited) - 1}"
        elif isinstance(action, Wait) and not isinstance(at, AtWaypoint):
            yield ("actions", i, "at"), "the robot waits at waypoints only: let this be one"
        elif isinstance(action, Wait) and isinstance(at, AtWaypoint):
            waited[at.waypoint] += action.duration
            dwell = problem.waypoints[at.waypoint].dwell
            if waited[at.waypoint] > dwell * (1.0 + DURATION_TOLERANCE):
                yield ("actions", i, "duration"), f"the robot rests for {dwell:g} s there, its dwell"


def objects_handled_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find objects that are taken or put down where that cannot be."""
    if problem.scene is not None:
        yield from handling_faults(problem.robot, problem.scene, problem.handling)
    for i, (waypoint, done) in enumerate(zip(problem.waypoints, problem.handling, strict=True)):
        if not done.is_none and problem.scene is None:
            yield (
                ("waypoints", i, "attach" if done.taken else "detach"),
                "there is no scene whose objects could be taken",
            )
        elif not done.is_none and not isinstance(waypoint.transition, StopTransition):
            yield ("waypoints", i, "transition"), "an object is taken or put down only where the robot stops"


def tool_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find waypoints that are passed without a stop where another tool goes on."""
    for i, (before, after) in enumerate(pairwise(problem.robots)):
        if before is not after and not isinstance(problem.waypoints[i].transition, StopTransition):
            text = "the robot has another tool from here on: it has to stop where its tool changes"
            yield ("waypoints", i, "transition"), text
