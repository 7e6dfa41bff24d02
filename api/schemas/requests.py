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
    Elbow,
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
    Shoulder,
    Vector3,
    Wrist,
)

MOST_ROWS = 1_000_000
"""The most rows of any list that the schemas allow; the service's own caps (GET /v1/limits) are narrower."""


Rows = Annotated[list[JointVector], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)]
"""Joint vectors, one a row; the first wrong row is the last that is looked at."""

LARGEST_COEFFICIENT = 1e30
"""The largest coefficient of a polynomial, rad or m by powers of s: short pieces have large ones, and times powers of a
time none of these overflows."""

MOST_BACKENDS = 16
"""The most back ends that one request compares."""


class JointMotion(Schema):
    """Straight in joint space; beside a waypoint that is passed `through`, a smooth curve."""

    kind: Literal["joint"]
    """The motion: straight in joint space."""
    turns: Literal["nearest", "as_given"] = "nearest"
    """`nearest`: a continuous joint takes the short way to a joint waypoint, from 3.1 to -3.1 by 0.08 rad (it is then
    at 3.18), as far as the positions here and at the waypoint before are angles between -pi and pi; one beyond counts
    whole turns, and is taken as it is given. `as_given`: all are taken so, from 3.1 to -3.1 by 6.2 rad."""


TolerancePosition = Annotated[float, Field(ge=1e-8, le=1.0)]
ToleranceOrientation = Annotated[float, Field(ge=1e-8, le=1.0)]


Singularity = TypeAliasType(
    "Singularity",
    Annotated[
        Literal["refuse", "slow", "deviate"],
        Field(
            description="What a motion of the tool does near a singularity, where a joint would have to go far for a "
            "small step of the tool. `refuse`: it is refused where a joint would have to go further than 1000 rad (or "
            "m) for 1 m or 1 rad of the tool. `slow`: the tool keeps to its path and the joints to their speeds, and "
            "time stretches. `deviate`: the tool's orientation leaves the path by up to `tolerance_orientation`, so "
            "that the arm goes right through the singularity of its wrist."
        ),
    ],
)


class LinearMotion(Schema):
    """The tool in a straight line, turning by the shortest rotation."""

    kind: Literal["linear"]
    """The motion: a straight line of the tool."""
    tolerance_position: TolerancePosition = 1e-4
    """The distance that the tool may be off the line, m."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """The angle that the tool may be off the orientation that belongs there, rad."""
    singularity: Singularity = "refuse"
    """What to do near a singularity."""


class CircularMotion(Schema):
    """The tool on the circle through three poses: the waypoint before, `via`, and this one."""

    kind: Literal["circular"]
    """The motion: an arc of the tool."""
    via: Pose
    """A pose on the way, in the base frame (m); without an orientation the tool turns by the shortest rotation."""
    tolerance_position: TolerancePosition = 1e-4
    """The distance that the tool may be off the circle, m."""
    tolerance_orientation: ToleranceOrientation = 1e-3
    """The angle that the tool may be off the orientation that belongs there, rad."""
    singularity: Singularity = "refuse"
    """What to do near a singularity."""


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
    """The transition: a stop."""


class ThroughTransition(Schema):
    """Pass the waypoint exactly, without stopping."""

    kind: Literal["through"]
    """The transition: a passage without a stop."""


class BlendTransition(Schema):
    """Cut the corner without stopping; the tool leaves its paths only within the radius of the waypoint."""

    kind: Literal["blend"]
    """The transition: a cut corner."""
    radius: Annotated[float, Field(ge=1e-5, le=LARGEST)]
    """The distance from the waypoint at which the tool may leave its path, m."""


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
    """The notation of the move: Cartesian coordinates."""
    translation: Vector3
    """The translation x, y, z, m."""
    orientation: Orientation | None = None
    """The rotation; null or omitted: the tool keeps its orientation. After a waypoint that asks for a position alone
    the orientation stays open, whatever the move: it goes from that position, along the base's axes or those that the
    tool has there."""


class CylindricalMove(Schema):
    """Trans(0, 0, l) Rot(z, alpha) Trans(r, 0, 0)."""

    kind: Literal["cylindrical"]
    """The notation of the move: cylindrical coordinates."""
    r: Number
    """The radius, m."""
    alpha: Number
    """The angle about z, rad."""
    l: Number  # noqa: E741 - the contract's letter
    """The height, m."""


class SphericalMove(Schema):
    """Rot(z, gamma) Rot(y, beta) Trans(0, 0, r)."""

    kind: Literal["spherical"]
    """The notation of the move: spherical coordinates."""
    r: Number
    """The radius, m."""
    beta: Number
    """The angle about y, rad."""
    gamma: Number
    """The angle about z, rad."""


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
    """A name that the answer repeats; it means nothing to the planner."""
    motion: Motion = JointMotion(kind="joint")
    """How to get here from the waypoint before; omitted: straight in joint space."""
    duration: Seconds | None = None
    """The time from the departure at the waypoint before to the arrival here, s; omitted: the shortest within the
    limits."""
    dwell: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The time to rest here before going on, s."""
    transition: Transition = StopTransition(kind="stop")
    """How to pass this waypoint; omitted: with a stop."""
    limits: Limits | None = None
    """Limits of the segment that ends here; what is omitted is as for the whole trajectory."""
    payload: Payload | None = None
    """The body that the robot carries from here on, in place of what it carried; omitted: that. It changes only where
    the robot stops; as a gripper may close at any time of the dwell, what is carried before and what is carried after
    are both held there within the torque limits."""
    put_down: bool = False
    """Whether the robot puts down here what it carries, and goes on without a payload."""


class JointWaypoint(WaypointBase):
    """A joint position to go to."""

    kind: Literal["joint"]
    """The kind of waypoint: a joint position."""
    position: JointVector
    """The joint position, one value a joint in the order of `joint_names`, rad or m."""


class Configuration(Schema):
    """The sides on which shoulder, elbow and wrist are to be, for arms that have such names."""

    shoulder: Shoulder | None = None
    """Where the wrist centre is, seen in the frame that turns with the first joint: `right`, on the side of axis 2
    (KUKA: basic area, bit 0 of the status is 0), `left`, behind axis 1 (overhead area); of an arm whose links go by
    axis 1 at a distance (UR): to the `right` or the `left` of it, seen from there. Null or omitted: either."""
    elbow: Elbow | None = None
    """Whether the elbow is `up` or `down`: above or below the line from axis 2 to the wrist centre, seen from the side.
    Null or omitted: either."""
    wrist: Wrist | None = None
    """`no_flip`: the fifth joint is between 0 and pi; `flip`: between -pi and 0 (KUKA: bit 2 of the status is 1),
    counted from where axes 4, 5 and 6 lie in one plane. Null or omitted: either."""


class PoseWaypoint(WaypointBase):
    """A pose to bring the tool to."""

    kind: Literal["pose"]
    """The kind of waypoint: a pose of the tool."""
    pose: Pose
    """The pose of the tool in the base frame (m)."""
    configuration: Configuration | None = None
    """The configuration in which the arm is to be there; a singular posture belongs to those on both sides. Null or
    omitted: any, chosen so that the way through the whole list is shortest."""


class RelativeWaypoint(WaypointBase):
    """A move from the pose of the waypoint before."""

    kind: Literal["relative"]
    """The kind of waypoint: a move from the one before."""
    frame: Literal["tool", "base"]
    """The frame whose axes the move is along: the tool's at the waypoint before, or the base's."""
    move: Move
    """The move from the pose of the waypoint before."""


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
    """The distance that the tool may be off the position asked, m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The angle that the tool may be off the orientation asked, rad."""
    reference: JointVector | None = None
    """The joint position (one value a joint, rad or m) that the way through the solutions starts from; omitted: it
    may start anywhere, and between equals the middle of the limits decides."""
    prefer: Literal["continuous"] = "continuous"
    """Which of several solutions is taken: those on the shortest way through the whole list, in time at the velocity
    limits."""


Include = TypeAliasType(
    "Include",
    Annotated[
        Literal[
            "jerk",
            "torque",
            "tcp_pose",
            "tcp_rpy",
            "tcp_velocity",
            "tcp_acceleration",
            "polynomials",
            "tcp_polynomials",
            "sample_checks",
        ],
        Field(
            description="Something that an answer holds on demand: columns of the samples (`jerk`, `torque`; of the "
            "tool `tcp_pose`, `tcp_rpy`, `tcp_velocity`, `tcp_acceleration`), the joints' piecewise `polynomials`, the "
            "`tcp_polynomials` x(t), y(t), z(t) of its straight lines, or `sample_checks`: what a controller reaches "
            "that interpolates between the samples."
        ),
    ],
)


class TrajectoryRequest(Schema):
    """What to plan, but for the back end: a robot, its waypoints, limits and options."""

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    waypoints: Annotated[list[Waypoint], Field(min_length=1)]
    """Where the robot is to go, in order; it starts at rest at the first and ends at rest at the last. A waypoint at
    the joint position of the one before (within 1e-9 rad or m) is passed with it, as the strictest of their transitions
    asks, and a warning says so; its `duration` is a rest of that time. Where the robot is to go nowhere and no rest is
    asked, it rests for 0.01 s."""
    limits: Limits = Limits()
    """Limits of the whole trajectory; those of a waypoint go before these on its segment."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """How poses and relative moves are solved for joint positions."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the tip itself."""
    payload: Payload | None = None
    """The body that the robot carries, until a waypoint changes it; omitted: none."""
    start_tolerance: Annotated[float, Field(ge=0.0, le=0.1)] = 1e-4
    """How far outside of a position limit the start, or another joint waypoint, may be, rad or m: it is taken to be at
    the limit, and the warning `position_snapped` says so."""
    sample_period: Annotated[float, Field(ge=1e-6, le=LARGEST)] = 0.01
    """The time between two rows of the answer, s."""
    include: Annotated[list[Include], Field(max_length=16)] = Field(default_factory=list)
    """What else the answer should hold; each makes it larger."""
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""


class PlanRequest(TrajectoryRequest):
    """What to plan: a robot, its waypoints, limits and options."""

    backend: Backend = Field(
        default_factory=lambda: _default_backend(), description="What puts time on the path; omitted: the cubic."
    )


class CompareRequest(TrajectoryRequest):
    """The same waypoints for several back ends."""

    backends: Annotated[list[Backend], Field(min_length=1, max_length=MOST_BACKENDS)]
    """The back ends, each of which plans by itself; the results come in this order."""


def _default_backend() -> Any:
    return backend_schemas()["cubic"](kind="cubic")  # type: ignore[call-arg] # made by create_model


class SampledTrajectory(Schema):
    """Samples of a trajectory of any origin; rows are time."""

    time: Annotated[list[Number], Field(min_length=2, max_length=MOST_ROWS, fail_fast=True)]
    """The times of the rows, strictly increasing, s."""
    position: Rows
    """The joint positions, shape (times, joints), rad or m."""
    velocity: Rows | None = None
    """The joint velocities, shape (times, joints), rad/s or m/s."""
    acceleration: Rows | None = None
    """The joint accelerations, shape (times, joints), rad/s^2 or m/s^2; only beside velocities."""


Coefficient = Annotated[float, Field(ge=-LARGEST_COEFFICIENT, le=LARGEST_COEFFICIENT)]
Coefficients = Annotated[list[Coefficient], Field(min_length=1, max_length=16)]


class JointCurve(Schema):
    """One joint's curve: a piecewise polynomial, as answers hold it."""

    joint: Annotated[str, Field(max_length=200)]
    """The name of the joint."""
    breakpoints: Annotated[list[Number], Field(min_length=2, max_length=MOST_ROWS, fail_fast=True)]
    """The times at which the pieces begin and the last one ends, s, in order; the same for all joints."""
    coefficients: Annotated[list[Coefficients], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)]
    """The coefficients, one row a piece, all of one length: ascending powers of the time since the start of the piece,
    rad or m by powers of s."""


Interpolation = TypeAliasType(
    "Interpolation",
    Annotated[
        Literal["linear", "cubic", "quintic", "polynomials"],
        Field(
            description="What a controller runs: from sample to sample straight lines through positions (`linear`), "
            "cubics that meet velocities too (`cubic`), or quintics that meet accelerations as well (`quintic`), as "
            "ROS 2's joint_trajectory_controller does it; or the joints' `polynomials` as they are."
        ),
    ],
)


class ValidateRequest(Schema):
    """A trajectory to hold against limits: samples, piecewise polynomials, or both, one of which is checked.

    Limits are enforced as far as what runs bounds the quantity. Straight lines have to keep those of position and
    velocity, cubics those of acceleration and torque too, quintics that of jerk too; polynomials all of them, that of
    jerk if accelerations never jump. The tool's speeds have to be kept always.
    """

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    limits: Limits = Limits()
    """The limits to hold it against; what is omitted is the robot's own."""
    samples: SampledTrajectory | None = None
    """The trajectory as samples; rows are time."""
    polynomials: Annotated[list[JointCurve], Field(min_length=1, max_length=64)] | None = None
    """The trajectory as polynomials, one a joint in the order of `joint_names`, as an answer holds them that includes
    `polynomials`."""
    interpolation: Interpolation | None = None
    """What the controller runs, which needs the columns that it meets; omitted: what the columns of the samples allow
    (`linear`, `cubic` or `quintic`), or without samples `polynomials`."""
    initial_velocity: JointVector | None = None
    """The joint velocities before the trajectory, rad/s or m/s; omitted: rest."""
    initial_acceleration: JointVector | None = None
    """The joint accelerations before the trajectory, rad/s^2 or m/s^2; omitted: none."""
    final_velocity: JointVector | None = None
    """The joint velocities after the trajectory, rad/s or m/s; omitted: rest."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""
