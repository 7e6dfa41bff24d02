"""Faults of tasks, and refusals of their plans in terms of the tasks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from planner.backends.base import BackEnd
from planner.errors import InvalidProblem, PlanningError
from planner.fields import FieldPath
from planner.planning.option_choice import check_options
from planner.problems.actions import Action, AtWaypoint
from planner.problems.any_of import AnyOf, WaypointSequence, goal_set_faults, waypoints_of
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import (
    AnyWaypoint,
    CartesianMotion,
    JointMotion,
    Motion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
    Waypoint,
)
from planner.problems.transitions import StopTransition
from planner.spatial import Pose
from planner.tasks.changes import ToolsOfTasks
from planner.tasks.options import MOST_COMBINATIONS, ChosenTask, number_of_combinations, with_options
from planner.tasks.rules import Rules, rule_faults
from planner.tasks.task import ARRIVAL, ChangeableTool, Origin, Task

W = TypeVar("W", bound=Waypoint)
"""The kind of a waypoint."""

NO_GOAL_SETS = "must be one joint position or pose here; got a goal set"
"""The fault of a waypoint with options at the start, at the end, and where a tool is changed."""

NO_TOOL = "must be omitted: name one of `tools` as the tool of the task"
"""The fault of a waypoint with a tool centre point of its own."""

MOST_GIVEN = 2
"""The largest number of waypoints of a problem besides its tasks: the start and the end."""


def refuse_faults(
    problem: PlanningProblem,
    tasks: Sequence[Task],
    travel: Motion,
    backend: BackEnd,
    seconds: float | None,
    changeable: Sequence[ChangeableTool] = (),
    mounted: str | None = None,
) -> None:
    """Refuse tasks that contradict themselves, each other or the robot.

    Raises:
        InvalidProblem: With every fault found.
        PlanningError: As `check_problem` does, for the tasks in some allowed order.
    """
    faults: list[tuple[FieldPath, str]] = [
        *dict.fromkeys(_faults(problem, tasks, travel, changeable)),
        *rule_faults(tasks),
        *_tool_faults(tasks, changeable, mounted),
    ]
    if seconds is not None and not seconds > 0.0:
        faults.append((("seconds",), f"must be greater than 0; got {seconds:g}"))
    if faults:
        raise InvalidProblem(faults)
    tools = ToolsOfTasks.of(problem, tasks, changeable, mounted)
    order = [0, *(index + 1 for index in Rules.of(tasks).ordered(range(len(tasks)), min)), tools.end]
    before: int | None = None
    waypoints: list[AnyWaypoint] = []
    actions: list[Action] = []
    lists: dict[str, list[FieldPath]] = {"waypoints": [], "actions": []}
    for index in tools.with_changes(order if len(problem.waypoints) > 1 else order[:-1]):
        task = tools.tasks[index]
        fields = [tools.origin(index, k).field for k in range(len(task.waypoints))]
        given = index in (0, tools.end)
        actions += task.actions_after(len(waypoints))
        own = [(*fields[0][:-2], "actions", k) for k in range(len(task.actions))]
        lists["actions"] += [("actions",)] * len(task.actions) if given else own
        lists["waypoints"] += fields
        first, *others = task.waypoints
        motion = first.motion if given else travel
        waypoints += [_reached(first, motion, tools.new_point(before, index)), *others]
        before = index
    try:
        check_options(replace(problem, waypoints=waypoints, actions=actions), backend)
    except InvalidProblem as refusal:
        raise InvalidProblem([(_in_task(fault.field, lists), fault.message) for fault in refusal.faults]) from None


def _reached(waypoint: W, motion: Motion, tool: Pose | None) -> W:
    """Return a waypoint to which a motion leads, with a tool; options keep the tool before."""
    if not isinstance(waypoint, AnyOf):
        return replace(waypoint, motion=motion, tool=tool)
    options: list[AnyWaypoint | WaypointSequence] = []
    for option in waypoint.options:
        first, *others = waypoints_of(option)
        first = replace(first, motion=motion)
        options.append(WaypointSequence([first, *others]) if isinstance(option, WaypointSequence) else first)
    return replace(waypoint, options=options)


def _in_task(field: FieldPath, lists: Mapping[str, Sequence[FieldPath]]) -> FieldPath:
    """Return the field of a task for a field of the lists of all waypoints and all actions."""
    return (*lists[str(field[0])][int(field[1])], *field[2:]) if len(field) > 1 and field[0] in lists else field


def _faults(
    problem: PlanningProblem, tasks: Sequence[Task], travel: Motion, changeable: Sequence[ChangeableTool]
) -> Iterator[tuple[FieldPath, str]]:
    if not 1 <= len(problem.waypoints) <= MOST_GIVEN:
        yield ("waypoints",), f"must be the start, and the end if there is one; got {len(problem.waypoints)} waypoints"
    for k, waypoint in enumerate(problem.waypoints):
        if isinstance(waypoint, RelativeWaypoint):
            yield ("waypoints", k), "must not be relative: the order decides what comes before it"
        elif isinstance(waypoint, AnyOf):
            yield ("waypoints", k), NO_GOAL_SETS
        elif waypoint.tool is not None:
            yield ("waypoints", k, "tool"), NO_TOOL
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
        always_leads_on = len(problem.waypoints) > 1 and not changeable
        yield from _task_faults(task, ("tasks", i))
        faults = list(_faults_of_options(task, problem))
        yield from ((("tasks", i, *fault), message) for fault, message in faults)
        for chosen in [] if faults else _with_each_option(problem, task):
            yield from _waypoint_faults(chosen, ("tasks", i), always_leads_on=always_leads_on)


def _tool_faults(
    tasks: Sequence[Task], changeable: Sequence[ChangeableTool], mounted: str | None
) -> Iterator[tuple[FieldPath, str]]:
    """Find tools that are unknown, named twice or taken in a way that depends on the order."""
    names = [one.name for one in changeable]
    asked: list[tuple[FieldPath, str | None]] = [(("mounted",), mounted)]
    asked += [(("tasks", i, "tool"), task.tool) for i, task in enumerate(tasks)]
    for field, name in asked:
        if name is not None and name not in names:
            yield field, f"must be the name of one of `tools`; got {name!r}"
    for k, one in enumerate(changeable):
        if one.name in names[:k]:
            yield ("tools", k, "name"), f"must occur once; {one.name!r} is also the name of another tool"
        for part in ("take", "put_back"):
            way: Task = getattr(one, part)
            if way != Task(way.waypoints, actions=way.actions):
                yield ("tools", k, part), "must have waypoints and actions alone"
            yield from _task_faults(way, ("tools", k, part))
            sets = [i for i, waypoint in enumerate(way.waypoints) if isinstance(waypoint, AnyOf)]
            yield from ((("tools", k, part, "waypoints", i), NO_GOAL_SETS) for i in sets)
            if not sets:
                plain = ChosenTask(way, tuple(("waypoints", i) for i in range(len(way.waypoints))))
                yield from _waypoint_faults(plain, ("tools", k, part), always_leads_on=False)


def _faults_of_options(task: Task, problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the goal sets of a task."""
    sets = [k for k, waypoint in enumerate(task.waypoints) if isinstance(waypoint, AnyOf)]
    if not sets:
        return
    if task.reversible or task.closed:
        either = "reversible" if task.reversible else "closed"
        yield (either,), "must be false for a task with a goal set"
    yield from goal_set_faults(replace(problem, waypoints=task.waypoints, actions=()))
    count = number_of_combinations(task)
    if count > MOST_COMBINATIONS:
        yield ("waypoints", sets[-1], "options"), f"must make at most {MOST_COMBINATIONS} combinations; got {count}"


def _with_each_option(problem: PlanningProblem, task: Task) -> Iterator[ChosenTask]:
    """Yield the task with options, until each option has occurred."""
    sizes = [len(waypoint.options) for waypoint in task.waypoints if isinstance(waypoint, AnyOf)]
    for row in range(max(sizes, default=1)):
        yield with_options(problem, task, tuple(min(row, size - 1) for size in sizes))


def _task_faults(task: Task, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    if not task.waypoints:
        yield (*field, "waypoints"), "must have at least one waypoint"
    if task.closed and len(task.waypoints) == 1:
        yield (*field, "closed"), "must be false for a single waypoint: a contour has two or more"
    either = "reversible" if task.reversible else "closed"
    if task.actions and (task.reversible or task.closed):
        yield (*field, either), "must be false for a task with actions"
    for k, action in enumerate(task.actions):
        if not isinstance(action.at, AtWaypoint) or not 0 <= action.at.waypoint < len(task.waypoints):
            yield (*field, "actions", k, "at"), "must be the index of a waypoint of the task"


def _waypoint_faults(chosen: ChosenTask, field: FieldPath, *, always_leads_on: bool) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the waypoints of a task that its goal sets and the problem alone do not show."""
    task = chosen.task
    either = "reversible" if task.reversible else "closed"
    for k, waypoint in enumerate(task.waypoints):
        there = (*field, *chosen.paths[k])
        if waypoint.earliest_arrival or waypoint.latest_arrival is not None:
            name = "earliest_arrival" if waypoint.earliest_arrival else "latest_arrival"
            yield (*there, name), "must be left out: the order decides when the robot arrives"
        if not k and len(chosen.paths[k]) > len(("waypoints", k)):
            for name in ("duration", "minimum_duration"):
                if getattr(waypoint, name):
                    yield (*there, name), "must be omitted in an option that begins a task"
        if waypoint.tool is not None:
            yield (*there, "tool"), NO_TOOL
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
        if may_end and not always_leads_on and not isinstance(waypoint.transition, StopTransition):
            yield (*there, "transition"), "must be a stop: the trajectory may end or the tool change here"


def in_tasks(
    refusal: PlanningError, tasks: Sequence[Task], changeable: Sequence[ChangeableTool], origins: Sequence[Origin]
) -> PlanningError:
    """Return a refusal of a plan that names tasks in place of the plan's waypoints.

    Args:
        refusal: The refusal, with indices of the plan's waypoints.
        tasks: The tasks.
        changeable: The tools that the robot takes and puts back.
        origins: The origin of each waypoint of the plan.
    """

    def name(index: int) -> str:
        origin = origins[index]
        if origin.tool is not None:
            done = "put back" if origin.change == "put_back" else "taken"
            return f"{origin.waypoint} where tool {changeable[origin.tool].name!r} is {done}"
        if origin.task is None:
            return "of the end" if origin.waypoint else "of the start"
        called = tasks[origin.task].name
        of = f"task {origin.task}" if called is None else f"task {origin.task} ({called!r})"
        option = f" (option {origin.option[1]})" if origin.option else ""
        return f"{origin.waypoint}{option} of {of}"

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
    origin = origins[int(field[1])]
    if origin.motion is not None and field[2:3] and field[2] in ARRIVAL:
        origin = origin._replace(waypoint=origin.motion)
    return (*origin.field, *field[2:])
