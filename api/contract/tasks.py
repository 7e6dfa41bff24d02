"""Requests and answers of tasks in any order."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from api.contract.answers import PlanAnswer  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.backends import Backend  # noqa: TC001
from api.contract.parts.common import Answer, Pose, Schema
from api.contract.parts.free_motions import FreeMotion
from api.contract.parts.goal_sets import Waypoint  # noqa: TC001
from api.contract.parts.waypoints import JointMotion, SingleWaypoint
from api.contract.requests import ProblemRequest, default_backend

MOST_TASKS = 500
"""The most tasks of a request."""

TaskName = Annotated[str, Field(min_length=1, max_length=200)]

MOST_TOOLS = 50
"""The most tools of a request."""

ChangeWaypoints = Annotated[list[SingleWaypoint], Field(min_length=1, max_length=100)]

Travel = Annotated[JointMotion | FreeMotion, Field(discriminator="kind")]


class OrderTask(Schema):
    """Waypoints that belong together: a point, a line or seam, a closed contour, or a pick with its place."""

    waypoints: Annotated[list[Waypoint], Field(min_length=1, max_length=100)]
    """The waypoints in the given direction. The robot gets to the first one by the `travel` motion. They have no `tool`
    of their own, and no actions if the task is reversible or closed. Such
    tasks have no goal sets (`any_of`), either. The options of a task make at most 100 combinations."""
    name: TaskName | None = None
    """A name for `after`, which the answer repeats."""
    reversible: bool = False
    """Whether the robot may visit the waypoints in the opposite direction."""
    closed: bool = False
    """Whether the waypoints are a closed contour. The robot enters it at any of them and leaves it there. The motion of
    the first waypoint closes the contour: it starts at the last one."""
    after: Annotated[list[TaskName], Field(max_length=MOST_TASKS)] = Field(default_factory=list)
    """The names of tasks that come before this one."""
    group: TaskName | None = None
    """The name of a group, whose tasks follow each other without another task between; null or omitted: none."""
    tool: TaskName | None = None
    """The name of the tool of the task, one of `tools`; null or omitted: the robot's own."""


class ChangeableTool(Schema):
    """A tool of a tool changer, which the robot takes before its tasks and puts back after them."""

    name: TaskName
    """The name that tasks give."""
    tool: Pose
    """The pose of the tool centre point in the tip frame (m)."""
    take: ChangeWaypoints
    """The waypoints at which the robot takes the tool, with what else happens there: dwells, actions, its `payload`, an
    object to `attach`. The robot gets to the first one by the `travel` motion. Poses are for the robot's own tool."""
    put_back: ChangeWaypoints
    """The waypoints at which the robot puts the tool back, likewise."""


class OrderRequest(ProblemRequest):
    """Tasks in any order, with the robot, limits and options of a plan."""

    start: SingleWaypoint
    """The start of the trajectory."""
    end: SingleWaypoint | None = None
    """The end of the trajectory; null or omitted: at the last task."""
    tasks: Annotated[list[OrderTask], Field(min_length=1, max_length=MOST_TASKS)]
    """The tasks. All their waypoints together are at most as many as a plan may have."""
    tools: Annotated[list[ChangeableTool], Field(max_length=MOST_TOOLS)] = Field(default_factory=list)
    """The tools of a tool changer, which tasks name. The robot changes them between tasks, as seldom as pays."""
    mounted: TaskName | None = None
    """The name of the tool that the robot has at the start, and at the `end` if there is one. Null or omitted: the
    robot's own."""
    travel: Travel | None = None
    """The motion to the first waypoint of each task; null or omitted: free in a scene, otherwise straight in joint
    space."""
    backend: Backend = Field(
        default_factory=lambda: default_backend(), description="The back end of the plan; omitted: the cubic."
    )
    time_budget: Annotated[float, Field(gt=0.0, le=600.0)] | None = None
    """The time after which the search ends with the best order so far, s. The answer then depends on the speed of the
    service. It also ends before the `deadline`. Omitted: only the deadline ends it early."""


class OrderedTask(Schema):
    """A task at its place in the order."""

    task: int
    """The index of the task in the request."""
    name: str | None
    """The name of the task; null: it has none."""
    tool: str | None
    """The name of its tool; null: the robot's own."""
    reversed: bool
    """Whether the robot visits the waypoints in the opposite direction."""
    first: int
    """The index of the waypoint at which the robot enters a closed contour; else 0."""
    options: list[int]
    """The index of the chosen option for each goal set of the task, in order."""


class OrderAnswer(Answer):
    """Tasks in order, with the certified plan."""

    order: list[OrderedTask]
    """The tasks in the order of the plan."""
    bound: float
    """A lower bound on the duration of all orders, s. It compares all solutions of the inverse kinematics, turned
    nearest to the start, and steps of 30 degrees of a free turn about the tool."""
    gap: float
    """The share of the plan's duration above the bound, from 0 to 1."""
    planned_orders: int
    """The number of orders that were planned or refused. Detours and refused motions lead to other orders."""
    request: dict[str, Any]
    """The tasks in this order as a body of POST /v1/trajectories, which gives the same plan."""
    plan: PlanAnswer
    """The certified plan."""
