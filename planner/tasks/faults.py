"""Faults of tasks, and refusals of their plans in terms of the tasks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from planner.backends.base import BackEnd
from planner.errors import InvalidProblem, PlanningError
from planner.fields import FieldPath
from planner.problems.actions import AtWaypoint
from planner.problems.any_of import AnyOf
from planner.problems.check import check_problem
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import (
    CartesianMotion,
    JointMotion,
    Motion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import StopTransition
from planner.tasks.rules import Rules, rule_faults
from planner.tasks.task import ARRIVAL, Origin, Task, given_task

NO_GOAL_SETS = "must be one joint position or pose; got a goal set"
"""The fault of a waypoint with options."""

MOST_GIVEN = 2
"""The largest number of waypoints of a problem besides its tasks: the start and the end."""


def refuse_faults(
    problem: PlanningProblem, tasks: Sequence[Task], travel: Motion, backend: BackEnd, seconds: float | None
) -> None:
    """Refuse tasks that contradict themselves, each other or the robot.

    Raises:
        InvalidProblem: With every fault found.
        PlanningError: As `check_problem` does, for the tasks in some allowed order.
    """
    faults = [*_faults(problem, tasks, travel), *rule_faults(tasks)]
    if seconds is not None and not seconds > 0.0:
        faults.append((("seconds",), f"must be greater than 0; got {seconds:g}"))
    if faults:
        raise InvalidProblem(faults)
    fields: list[FieldPath] = [("waypoints", 0)]
    waypoints, actions = [problem.waypoints[0]], given_task(problem, 0).actions_after(0)
    of_actions: list[FieldPath] = [("actions",)] * len(actions)
    for index in Rules.of(tasks).ordered(range(len(tasks)), min):
        first, *others = tasks[index].waypoints
        actions += tasks[index].actions_after(len(waypoints))
        of_actions += [("tasks", index, "actions", k) for k in range(len(tasks[index].actions))]
        waypoints += [replace(first, motion=travel), *others]
        fields += [("tasks", index, "waypoints", k) for k in range(len(tasks[index].waypoints))]
    if len(problem.waypoints) > 1:
        actions += given_task(problem, 1).actions_after(len(waypoints))
        of_actions += [("actions",)] * (len(actions) - len(of_actions))
        waypoints.append(problem.waypoints[1])
        fields.append(("waypoints", 1))
    lists = {"waypoints": fields, "actions": of_actions}
    try:
        check_problem(replace(problem, waypoints=waypoints, actions=actions), backend)
    except InvalidProblem as refusal:
        raise InvalidProblem([(_in_task(fault.field, lists), fault.message) for fault in refusal.faults]) from None


def _in_task(field: FieldPath, lists: Mapping[str, Sequence[FieldPath]]) -> FieldPath:
    """Return the field of a task for a field of the lists of all waypoints and all actions."""
    return (*lists[str(field[0])][int(field[1])], *field[2:]) if len(field) > 1 and field[0] in lists else field


def _faults(problem: PlanningProblem, tasks: Sequence[Task], travel: Motion) -> Iterator[tuple[FieldPath, str]]:
    if not 1 <= len(problem.waypoints) <= MOST_GIVEN:
        yield ("waypoints",), f"must be the start, and the end if there is one; got {len(problem.waypoints)} waypoints"
    for k, waypoint in enumerate(problem.waypoints):
        if isinstance(waypoint, RelativeWaypoint):
            yield ("waypoints", k), "must not be relative: the order decides what comes before it"
        if isinstance(waypoint, AnyOf):
            yield ("waypoints", k), NO_GOAL_SETS
    for k, action in enumerate(problem.actions):
        if action.at not in (AtWaypoint(0), AtWaypoint(len(problem.waypoints) - 1)):
            yield ("actions", k, "at"), "must be the start or the end: the order decides the rest"
    if not isinstance(travel, JointMotion):
        yield ("travel",), "must be a joint motion or a free motion"
    if isinstance(travel, FreeMotion) and travel.time_budget is not None:
        yield ("travel", "time_budget"), "must be omitted; limit the time of the whole search instead"
    for i, thing in enumerate(() if problem.scene is None else problem.scene.objects):
        if thing.motion is not None:
            yield ("scene", "objects", i, "motion"), "must be left out: tasks in any order need static objects"
    if not tasks:
        yield ("tasks",), "must have at least one task"
    for i, task in enumerate(tasks):
        yield from _task_faults(task, ("tasks", i), has_end=len(problem.waypoints) > 1)


def _task_faults(task: Task, field: FieldPath, *, has_end: bool) -> Iterator[tuple[FieldPath, str]]:
    if not task.waypoints:
        yield (*field, "waypoints"), "must have at least one waypoint"
        return
    if task.closed and len(task.waypoints) == 1:
        yield (*field, "closed"), "must be false for a single waypoint: a contour has two or more"
    either = "reversible" if task.reversible else "closed"
    if task.actions and (task.reversible or task.closed):
        yield (*field, either), "must be false for a task with actions"
    for k, action in enumerate(task.actions):
        if not isinstance(action.at, AtWaypoint) or not 0 <= action.at.waypoint < len(task.waypoints):
            yield (*field, "actions", k, "at"), "must be the index of a waypoint of the task"
    for k, waypoint in enumerate(task.waypoints):
        there = (*field, "waypoints", k)
        if not isinstance(waypoint, AnyOf) and (waypoint.earliest_arrival or waypoint.latest_arrival is not None):
            name = "earliest_arrival" if waypoint.earliest_arrival else "latest_arrival"
            yield (*there, name), "must be left out: the order decides when the robot arrives"
        if isinstance(waypoint, AnyOf):
            yield there, NO_GOAL_SETS
        if waypoint.tool is not None:
            yield (*there, "tool"), "must be omitted: all tasks have the tool of the robot"
        if isinstance(waypoint, RelativeWaypoint) and (k == 0 or task.reversible or task.closed):
            why = "first one of a task" if k == 0 else f"task that is {either}"
            yield there, f"must not be relative in the {why}"
        is_followed = isinstance(waypoint.motion, CartesianMotion) and (k > 0 or task.closed)
        if isinstance(waypoint, PoseWaypoint) and waypoint.free is not None and is_followed:
            yield (*there, "free"), "must be omitted where a tool motion ends"
        handles = waypoint.attach or waypoint.detach or waypoint.payload is not None or waypoint.put_down
        if handles and (task.reversible or task.closed):
            yield (*field, either), "must be false for a task that takes or puts down an object or a payload"
        if not k and not task.closed and not isinstance(waypoint.motion, JointMotion):
            yield (*there, "motion"), "must be omitted: the motion to a task is the `travel` motion"
        may_end = task.closed or k == len(task.waypoints) - 1 or (task.reversible and k == 0)
        if may_end and not has_end and not isinstance(waypoint.transition, StopTransition):
            yield (*there, "transition"), "must be a stop: without an end, the trajectory may end here"


def in_tasks(refusal: PlanningError, tasks: Sequence[Task], origins: Sequence[Origin]) -> PlanningError:
    """Return a refusal of a plan that names tasks in place of the plan's waypoints.

    Args:
        refusal: The refusal, with indices of the plan's waypoints.
        tasks: The tasks.
        origins: The origin of each waypoint of the plan.
    """

    def name(index: int) -> str:
        task, waypoint, _ = origins[index]
        if task is None:
            return "of the end" if waypoint else "of the start"
        called = tasks[task].name
        of = f"task {task}" if called is None else f"task {task} ({called!r})"
        return f"{waypoint} of {of}"

    if isinstance(refusal, InvalidProblem):
        return InvalidProblem([(_in_origin(fault.field, origins), fault.message) for fault in refusal.faults])
    text = refusal._text
    if refusal.waypoint is not None:
        text = text.replace("{waypoint}", name(refusal.waypoint))
    if refusal.segment is not None:
        end = min(refusal.segment + 1, len(origins) - 1)
        text = text.replace("{segment_end}", name(end)).replace("{segment}", f"to waypoint {name(end)}")
    return refusal.with_fields(_text=text, waypoint=None, segment=None, remedies=(), hints=())


def _in_origin(field: FieldPath, origins: Sequence[Origin]) -> FieldPath:
    """Return the field of a task or of the start or end for a field of the plan's waypoints."""
    if field[0] != "waypoints" or len(field) < 2 or int(field[1]) >= len(origins):
        return field
    task, waypoint, motion = origins[int(field[1])]
    if task is None:
        return ("waypoints", waypoint, *field[2:])
    if motion is not None and field[2:3] and field[2] in ARRIVAL:
        waypoint = motion
    return ("tasks", task, "waypoints", waypoint, *field[2:])
