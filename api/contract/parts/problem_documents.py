"""Problem documents (RFC 9457): what a client gets instead of an answer."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from api.contract.parts.common import Answer, QuaternionOrientation


class Fault(Answer):
    """One thing that is wrong with a request."""

    pointer: str
    """Where it is wrong, as a JSON pointer (RFC 6901) into the request; empty: the request as a whole."""
    message: str
    """What is wrong there, for a person."""


class RemedyAnswer(Answer):
    """A change to the request that would make it feasible."""

    change: str
    """What to change, as a JSON pointer (RFC 6901) into the request."""
    value: Any = Field(description="The value to put there, in the unit of that field.")
    explanation: str
    """Why that helps, for a person."""


class ModelFinding(Answer):
    """One remark about a robot model."""

    code: str
    """The stable name of this kind of remark, in snake case."""
    severity: str
    """`error` (the model is refused), `warning` (it is used as it is) or `info` (a default was filled in)."""
    subject: str | None
    """The name of the joint or link that the remark is about; null: the whole model."""
    message: str
    """The remark, for a person."""


class PoseOrPosition(Answer):
    """A pose of the tool in the base frame, or its position alone."""

    position: list[float]
    """The origin of the tool x, y, z, m."""
    orientation: QuaternionOrientation | None
    """The orientation of the tool, as a quaternion of norm 1; null: any orientation will do."""


class NearestToWaypoint(Answer):
    """The nearest pose found to one that cannot be reached."""

    pose: PoseOrPosition
    """The pose that the tool gets."""
    position: list[float]
    """The joint position that reaches it, rad or m per joint."""
    position_distance: float
    """Its distance from the position asked, m."""
    orientation_distance: float | None
    """Its angle from the orientation asked, rad; null: none was asked."""


class PathPoint(Answer):
    """The point up to which a motion of the tool can be followed, or up to which a way around was found."""

    fraction: float
    """The share of the motion that lies before it, 0 to 1; its unit is 1. Of a way around: how much nearer it is to the
    goal, as the joints go, than the start."""
    pose: PoseOrPosition
    """The pose of the tool there."""
    position: list[float]
    """The joint position there, rad or m per joint."""


class ProblemDocument(Answer):
    """What went wrong (RFC 9457), and where they apply, the fields that say where and what to do."""

    type: str
    """The kind of problem, as a URN that ends with the code."""
    title: str
    """The kind of problem, for a person."""
    status: int
    """The HTTP status of this answer."""
    detail: str
    """What happened this time, for a person."""
    instance: str
    """The path of the request."""
    code: str
    """The stable name of the kind of problem, in snake case; programs decide by it."""
    waypoint: int | None = None
    """The index of the waypoint at fault, counted from 0."""
    segment: int | None = None
    """The index of the segment at fault; segment i goes from waypoint i to waypoint i + 1."""
    joint: str | None = None
    """The name of the joint at fault."""
    value: float | None = None
    """The value that breaks the limit, in the limit's unit."""
    limit: float | None = None
    """The limit that it breaks, in the unit of its quantity (rad, m, s, kg, N, N m and what follows from them)."""
    time: float | None = None
    """When it breaks the limit, s from the start of the trajectory."""
    pair: list[str] | None = None
    """With a collision: the names of the two links or objects."""
    depth: float | None = None
    """With a collision: how much nearer than their margin they come, m."""
    point: list[float] | None = None
    """With a collision: a point of the first of the two there, x, y, z in the base frame, m."""
    position: list[float] | None = None
    """With a collision: the joint position there, rad or m per joint."""
    checks: int | None = None
    """With `no_path_found`: the number of motions that the search looked at."""
    enclosed_by: list[str] | None = None
    """With `no_path_found` where it is proved that there is no way at all: the names of the objects that leave none."""
    remedies: list[RemedyAnswer] | None = None
    """Changes to the request, each of which makes it feasible by itself; those of several durations do it together, and
    so do those of several limits, and of several payloads. All have been tried, and keep within what may be asked."""
    hints: list[RemedyAnswer] | None = None
    """Changes that mend what is refused here, but after each of which something else is refused, or an answer that is
    too long."""
    errors: list[Fault] | None = None
    """With `invalid_request`: the faults that were found, 50 at most."""
    findings: list[ModelFinding] | None = None
    """With `invalid_robot_model`: why the model cannot be used, 50 remarks at most."""
    nearest: NearestToWaypoint | None = None
    """With `unreachable_waypoint`: the nearest that the tool gets."""
    place: PathPoint | None = None
    """Where on a motion it happens."""
    formats: list[str] | None = None
    """With `not_acceptable`: the names of the formats that there are."""
