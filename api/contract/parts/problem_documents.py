"""Problem documents (RFC 9457), the answers to refused requests."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from api.contract.parts.common import Answer, QuaternionOrientation


class Fault(Answer):
    """One fault of a request."""

    pointer: str
    """The place of the fault, as a JSON pointer (RFC 6901) into the request; empty: the request as a whole."""
    message: str
    """The fault, for a person."""


class RemedyAnswer(Answer):
    """A change that makes the request feasible."""

    change: str
    """The field to change, as a JSON pointer (RFC 6901) into the request."""
    value: Any = Field(description="The value to put there, in the unit of that field.")
    explanation: str
    """The reason, for a person."""


class ModelFinding(Answer):
    """One remark about a robot model."""

    code: str
    """The stable name of this kind of remark, in snake case."""
    severity: str
    """`error` (the model is refused), `warning` (it is used as it is) or `info` (a default was filled in)."""
    subject: str | None
    """The name of the joint or link; null: the whole model."""
    message: str
    """The remark, for a person."""


class PoseOrPosition(Answer):
    """A pose of the tool in the base frame, or its position alone."""

    position: list[float]
    """The origin of the tool x, y, z, m."""
    orientation: QuaternionOrientation | None
    """The orientation of the tool, as a quaternion of norm 1; null: any orientation."""


class NearestToWaypoint(Answer):
    """The nearest reachable pose to an unreachable one."""

    pose: PoseOrPosition
    """The pose that the tool reaches."""
    position: list[float]
    """The joint position that reaches it, rad or m per joint."""
    position_distance: float
    """Its distance from the requested position, m."""
    orientation_distance: float | None
    """Its angle from the requested orientation, rad; null: none was requested."""


class PathPoint(Answer):
    """The last point of a tool motion that the joints can follow, or the last point that a search reached."""

    fraction: float
    """The fraction of the motion before this point, 0 to 1, without unit. For a search: the fraction of the
    joint-space distance to the goal that it covered."""
    pose: PoseOrPosition
    """The pose of the tool there."""
    position: list[float]
    """The joint position there, rad or m per joint."""


class OptionOutcome(Answer):
    """The outcome of one option of a goal set."""

    status: Literal["chosen", "longer", "refused", "untried"]
    """`chosen`: the plan has this option. `longer`: its estimated duration is longer, or equal and it comes later.
    `refused`: it has no plan; `code` says why. `untried`: planning ended before."""
    estimated_duration: float | None
    """The estimated duration of the trajectory with this option and the chosen options of other goal sets, s. Motions
    have the limits of velocity and acceleration, and free motions are straight. Null: the option is refused."""
    code: str | None
    """With `refused`: the code of the problem, such as `unreachable_waypoint` or `collision`."""
    message: str | None
    """With `refused`: the reason, for a person."""


class Choice(Answer):
    """The choice at one goal set."""

    waypoint: int
    """The index of the goal set in the request."""
    option: int | None
    """The index of the chosen option; null: none has a plan."""
    options: list[OptionOutcome]
    """The outcomes of all options, in the order of the request."""


class ProblemDocument(Answer):
    """The problem (RFC 9457), with fields for its place and its remedies where they apply."""

    type: str
    """The kind of problem, as a URN that ends with the code."""
    title: str
    """The kind of problem, for a person."""
    status: int
    """The HTTP status of this answer."""
    detail: str
    """The description of this occurrence, for a person."""
    instance: str
    """The path of the request."""
    code: str
    """The stable name of the kind of problem, in snake case; programs decide by it."""
    robot: int | None = None
    """With a cell: the index of the robot at fault, counted from 0. Absent: the problem is between two robots."""
    waypoint: int | None = None
    """The index of the waypoint at fault, counted from 0."""
    segment: int | None = None
    """The index of the segment at fault; segment i goes from waypoint i to waypoint i + 1."""
    joint: str | None = None
    """The name of the joint at fault."""
    value: float | None = None
    """The value that exceeds the limit, in the limit's unit."""
    limit: float | None = None
    """The limit that it exceeds, in the unit of its quantity (rad, m, s, kg, N, N m and what follows from them)."""
    time: float | None = None
    """The time at which it exceeds the limit, s from the start of the trajectory."""
    pair: list[str] | None = None
    """With a collision: the names of the two links or objects."""
    depth: float | None = None
    """With a collision: the violation of their margin, m."""
    point: list[float] | None = None
    """With a collision: a point of the first of the two, x, y, z in the base frame, m. In the world, if two robots of a
    cell touch."""
    position: list[float] | None = None
    """With a collision: the joint position, rad or m for each joint."""
    checks: int | None = None
    """With `no_path_found`: the number of motions that the search checked."""
    enclosed_by: list[str] | None = None
    """With `no_path_found` where it is proved that no path exists: the names of the blocking objects."""
    remedies: list[RemedyAnswer] | None = None
    """Changes that each make the request feasible alone; changes of several durations belong together, and so do those
    of several limits or payloads. Every one has been planned and stays within what requests may contain."""
    choices: list[Choice] | None = None
    """With goal sets: the outcomes of their options. The problem is that of the first options that were planned."""
    hints: list[RemedyAnswer] | None = None
    """Changes that remove the cause of this refusal, but lead to another refusal or to an answer that is too large."""
    errors: list[Fault] | None = None
    """With `invalid_request`: the faults, at most 50."""
    findings: list[ModelFinding] | None = None
    """With `invalid_robot_model`: the reasons, at most 50."""
    nearest: NearestToWaypoint | None = None
    """With `unreachable_waypoint`: the nearest reachable pose."""
    place: PathPoint | None = None
    """The place on a motion."""
    formats: list[str] | None = None
    """With `not_acceptable`: the available formats."""
