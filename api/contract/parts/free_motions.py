"""Free motions of a request: around obstacles, with constraints on the tool."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.common import Answer, Number, Orientation, Pose, Schema, Vector3

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

Angle = Annotated[float, Field(ge=0.02, lt=pi)]
Distance = Annotated[float, Field(ge=0.001, le=1e3)]


class ToolAxis(Schema):
    """The constraint that an axis of the tool stays within an angle of a direction, such as an upright cup."""

    kind: Literal["tool_axis"]
    """The constraint: on an axis of the tool."""
    direction: Vector3
    """The direction in the base frame, without unit; its length does not count."""
    angle: Angle
    """The largest angle between the axis and the direction, rad."""
    axis: Vector3 = Field(default=[0.0, 0.0, 1.0])
    """The axis in the tool frame, without unit; its length does not count."""


class ToolOrientation(Schema):
    """The constraint that the orientation of the tool stays within an angle of a given one."""

    kind: Literal["orientation"]
    """The constraint: on the orientation of the tool."""
    orientation: Orientation
    """The orientation in the base frame."""
    angle: Angle
    """The largest angle of the rotation between the two, rad."""


class ToolNearPlane(Schema):
    """The constraint that the tool stays within a distance of a plane, on either side."""

    kind: Literal["plane"]
    """The constraint: near a plane."""
    point: Vector3
    """A point of the plane in the base frame, m."""
    normal: Vector3
    """The normal of the plane in the base frame, without unit; its length does not count."""
    distance: Distance
    """The largest distance of the tool, m."""


class ToolNearLine(Schema):
    """The constraint that the tool stays within a distance of an infinite line."""

    kind: Literal["line"]
    """The constraint: near a line."""
    point: Vector3
    """A point of the line in the base frame, m."""
    direction: Vector3
    """The direction of the line in the base frame, without unit; its length does not count."""
    distance: Distance
    """The largest distance of the tool, m."""


class ToolInBox(Schema):
    """The constraint that the tool stays inside a box."""

    kind: Literal["box"]
    """The constraint: inside a box."""
    pose: Pose
    """The pose of the box's centre and axes in the base frame, m. Without an orientation, its axes are the base's."""
    size: Annotated[list[Distance], Field(min_length=3, max_length=3)]
    """The lengths of the box along its axes, m."""


class ToolInHalfSpace(Schema):
    """The constraint that the tool stays in a half-space: normal · position <= offset."""

    kind: Literal["half_space"]
    """The constraint: in a half-space."""
    normal: Vector3
    """The direction out of the half-space in the base frame, without unit; its length does not count."""
    offset: Number
    """The distance of its plane from the origin along the normal, m."""


PoseConstraint = TypeAliasType(
    "PoseConstraint",
    Annotated[
        ToolAxis | ToolOrientation | ToolNearPlane | ToolNearLine | ToolInBox | ToolInHalfSpace,
        Field(discriminator="kind", description="A constraint on the pose of the tool; a tool position is its origin."),
    ],
)


class FreeMotion(Schema):
    """A collision-free path around obstacles: straight in joint space if that is collision-free, else a detour.

    A detour consists of straight joint motions that are proved collision-free at all times. Its corners are passed
    without a stop, blended or stopped at, whichever the certificate proves first. To a pose, the planner may choose
    any collision-free configuration, unless a tool motion follows. The segment cannot have a `duration`. Equal
    requests (`seed`) give equal detours. A motion that would meet a moving object goes around the space that it takes
    up meanwhile, or begins later (`waits_for_object`), whichever ends sooner.
    """

    kind: Literal["free"]
    """The motion: a free motion."""
    most_checks: Annotated[int, Field(ge=1, le=50_000)] = 20_000
    """The most motions that the search checks before it gives up with `no_path_found`; 20000 take 5 to 20 s. The limit
    is a number, not a time, so that equal requests have equal answers."""
    optimise: Literal["duration", "effort", "path_length"] | None = None
    """The objective that improves the detour: further detours are planned and certified, and the best one is the
    answer; its `waypoints` report the `gain`. The objective counts the whole trajectory: its `duration`, its `effort`,
    or its `path_length` in joint space. The effort is the integral of the sum of (torque / limit)^2, or of
    (acceleration / limit)^2 for a robot without inertias. Omitted: one change of the first detour is tried."""
    time_budget: Annotated[float, Field(gt=0.0, le=600.0)] | None = None
    """The time budget of this optimisation, s from the start of planning. The answer is the best detour found in this
    time, so it depends on the speed of the service. The optimisation also ends before the `deadline`. Omitted: it ends
    after `optimise_checks`."""
    optimise_checks: Annotated[int, Field(ge=1, le=50_000)] | None = None
    """The most motions that this optimisation checks; timing a trajectory counts as 100. The default of 5000 takes 1
    to 5 s. With a `time_budget`, omitted: unlimited."""
    keep: Annotated[list[PoseConstraint], Field(max_length=4)] = Field(
        default_factory=list, exclude_if=lambda keep: not keep
    )
    """Constraints on the tool that the whole motion keeps, its start and end included. The certificate bounds them at
    all times."""


class WayGain(Answer):
    """The gain of a better detour."""

    objective: Literal["duration", "effort", "path_length"]
    """The objective: the `optimise` of the request."""
    first: float
    """The value of the whole trajectory with the first detour: its duration, s, its effort, s, or the length of its
    path, rad."""
    last: float
    """The value of the trajectory in the answer, in the same unit (s or rad) and no larger."""
    candidates: int
    """The number of other detours that were timed."""
    checks: int
    """The number of motions that were checked for them."""


class ReducedBlend(Answer):
    """A blend whose radius the optimisation reduced."""

    waypoint: int
    """The index of its waypoint in the request."""
    radius: float
    """The radius in the plan, m."""


class OptimisationAnswer(Answer):
    """The gain of the optimisation of the duration."""

    first: float
    """The duration without the optimisation, s."""
    last: float
    """The duration of the answer, s; no larger."""
    iterates: int
    """The number of other trajectories that were timed; the answer is the shortest one that was certified."""
    moved: list[int]
    """The indices in the request of the waypoints whose joint positions moved."""
    blends: list[ReducedBlend]
    """The blends that became smaller."""


class RideAnswer(Answer):
    """The times of a ride on a moving object."""

    waypoint: int
    """The index in the request of the first waypoint on the object."""
    object: str
    """The id of the object."""
    begin: float
    """The time at which the tool begins to get up to the speed of the object, s from the start of the trajectory."""
    arrival: float
    """The time of arrival at that waypoint, s: the earliest one found, to 5 ms."""
    end: float
    """The time at which the robot rests again, after the last waypoint on the object, s."""
    durations: list[float]
    """The times of getting on, of each motion on the object, and of getting off, s."""
    latest_start: float
    """The latest time at which the program may begin, s on the clock of the objects. A plan was made in which the robot
    rests so long at the first waypoint. 0: none was found. The same for all rides of a plan."""


def may_have_free_motions(document: Mapping[str, Any]) -> bool:
    """Tell whether a body has free motions, or tasks in any order, between which motions in a scene are free."""
    return "tasks" in document or any(motion.get("kind") == "free" for motion in motions_of(document.get("waypoints")))


def motions_of(waypoints: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the motions of waypoints, and of the options of goal sets among them."""
    for waypoint in waypoints if isinstance(waypoints, list) else ():
        if not isinstance(waypoint, dict):
            continue
        if isinstance(motion := waypoint.get("motion"), dict):
            yield motion
        for options in ("options", "waypoints"):
            if options in waypoint:
                yield from motions_of(waypoint[options])
