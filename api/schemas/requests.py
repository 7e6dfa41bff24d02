"""Bodies of the requests about trajectories."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.schemas.backends import Backend, backend_schemas
from api.schemas.common import (
    DEFAULT_DEADLINE,
    LARGEST,
    Deadline,
    JointVector,
    Limits,
    Number,
    Orientation,
    Payload,
    Pose,
    RobotId,
    Schema,
    Seconds,
    Seed,
    Vector3,
)

MOST_ROWS = 1_000_000
"""Bound on the length of any list of rows; the service's own caps (GET /v1/limits) are narrower."""


Rows = Annotated[list[JointVector], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)]
"""Joint vectors, one a row; the first wrong row is the last that is looked at."""

MOST_BACKENDS = 16
"""Back ends compared in one request."""


class JointMotion(Schema):
    """Straight in joint space; beside a waypoint that is passed `through`, a smooth curve."""

    kind: Literal["joint"]


TolerancePosition = Annotated[float, Field(ge=1e-8, le=1.0)]
ToleranceOrientation = Annotated[float, Field(ge=1e-8, le=1.0)]


class LinearMotion(Schema):
    """The tool in a straight line, turning by the shortest rotation."""

    kind: Literal["linear"]
    tolerance_position: TolerancePosition = 1e-4
    """m, how far the tool may be from the line."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """rad, how far it may be from the orientation due there."""


class CircularMotion(Schema):
    """The tool on the circle through three poses: the waypoint before, `via`, and this one."""

    kind: Literal["circular"]
    via: Pose
    """On the way, in the base frame; without an orientation the tool turns by the shortest rotation."""
    tolerance_position: TolerancePosition = 1e-4
    """m, how far the tool may be from the circle."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """rad, how far it may be from the orientation due there."""


Motion = TypeAliasType(
    "Motion",
    Annotated[
        JointMotion | LinearMotion | CircularMotion,
        Field(discriminator="kind", description="How to get to a waypoint."),
    ],
)


class StopTransition(Schema):
    """Come to rest at the waypoint."""

    kind: Literal["stop"]


class ThroughTransition(Schema):
    """Pass the waypoint exactly, without stopping."""

    kind: Literal["through"]


class BlendTransition(Schema):
    """Cut the corner without stopping; the tool leaves its paths only within the radius of the waypoint."""

    kind: Literal["blend"]
    radius: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """m."""


Transition = TypeAliasType(
    "Transition",
    Annotated[
        StopTransition | ThroughTransition | BlendTransition,
        Field(discriminator="kind", description="How to pass a waypoint."),
    ],
)


class CartesianMove(Schema):
    """A translation, then a rotation."""

    kind: Literal["cartesian"]
    translation: Vector3
    """m."""
    orientation: Orientation | None = None
    """The rotation; null or omitted: keep the orientation."""


class CylindricalMove(Schema):
    """Trans(0, 0, l) Rot(z, alpha) Trans(r, 0, 0)."""

    kind: Literal["cylindrical"]
    r: Number
    """Radius, m."""
    alpha: Number
    """Angle about z, rad."""
    l: Number  # noqa: E741 - the contract's letter
    """Height, m."""


class SphericalMove(Schema):
    """Rot(z, gamma) Rot(y, beta) Trans(0, 0, r)."""

    kind: Literal["spherical"]
    r: Number
    """Radius, m."""
    beta: Number
    """Angle about y, rad."""
    gamma: Number
    """Angle about z, rad."""


Move = TypeAliasType(
    "Move",
    Annotated[
        CartesianMove | CylindricalMove | SphericalMove,
        Field(discriminator="kind", description="A move relative to the pose before."),
    ],
)


class WaypointBase(Schema):
    """What every kind of waypoint has."""

    name: Annotated[str, Field(max_length=200)] | None = None
    """For the answer only."""
    motion: Motion = JointMotion(kind="joint")
    """How to get here from the waypoint before."""
    duration: Seconds | None = None
    """s, of the segment that ends here; omitted: as fast as the limits allow."""
    dwell: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """s, rest here before going on."""
    transition: Transition = StopTransition(kind="stop")
    """How to pass this waypoint."""
    limits: Limits | None = None
    """Of the segment that ends here."""


class JointWaypoint(WaypointBase):
    """A joint position."""

    kind: Literal["joint"]
    position: JointVector
    """One value per joint, rad or m."""


class PoseWaypoint(WaypointBase):
    """A pose of the tool in the base frame."""

    kind: Literal["pose"]
    pose: Pose


class RelativeWaypoint(WaypointBase):
    """A move from the pose of the waypoint before."""

    kind: Literal["relative"]
    frame: Literal["tool", "base"]
    """Whose axes the move is in."""
    move: Move


Waypoint = TypeAliasType(
    "Waypoint",
    Annotated[
        JointWaypoint | PoseWaypoint | RelativeWaypoint,
        Field(discriminator="kind", description="Where the robot is to go."),
    ],
)


class InverseKinematicsOptions(Schema):
    """How poses are solved."""

    tolerance_position: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """rad."""
    reference: JointVector | None = None
    """Joint position that the way through the solutions starts from; omitted: it may start anywhere, and between equals
    the middle of the limits decides."""
    prefer: Literal["continuous"] = "continuous"
    """Which solutions of several: those on the shortest way through the whole list, in time at the velocity limits."""


Include = TypeAliasType("Include", Literal["jerk", "torque", "tcp_pose", "polynomials"])


class TrajectoryRequest(Schema):
    """What to plan, but for the back end: a robot, its waypoints, limits and options."""

    robot: RobotId
    """An id of GET /v1/robots."""
    waypoints: Annotated[list[Waypoint], Field(min_length=2, max_length=100_000)]
    """The robot starts at rest at the first and ends at rest at the last."""
    limits: Limits = Limits()
    """For the whole trajectory; a waypoint's own go before these."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """How poses are solved."""
    tool: Pose | None = None
    """Tool centre point in the tip frame; omitted: the tip itself."""
    payload: Payload | None = None
    """What the robot carries; omitted: nothing."""
    sample_period: Annotated[float, Field(ge=1e-6, le=LARGEST)] = 0.01
    """s, between rows of the answer."""
    include: Annotated[list[Include], Field(max_length=16)] = Field(default_factory=list)
    """What else the answer should hold."""
    seed: Seed = 0
    """Of the random starts of the inverse kinematics."""
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""


class PlanRequest(TrajectoryRequest):
    """What to plan: a robot, its waypoints, limits and options."""

    backend: Backend = Field(
        default_factory=lambda: _default_backend(), description="What puts time on the path; omitted: the cubic."
    )


class CompareRequest(TrajectoryRequest):
    """The same waypoints for several back ends."""

    backends: Annotated[list[Backend], Field(min_length=1, max_length=MOST_BACKENDS)]
    """Each is planned by itself."""


def _default_backend() -> Any:
    return backend_schemas()["cubic"](kind="cubic")  # type: ignore[call-arg] # made by create_model


class SampledTrajectory(Schema):
    """Samples of a trajectory of any origin; rows are time."""

    time: Annotated[list[Number], Field(min_length=2, max_length=MOST_ROWS, fail_fast=True)]
    """s, strictly increasing."""
    position: Rows
    """rad or m."""
    velocity: Rows | None = None
    """rad/s or m/s; omitted: the robot is taken to run straight lines between the positions."""
    acceleration: Rows | None = None
    """rad/s^2 or m/s^2; omitted: the robot is taken to run cubics between positions and velocities."""


class ValidateRequest(Schema):
    """A trajectory to hold against limits."""

    robot: RobotId
    """An id of GET /v1/robots."""
    limits: Limits = Limits()
    """Omitted: the robot's own."""
    samples: SampledTrajectory
    deadline: Deadline = DEFAULT_DEADLINE
    """s, after which the service gives up."""
