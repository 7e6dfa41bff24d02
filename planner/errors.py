"""Refusals of a planning problem: one class for each kind, with its fields and remedies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, TypeVar

from planner.choices import Choice
from planner.fields import BACK_END, FieldPath, field_name, moved_path, with_field
from planner.spatial import FloatArray, Pose

T = TypeVar("T")
"""The type of a problem, or of a back end, in which a change is made."""


E = TypeVar("E", bound="PlanningError")
"""The kind of a refusal."""


@dataclass(frozen=True, eq=False)
class Remedy:
    """A change that would make a problem feasible.

    Attributes:
        field: Path of the changed field in the `PlanningProblem` or, with `"backend"` first, in the back end.
        value: The new value, of a type of the library: a number, a `Pose`, a `BlendTransition`.
        explanation: The effect of the change, for a person.
        duration: Duration of the trajectory with this remedy and the others of the refusal, s; None: no plan was made
            with it.
    """

    field: FieldPath
    value: Any
    explanation: str
    duration: float | None = None

    def applied_to(self, problem: T) -> T:
        """Make the change in a planning problem.

        Returns:
            The problem with this change; the same one if the change is one of the back end.
        """
        return problem if self.field[0] == BACK_END else with_field(problem, self.field, self.value)

    def applied_to_backend(self, backend: T) -> T:
        """Make the change in a back end.

        Returns:
            The back end with this change; the same one if the change is one of the problem.
        """
        return with_field(backend, self.field[1:], self.value) if self.field[0] == BACK_END else backend


def distinct(value: float, other: float) -> tuple[str, str]:
    """Write two numbers with at least six digits, and as many as distinguish them."""
    for digits in range(6, 18):
        texts = f"{value:.{digits}g}", f"{other:.{digits}g}"
        if texts[0] != texts[1]:
            break
    return texts


class Fault(NamedTuple):
    """A fault of one field.

    Attributes:
        field: Path of the field in the `PlanningProblem` or in the arguments of the function that was called.
        message: The fault, for a person.
    """

    field: FieldPath
    message: str


@dataclass(frozen=True, eq=False)
class NearestPose:
    """The reachable pose nearest to a pose that the arm cannot reach.

    Attributes:
        pose: The tool's pose, in the base frame; without a rotation if the request has none.
        position: (joints,), rad or m, where the tool has this pose.
        position_error: Distance from the requested pose, m.
        orientation_error: Angle from the requested orientation, rad; None: the request has none.
    """

    pose: Pose
    position: FloatArray
    position_error: float
    orientation_error: float | None


@dataclass(frozen=True, eq=False)
class PathPoint:
    """The last point of a tool motion that the joints can follow.

    Attributes:
        fraction: Fraction of the tool's path, from 0 to 1.
        pose: The tool's pose there, in the base frame.
        position: (joints,), rad or m: the joint position there.
    """

    fraction: float
    pose: Pose
    position: FloatArray


class PlanningError(Exception):
    """The refusal of a problem, with its reason.

    In the text passed to the constructor, `{waypoint}` and `{segment}` stand for the waypoint and the segment of the
    refusal. `{segment_end}` stands for the waypoint at the end of that segment.

    Attributes:
        code: Stable name of the kind, in snake case.
        title: The kind in a few words, for a person.
        message: The reason, for a person.
        waypoint: Index of the waypoint at fault.
        segment: Index of the segment at fault; segment i goes from waypoint i to waypoint i + 1.
        joint: Name of the joint at fault.
        robot: Index of the robot at fault in a cell.
        value: The value that breaks the limit (rad, m, s, ... as the message says).
        limit: The limit that it breaks.
        time: Time on the trajectory, s.
        nearest: The nearest pose found to one that cannot be reached.
        path_point: The last point of a tool motion that the joints can follow.
        remedies: Changes that would make the problem feasible.
        hints: Changes that remove the reason of this refusal; another refusal may follow.
        choices: The outcome of each option of the goal sets, if the problem has any.
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
        nearest: NearestPose | None = None,
        path_point: PathPoint | None = None,
        remedies: Iterable[Remedy] = (),
    ) -> None:
        super().__init__(message)
        self._text = message
        self.waypoint = waypoint
        self.segment = segment
        self.joint = joint
        self.robot: int | None = None
        self.value = value
        self.limit = limit
        self.time = time
        self.nearest = nearest
        self.path_point = path_point
        self.remedies = tuple(remedies)
        self.hints: tuple[Remedy, ...] = ()
        self.choices: tuple[Choice, ...] = ()

    @property
    def message(self) -> str:
        """The reason, for a person."""
        end = None if self.segment is None else self.segment + 1
        own = {"waypoint": self.waypoint, "segment": self.segment, "segment_end": end}
        text = self._text
        for name, number in own.items():
            text = text.replace(f"{{{name}}}", str(number))
        return text

    def __str__(self) -> str:
        """Return the message."""
        return self.message

    def with_remedies(self: E, remedies: Iterable[Remedy], hints: Iterable[Remedy] = ()) -> E:
        """Return the same refusal with other remedies and hints."""
        return self.with_fields(remedies=tuple(remedies), hints=tuple(hints))

    def numbered(self: E, numbers: Sequence[int]) -> E:
        """Return the same refusal with the numbers of waypoints in place of their indices.

        Args:
            numbers: Of all waypoints, ascending: corners of a detour have the number of the waypoint that it leads to.
        """
        return self.moved([("waypoints", number) for number in numbers])

    def moved(self: E, paths: Sequence[FieldPath]) -> E:
        """Return the same refusal of a problem whose waypoints have other paths in the request.

        Args:
            paths: Path in the request of each waypoint, ascending: `("waypoints", i)`, or a path that begins so.
        """
        last = len(paths) - 1
        return self.with_fields(
            waypoint=None if self.waypoint is None else paths[self.waypoint][1],
            segment=None if self.segment is None else int(paths[min(self.segment + 1, last)][1]) - 1,
            remedies=tuple(replace(remedy, field=moved_path(remedy.field, paths)) for remedy in self.remedies),
            hints=tuple(replace(hint, field=moved_path(hint.field, paths)) for hint in self.hints),
        )

    def with_fields(self: E, **fields: Any) -> E:
        """Return the same refusal with other values of some fields."""
        other = type(self).__new__(type(self), *self.args)
        other.__dict__.update(self.__dict__, **fields)
        return other.with_traceback(self.__traceback__)


class InvalidProblem(PlanningError):
    """The problem contradicts itself or its robot; the refusal lists every fault found.

    Attributes:
        faults: The faults, each with its field.
        remedies: Changes that would make the problem feasible.
    """

    code = "invalid_request"
    title = "The request is not valid"

    def __init__(self, faults: Iterable[tuple[FieldPath, str]], remedies: Iterable[Remedy] = ()) -> None:
        self.faults = tuple(Fault(*fault) for fault in faults)
        super().__init__("", remedies=remedies)

    @property
    def message(self) -> str:
        """The faults, for a person."""
        return "; ".join(f"{field_name(fault.field)}: {fault.message}" for fault in self.faults)

    def moved(self, paths: Sequence[FieldPath]) -> InvalidProblem:
        """Return the same refusal of a problem whose waypoints have other paths in the request."""
        faults = tuple(fault._replace(field=moved_path(fault.field, paths)) for fault in self.faults)
        return super().moved(paths).with_fields(faults=faults)


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
    """No joint position reaches the pose; `nearest` is the nearest pose found."""

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
    """The request limits or plots the torques of a robot with neither inertias nor a payload."""

    code = "missing_dynamics"
    title = "The robot has no inertias"


class PayloadExceeded(PlanningError):
    """The robot would carry more than its rated payload."""

    code = "payload_exceeded"
    title = "The payload exceeds the robot's rating"


class UnsupportedFormat(PlanningError):
    """A form of file cannot carry the plan of this robot."""

    code = "unsupported_format"
    title = "The format cannot carry this plan"


class InfeasibleDuration(PlanningError):
    """The requested duration of a segment, or of the whole trajectory, is shorter than the limits allow."""

    code = "infeasible_duration"
    title = "A duration is too short for the limits"


class LimitsUnsatisfiable(PlanningError):
    """No duration, however long, keeps the limits."""

    code = "limits_unsatisfiable"
    title = "The limits cannot be kept"


class ClearanceUnproved(PlanningError):
    """The trajectory may be free of collisions, but the proof would take too long.

    Attributes:
        pair: Names of the links or objects whose clearance was not proved.
    """

    code = "clearance_unproved"
    title = "The clearance could not be proved"

    def __init__(self, message: str, *, pair: tuple[str, str], **fields: Any) -> None:
        super().__init__(message, **fields)
        self.pair = pair


class Collision(PlanningError):
    """Two links or objects come closer to each other than their margin allows.

    Attributes:
        pair: Names of the links or objects.
        depth: Margin minus distance, m; with a margin of 0, the depth of the overlap.
        point: (3,), m, in the base frame: a point of the first of the pair; None: unknown.
        position: (joints,), rad or m: the joint position of this depth.
    """

    code = "collision"
    title = "The robot would collide"

    def __init__(
        self,
        message: str,
        *,
        pair: tuple[str, str],
        depth: float,
        point: FloatArray | None,
        position: FloatArray,
        **fields: Any,
    ) -> None:
        super().__init__(message, **fields)
        self.pair, self.depth, self.point, self.position = pair, depth, point, position


class NoPathFound(PlanningError):
    """The search found no collision-free path; `path_point` is the farthest point that it reached.

    Attributes:
        checks: The number of motions that the search checked.
        enclosed_by: Names of objects that provably enclose the robot or the goal; empty: nothing is proved.
    """

    code = "no_path_found"
    title = "No collision-free path was found"

    def __init__(self, message: str, *, checks: int, enclosed_by: Sequence[str] = (), **fields: Any) -> None:
        super().__init__(message, **fields)
        self.checks = checks
        self.enclosed_by = tuple(enclosed_by)


class StartInCollision(Collision):
    """Two things are nearer to each other than their margin allows where the trajectory begins."""

    code = "start_in_collision"
    title = "The robot starts in a collision"


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
