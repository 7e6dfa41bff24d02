"""Requests and answers of cells: several robots on one clock."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from api.contract.answers import PlanAnswer  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.backends import Backend  # noqa: TC001
from api.contract.parts.common import DEFAULT_DEADLINE, Answer, Deadline, FrameName, Pose, Schema
from api.contract.parts.scenes import (
    MOST_ATTACHED,
    AllowedPairs,
    AttachedObject,
    ClearanceAnswer,
    Margin,
    SceneOrId,
)
from api.contract.requests import RobotProblem, WaypointList, default_backend

MOST_ROBOTS = 4
"""The most robots of a cell."""

MOST_MEETINGS = 100
"""The most meetings of a cell."""

MemberName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]


class CellMember(WaypointList, RobotProblem):
    """A robot of a cell with its waypoints, as in a plan request. The scene, the frames and the deadline are common."""

    name: MemberName
    """The name of the robot in the cell, which no other robot of the cell has."""
    attached: Annotated[list[AttachedObject], Field(max_length=MOST_ATTACHED)] = Field(default_factory=list)
    """The attached objects of this robot."""
    allowed_pairs: AllowedPairs = Field(default_factory=list)
    """Pairs of links of this robot, objects or its attached objects that may touch, by name; shape (pairs, 2), without
    unit."""
    backend: Backend = Field(
        default_factory=lambda: default_backend(), description="What puts time on the path; omitted: the cubic."
    )


class CellRequest(Schema):
    """Two to four robots in one world. Each has its own path and waits where it rests."""

    robots: Annotated[list[CellMember], Field(min_length=2, max_length=MOST_ROBOTS)]
    """The robots. The `mounting` of each is the pose of its base in the world. All their waypoints together are at most
    as many as a plan may have."""
    scene: SceneOrId | None = None
    """The objects around all robots, each in a frame of `frames` or in the world. At most one robot takes an object
    (`attach`), unless robots hand it over at one of the `meetings`. `attached` and `allowed_pairs` are empty: each
    robot has its own. Objects may move: each robot is proved clear of them with its waits, until the last one ends.
    Omitted: no objects."""
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the `frame` of waypoints and objects. Waypoints
    may also name `base` and `world`."""
    margin: Margin = 0.0
    """The least distance between robots, m."""
    allowed_pairs: AllowedPairs = Field(default_factory=list)
    """Pairs of bodies of two robots that may touch, by the names `robot/link` or `robot/object`; shape (pairs, 2),
    without unit. A gripper and the object that it takes from another robot are such a pair."""
    meetings: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=MOST_MEETINGS)] = Field(
        default_factory=list
    )
    """Names of waypoints at which robots meet, in the order of time. All robots with a waypoint of that name wait for
    each other there. None goes on before all have arrived and rested for the longest of their dwells. An object that
    one of them puts down there (`detach`) and another one takes (`attach`) moves on with the other one."""
    skew: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    """The largest time by which the controller of one robot may start before or after that of another, s. It must be 0
    with moving objects in the scene."""
    deadline: Deadline = DEFAULT_DEADLINE


class PlannedMember(Answer):
    """A robot of a cell with its certified trajectory."""

    name: str
    """The name of the robot in the cell."""
    duration_alone: float
    """The duration of its trajectory without waits, s."""
    waits: list[float]
    """The wait at each waypoint of the request before the robot goes on, s. The `dwell` of the waypoint comes first."""
    plan: PlanAnswer
    """Its certified trajectory with the waits."""


class CellClearance(Answer):
    """The proved clearance between two robots at all times, for every start skew."""

    robots: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The names of the robots."""
    clearance: ClearanceAnswer
    """The distance between both, with the objects that they carry or have put down. Names of its pair are
    `robot/link`. Its time is on the clock of the first robot. `upper` is measured without a skew."""


class CellMeeting(Answer):
    """A meeting of robots."""

    name: str
    """The name of the waypoints at which they meet."""
    waypoints: dict[str, int]
    """The index of that waypoint in the list of each robot that takes part, by the name of the robot."""
    time: float
    """When all of them have arrived and rested there, s. No one goes on before."""


class CellAnswer(Answer):
    """The trajectories of several robots on one clock."""

    duration: float
    """The time from the common start to the end of the last robot, s."""
    robots: list[PlannedMember]
    """The robots in the order of the request. All trajectories start at time 0."""
    clearances: list[CellClearance]
    """One entry for each pair of robots."""
    meetings: list[CellMeeting]
    """The meetings in the order of the request."""
