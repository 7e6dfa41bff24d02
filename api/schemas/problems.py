"""Problem documents (RFC 9457)."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from api.schemas.common import Answer


class Fault(Answer):
    """One thing that is wrong with a request."""

    pointer: str
    """Where: JSON pointer (RFC 6901) into the request; empty: the whole of it."""
    message: str


class RemedyAnswer(Answer):
    """A change to the request that would make it feasible."""

    change: str
    """JSON pointer into the request."""
    value: Any = Field(description="What to put there.")
    explanation: str


class ModelFinding(Answer):
    """One remark about a robot model."""

    code: str
    severity: str
    """`error` (the model is refused), `warning` (used as it is) or `info` (a default was filled in)."""
    subject: str | None
    """The joint or link it is about; null: the whole model."""
    message: str


class Problem(Answer):
    """What went wrong (RFC 9457), and where they apply, the fields that say where and what to do."""

    type: str
    """URN of the kind of problem."""
    title: str
    """The kind of problem, for a person."""
    status: int
    """The HTTP status."""
    detail: str
    """This problem, for a person."""
    instance: str
    """Path of the request."""
    code: str
    """Stable name of the kind, in snake case."""
    waypoint: int | None = None
    """Index of the waypoint at fault."""
    segment: int | None = None
    """Index of the segment at fault; segment i goes from waypoint i to waypoint i + 1."""
    joint: str | None = None
    """Name of the joint at fault."""
    value: float | None = None
    """The value that breaks the limit."""
    limit: float | None = None
    """The limit that it breaks."""
    time: float | None = None
    """s, when."""
    remedies: list[RemedyAnswer] | None = None
    """Changes that would make the request feasible."""
    errors: list[Fault] | None = None
    """With `invalid_request`: every fault found."""
    findings: list[ModelFinding] | None = None
    """With `invalid_robot_model`: why."""
    nearest: Any = Field(default=None, description="With `unreachable_waypoint`: the nearest pose found.")
    place: Any = Field(default=None, description="Where on a motion: fraction of the way, pose and joint position.")
    formats: list[str] | None = None
    """With `not_acceptable`: the formats that there are."""
