"""What can be wrong with a planning problem; one class a kind, fields on each, no HTTP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


@dataclass(frozen=True)
class Remedy:
    """A change to the request that would make it feasible.

    Attributes:
        change: JSON pointer (RFC 6901) into the request, as `/waypoints/1/duration`.
        value: What to put there.
        explanation: Why that helps, for a person.
    """

    change: str
    value: Any
    explanation: str


class PlanningError(Exception):
    """A problem that has no plan, and why.

    Attributes:
        code: Stable name of the kind, in snake case.
        waypoint: Index of the waypoint at fault.
        segment: Index of the segment at fault; segment i goes from waypoint i to waypoint i + 1.
        joint: Name of the joint at fault.
        value: The value that breaks the limit (rad, m, s, ... as the message says).
        limit: The limit that it breaks.
        time: Where on the trajectory, s.
        remedies: Changes that would make the problem feasible.
        details: Further facts that belong to one kind only, ready for JSON.
    """

    code: ClassVar[str] = "planning_error"
    title: ClassVar[str] = "The request cannot be planned"

    def __init__(
        self,
        message: str,
        *,
        waypoint: int | None = None,
        segment: int | None = None,
        joint: str | None = None,
        value: float | None = None,
        limit: float | None = None,
        time: float | None = None,
        remedies: Iterable[Remedy] = (),
        details: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.waypoint = waypoint
        self.segment = segment
        self.joint = joint
        self.value = value
        self.limit = limit
        self.time = time
        self.remedies = tuple(remedies)
        self.details = dict(details or {})


class InvalidProblem(PlanningError):
    """The problem contradicts itself or its robot; every fault found is listed.

    Attributes:
        faults: Pairs of a JSON pointer into the request and a message.
        remedies: As of every error.
    """

    code = "invalid_request"
    title = "The request is not valid"

    def __init__(self, faults: Sequence[tuple[str, str]], remedies: Iterable[Remedy] = ()) -> None:
        super().__init__("; ".join(f"{pointer}: {message}" for pointer, message in faults), remedies=remedies)
        self.faults = tuple(faults)


class UnknownRobot(PlanningError):
    """No robot has this id."""

    code = "unknown_robot"
    title = "There is no such robot"


class InvalidRobotModel(PlanningError):
    """A robot description that cannot be used; `findings` says why."""

    code = "invalid_robot_model"
    title = "The robot model cannot be used"

    def __init__(self, message: str, findings: Sequence[Finding]) -> None:
        super().__init__(message)
        self.findings = tuple(findings)


class UnreachableWaypoint(PlanningError):
    """No joint position reaches the pose; `details["nearest"]` is the nearest pose found."""

    code = "unreachable_waypoint"
    title = "A waypoint cannot be reached"


class JointPositionLimit(PlanningError):
    """A waypoint or the way to it needs a joint beyond its position limits."""

    code = "joint_position_limit"
    title = "A joint would leave its position limits"


class ConfigurationChange(PlanningError):
    """A motion of the tool would have to change the branch of the inverse kinematics on its way."""

    code = "configuration_change"
    title = "A motion would change the arm's configuration"


class SingularPath(PlanningError):
    """A motion of the tool passes a singularity, where the arm cannot move the tool in some direction."""

    code = "singular_path"
    title = "A motion passes a singularity"


class MissingDynamics(PlanningError):
    """Torques were asked of a robot that has neither inertias nor a payload."""

    code = "missing_dynamics"
    title = "The robot has no inertias"


class InfeasibleDuration(PlanningError):
    """The duration asked for a segment is shorter than the limits allow."""

    code = "infeasible_duration"
    title = "A duration is too short for the limits"


class LimitsUnsatisfiable(PlanningError):
    """No duration, however long, keeps the limits."""

    code = "limits_unsatisfiable"
    title = "The limits cannot be kept"


@dataclass(frozen=True)
class Finding:
    """One remark about a robot model.

    Attributes:
        code: Stable name of the kind, in snake case.
        severity: `error` (the model is refused), `warning` (used as it is) or `info` (a default was filled in).
        subject: The joint or link it is about; None: the whole model.
        message: The remark, for a person.
    """

    code: str
    severity: str
    subject: str | None
    message: str
