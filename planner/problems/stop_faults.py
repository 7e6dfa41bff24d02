"""Checks of what happens only at stops or between them: actions, handled objects, tool changes, shaped motions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from planner.fields import BACK_END, FieldPath
from planner.guarantees import END_OPTIONS, RAMP_OPTIONS, HasCapabilities
from planner.problems.actions import AtWaypoint, Wait
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import PlanningProblem
from planner.problems.transitions import StopTransition
from planner.scene.faults import handling_faults
from planner.tolerances import DURATION_TOLERANCE

MODE_RANGES = {"frequency": (0.1, 1000.0), "damping": (0.0, 0.2), "frequency_error": (0.0, 0.19)}
"""The least and the largest value of each number of a mode. With larger errors, three impulses leave more than 5 %."""


def action_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find actions at waypoints that do not exist, and waits longer than the dwell of their waypoint."""
    waited = [0.0] * len(problem.waypoints)
    for i, action in enumerate(problem.actions):
        at = action.at
        if isinstance(at, AtWaypoint) and not 0 <= at.waypoint < len(waited):
            yield ("actions", i, "at", "waypoint"), "must be the index of a waypoint of the request"
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


def vibration_faults(problem: PlanningProblem, backend: HasCapabilities) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the requested mode, and fields that a shaped trajectory cannot keep."""
    mode = problem.residual_vibration
    if mode is None:
        return
    numbers = ((name, getattr(mode, name), *ends) for name, ends in MODE_RANGES.items())
    wrong = [each for each in numbers if not each[2] <= each[1] <= each[3]]
    for name, number, least, most in wrong:
        yield ("residual_vibration", name), f"must be from {least:g} to {most:g}; got {number:g}"
    if wrong or not mode.suppress:
        return
    instead = "or set `residual_vibration.suppress` to false, which only reports the vibration."
    for i, waypoint in enumerate(problem.waypoints):
        if not isinstance(waypoint.transition, StopTransition):
            message = "must be a stop: suppression of residual vibration shapes motions from stop to stop. Stop here, "
            yield ("waypoints", i, "transition"), message + instead
        if waypoint.duration is not None:
            message = (
                f"must be left out: suppression of residual vibration lengthens each motion by {mode.period:.4g} s; "
                f"got {waypoint.duration:g}. Set a `minimum_duration` or the `duration` of the whole trajectory, "
            )
            yield ("waypoints", i, "duration"), message + instead
    for name in END_OPTIONS:
        if any(getattr(backend, name, None) or ()):
            message = "must be rest: suppression of residual vibration shapes motions from rest to rest. Leave it out, "
            yield (BACK_END, name), message + instead
    for name in RAMP_OPTIONS:
        if getattr(backend, name, None) is not None:
            message = (
                f"must be left out: suppression of residual vibration lengthens ramps by {mode.period:.4g} s; got "
                f"{getattr(backend, name):g}. Limit the acceleration instead, "
            )
            yield (BACK_END, name), message + instead
