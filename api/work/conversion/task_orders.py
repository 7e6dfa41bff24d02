"""Tasks of a request as the library's, and their order as a plan request."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import planner
from api.contract import requests
from api.work.answers.values import pose_answer
from api.work.conversion.actions import to_actions, with_waits
from api.work.conversion.poses import to_pose
from api.work.conversion.problems import to_planning_problem, to_waypoints
from planner.errors import InvalidProblem
from planner.problems.motion_around import FreeMotion
from planner.tasks import ARRIVAL

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from api.contract.parts.goal_sets import Waypoint
    from api.contract.tasks import OrderRequest
    from planner import FieldPath
    from planner.robots import Robot
    from planner.tasks import Origin

GOAL_FIELDS = ("kind", "pose", "frame", "free", "configuration", "external", "move", "position")
"""The fields of waypoints that a joint position replaces."""

ENDS = ("start", "end")
"""The fields of the request for the waypoints of the library's problem."""

IN_CHANGE = 3
"""The place of `waypoints` in the library's fields of changes: tools, number, change, waypoints."""

RULES = ("name", "reversible", "closed", "after", "group", "tool")
"""The fields of a task besides its waypoints."""


@contextmanager
def at_field(moved: Callable[[FieldPath], FieldPath]) -> Iterator[None]:
    """Let the faults of a refusal point to other fields."""
    try:
        yield
    except InvalidProblem as refusal:
        refusal.faults = tuple(fault._replace(field=moved(fault.field)) for fault in refusal.faults)
        raise


def in_request(field: FieldPath) -> FieldPath:
    """Return the field of the request for a field of the library's start, end and tools."""
    if field[0] == "tools" and len(field) > IN_CHANGE and field[IN_CHANGE] == "waypoints":
        return (*field[:IN_CHANGE], *field[IN_CHANGE + 1 :])
    return (ENDS[int(field[1])], *field[2:]) if field[0] == "waypoints" and len(field) > 1 else field


class TaskProblem(NamedTuple):
    """The arguments of `order_tasks` in a request: the problem with start and end, the tasks and the tools."""

    problem: planner.PlanningProblem
    tasks: tuple[planner.Task, ...]
    tools: tuple[planner.ChangeableTool, ...]


def to_task_problem(request: OrderRequest, robot: Robot) -> TaskProblem:
    """Make the problem with start and end, the tasks, and the tools.

    Raises:
        InvalidProblem: With every fault of the waypoints.
    """
    _refuse_unordered(request)
    shared = {name: getattr(request, name) for name in requests.ProblemRequest.model_fields}
    ends = [request.start] if request.end is None else [request.start, request.end]
    plan = requests.PlanRequest.model_construct(**shared, waypoints=ends, actions=[], duration=None)
    problem = to_planning_problem(plan, robot)
    tasks = []
    for index, task in enumerate(request.tasks):
        with at_field(partial(_in_part, ("tasks", index))):
            ordered = _to_task(task.waypoints, request, problem.robot)
        rules: dict[str, Any] = {name: getattr(task, name) for name in RULES}
        tasks.append(replace(ordered, **rules))
    tools = []
    for index, one in enumerate(request.tools):
        ways = []
        for part in ("take", "put_back"):
            with at_field(partial(_in_part, ("tools", index, part))):
                ways.append(_to_task(getattr(one, part), request, problem.robot))
        tools.append(planner.ChangeableTool(one.name, to_pose(one.tool), *ways))
    return TaskProblem(problem, tuple(tasks), tuple(tools))


def most_waypoints(waypoint: Waypoint) -> int:
    """Return the number of waypoints of the longest option; 1 for a waypoint that is no goal set."""
    options = waypoint.options if waypoint.kind == "any_of" else ()
    return max((len(option.waypoints) for option in options if option.kind == "sequence"), default=1)


def _to_task(waypoints: Sequence[Waypoint], request: OrderRequest, robot: Robot) -> planner.Task:
    """Make a task of waypoints with their actions."""
    actions = to_actions((), waypoints)
    return planner.Task(with_waits(to_waypoints(waypoints, robot, request.frames), actions), actions=actions)


def _in_part(part: FieldPath, field: FieldPath) -> FieldPath:
    """Return the field in the library for a field of the waypoints of a task or a change."""
    return (*part, *field) if field[0] == "waypoints" else field


def _refuse_unordered(request: OrderRequest) -> None:
    """Refuse fields without a meaning in another order.

    Raises:
        InvalidProblem: A contour or reversible task has poses in different frames.
    """
    faults: list[tuple[FieldPath, str]] = []
    for index, task in enumerate(request.tasks):
        frames = [getattr(waypoint, "frame", None) for waypoint in task.waypoints]
        for k in range(len(task.waypoints)):
            field = "tasks", index, "waypoints", k
            if (task.reversible or task.closed) and frames[k] != frames[0]:
                faults.append(((*field, "frame"), "must be the frame of the first waypoint, for the other direction"))
    if faults:
        raise InvalidProblem(faults)


def to_plan_request(document: Mapping[str, Any], ordered: planner.OrderedTasks) -> dict[str, Any]:
    """Write the tasks of a request in their order as a plan request, both as JSON."""
    shared = {name: value for name, value in document.items() if name in requests.PlanRequest.model_fields}
    pairs = zip(ordered.origins, ordered.problem.waypoints, strict=True)
    return shared | {"waypoints": [_ordered_waypoint(document, ordered, *pair) for pair in pairs]}


def _with_option(task: Mapping[str, Any], origin: Origin) -> Mapping[str, Any]:
    """Return the waypoint of a task, or of its chosen option: the last has the actions of the goal set."""
    goal_set: dict[str, Any] = task["waypoints"][origin.waypoint]
    found: Any = goal_set
    for step in origin.option:
        found = found[step]
    own: dict[str, Any] = found
    if not origin.option:
        return own
    option = goal_set["options"][int(origin.option[1])]
    is_last = own is option or own is option["waypoints"][-1]
    return own | ({"actions": goal_set["actions"]} if is_last and "actions" in goal_set else {})


def _ordered_waypoint(
    document: Mapping[str, Any], ordered: planner.OrderedTasks, origin: Origin, planned: planner.AnyWaypoint
) -> dict[str, Any]:
    """Write a waypoint of the ordered list, with a joint position where the library has chosen one."""
    task: Mapping[str, Any] = {} if origin.task is None else document["tasks"][origin.task]
    if origin.tool is not None and origin.change is not None:
        task = {"waypoints": document["tools"][origin.tool][origin.change]}
    if not task:
        own = arrival = document[ENDS[origin.waypoint]]
    else:
        own, first = _with_option(task, origin), {} if task.get("closed") else task["waypoints"][0]
        arrival = own if origin.option else first if origin.motion is None else task["waypoints"][origin.motion]
    waypoint = {name: value for name, value in own.items() if name not in ARRIVAL}
    waypoint |= {name: value for name, value in arrival.items() if name in ARRIVAL}
    if planned.tool is not None:
        waypoint["tool"] = pose_answer(planned.tool)
    if task and origin.motion is None:
        in_scene = document.get("scene") is not None
        waypoint["motion"] = document.get("travel") or {"kind": "free" if in_scene else "joint"}
    elif origin.task is not None and "poses" in waypoint.get("motion", {}):
        step = -1 if ordered.reversed[ordered.order.index(origin.task)] else 1
        waypoint["motion"] = waypoint["motion"] | {"poses": waypoint["motion"]["poses"][::step]}
    if not isinstance(planned, planner.JointWaypoint):
        return waypoint
    if isinstance(planned.motion, planner.JointMotion) and not isinstance(planned.motion, FreeMotion):
        waypoint["motion"] = {"kind": "joint", "turns": planned.motion.turns}
    kept = {name: value for name, value in waypoint.items() if name not in GOAL_FIELDS}
    return {"kind": "joint", "position": list(planned.position)} | kept
