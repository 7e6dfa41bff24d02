"""Checks of the robot's actions at its stops: outputs and waits, handled objects, tool changes."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from planner.problems.actions import AtWaypoint, Wait
from planner.problems.motion_around import FreeMotion
from planner.problems.transitions import StopTransition
from planner.scene.faults import handling_faults
from planner.tolerances import DURATION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fields import FieldPath
    from planner.problems.problem import PlanningProblem


def action_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find actions at waypoints that do not exist, and waits longer than the dwell of their waypoint."""
    waited = [0.0] * len(problem.waypoints)
    for i, action in enumerate(problem.actions):
        at = action.at
        if isinstance(at, AtWaypoint) and not 0 <= at.waypoint < len(waited):
            yield ("actions", i, "at", "waypoint"), f"must be a waypoint from 0 to {len(waited) - 1}"
        elif isinstance(action, Wait) and not isinstance(at, AtWaypoint):
            yield ("actions", i, "at"), "must be a waypoint: the robot waits only at waypoints"
        elif isinstance(action, Wait) and isinstance(at, AtWaypoint):
            waited[at.waypoint] += action.duration
            dwell = problem.waypoints[at.waypoint].dwell
            if waited[at.waypoint] > dwell * (1.0 + DURATION_TOLERANCE):
                yield ("actions", i, "duration"), f"must fit into the dwell of the waypoint, {dwell:g} s"


def objects_handled_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find objects that the robot cannot take or put down at their waypoint."""
    if problem.scene is not None:
        yield from handling_faults(problem.robot, problem.scene, problem.handling)
    for i, (waypoint, done) in enumerate(zip(problem.waypoints, problem.handling, strict=True)):
        if not done.is_none and problem.scene is None:
            yield (
                ("waypoints", i, "attach" if done.taken else "detach"),
                "needs a scene with the objects",
            )
        elif not done.is_none and not isinstance(waypoint.transition, StopTransition):
            yield (
                ("waypoints", i, "transition"),
                "must be a stop: the robot takes or puts down an object only where it stops",
            )


def process_force_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find process forces on no segment, on free motions, or that change where the robot does not stop."""
    waypoints = problem.waypoints
    if waypoints and waypoints[0].process_force is not None:
        yield ("waypoints", 0, "process_force"), "the first waypoint ends no segment: the tool exerts no force"
    for i, waypoint in enumerate(waypoints):
        field = "waypoints", i, "process_force"
        if waypoint.process_force is not None and isinstance(waypoint.motion, FreeMotion):
            yield field, "a free motion cannot have a process force; give its waypoint another motion"
        if waypoint.process_force is not None and not waypoint.process_force.is_finite:
            yield field, "must have finite numbers"
    for i, (before, after) in enumerate(pairwise(waypoints[1:]), 1):
        if before.process_force != after.process_force and not isinstance(before.transition, StopTransition):
            yield ("waypoints", i, "transition"), "must be a stop: the process force changes here"


def tool_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find waypoints with a tool change but no stop."""
    for i, (before, after) in enumerate(pairwise(problem.robots)):
        if before is not after and not isinstance(problem.waypoints[i].transition, StopTransition):
            text = "must be a stop: the tool changes here"
            yield ("waypoints", i, "transition"), text
