"""Bodies of the requests about trajectories."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.actions import Action  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.backends import Backend, backend_schemas
from api.contract.parts.common import (
    DEFAULT_DEADLINE,
    LARGEST,
    Deadline,
    FrameName,
    JointVector,
    Limits,
    Number,
    Payload,
    Pose,
    RobotId,
    Schema,
    Seconds,
    Seed,
)
from api.contract.parts.pictures import Picture  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.scenes import SceneOrId, SpeedZones  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.waypoints import Waypoint  # noqa: TC001 - pydantic evaluates the annotations

MOST_ROWS = 1_000_000
"""The most rows of any list that the schemas allow; the service's own caps (GET /v1/limits) are narrower."""

Rows = Annotated[list[JointVector], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)]
"""Joint vectors, one a row; the first wrong row is the last that is looked at."""

ToolColumns = Annotated[dict[FrameName, Rows], Field(max_length=2)]
"""Columns of the tool in the samples of an answer."""

LARGEST_COEFFICIENT = 1e30
"""The largest coefficient of a polynomial, rad or m by powers of s: short pieces have large ones, and times powers of a
time none of these overflows."""

MOST_BACKENDS = 16
"""The most back ends that one request compares."""


Preference = TypeAliasType(
    "Preference",
    Annotated[
        Literal["continuous", "near_reference", "manipulability", "far_from_limits", "arm"],
        Field(
            description="Which of several solutions of a pose is taken. `continuous`: those on the shortest way "
            "through the whole list, in time at the velocity limits. `near_reference`: the one nearest to the "
            "`reference`, likewise in time. `manipulability`: the one with the largest, furthest from a singularity. "
            "`far_from_limits`: the one whose worst joint is nearest to the middle of its limits. `arm`: the one for "
            "which external axes move least: the arm reaches alone, and follows motions alone, wherever it can. "
            "Motions of the tool go on from where they start in any case; only where they cannot, another start is "
            "taken."
        ),
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
    prefer: Preference = "continuous"
    """Which of several solutions a waypoint takes, and which posture of an arm with joints to spare or with `free`."""


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
            "tcp_speed_report",
            "limits",
        ],
        Field(
            description="Something that an answer holds on demand: columns of the samples (`jerk`, `torque`; of the "
            "tool `tcp_pose`, `tcp_rpy`, `tcp_velocity`, `tcp_acceleration`), the joints' piecewise `polynomials`, the "
            "`tcp_polynomials` x(t), y(t), z(t) of its straight lines, `sample_checks`: what a controller reaches that "
            "interpolates between the samples, the `tcp_speed_report`: where the tool goes slower than "
            "`tcp_linear_velocity`, and why, or the `limits` in force on each segment."
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
    asks, and a warning says so; its `duration` or `minimum_duration` is a rest of that time. Where the robot is to go
    nowhere and no rest is asked, it rests for 0.01 s."""
    limits: Limits = Limits()
    """Limits of the whole trajectory; where a waypoint has limits of its own, the narrower hold on its segment."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """How poses and relative moves are solved for joint positions."""
    tool: Pose | None = None
    """The pose of the tool centre point in the tip frame (m); omitted: the robot's own."""
    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the `frame` of waypoints; `base` and `world` are
    there already. Without a mounting the base is the world."""
    mounting: Pose | None = None
    """The pose of the base in the world (m), whose z axis points up: gravity follows it. Omitted: the robot's own."""
    payload: Payload | None = None
    """The body that the robot carries, until a waypoint changes it; omitted: none."""
    duration: Seconds | None = None
    """The time of the whole trajectory, dwells included, s: what segments with a duration of their own and dwells leave
    of it, the others share in the proportion of the shortest times that they can take. Omitted: as fast as the limits
    allow."""
    start_tolerance: Annotated[float, Field(ge=0.0, le=0.1)] = 1e-4
    """How far outside of a position limit the start, or another joint waypoint, may be, rad or m: it is taken to be at
    the limit, and the warning `position_snapped` says so."""
    actions: Annotated[list[Action], Field(max_length=10_000)] = Field(default_factory=list)
    """What happens on the way besides motion, and not as one of the `actions` of a waypoint; the answer has `actions`
    with their times."""
    scene: SceneOrId | None = None
    """What stands around the robot and what it carries: the plan is proved to keep clear of it at all times, and its
    certificate has the `clearance`. Omitted: nothing is known."""
    self_collision: bool | None = None
    """Whether the arm is proved not to meet itself; omitted: in a scene, unless its shapes are capsules along
    its kinematics."""
    speed_zones: SpeedZones = Field(default_factory=list)
    """The speeds that no point of the robot exceeds near objects of the `scene`: the back end's motion is slowed there
    on its own path, and the certificate has `speed_zones`. It is no safety function."""
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
        default_factory=lambda: default_backend(), description="What puts time on the path; omitted: the cubic."
    )
    picture: Picture | None = None
    """What a picture of the plan shows, where one is asked (`?format=svg`, `png`); omitted: positions, velocities and
    accelerations of the joints."""


class CompareRequest(TrajectoryRequest):
    """The same waypoints for several back ends."""

    backends: Annotated[list[Backend], Field(min_length=1, max_length=MOST_BACKENDS)]
    """The back ends, each of which plans by itself; the results come in this order."""


def default_backend() -> Any:
    """Make the back end of a request that names none: the cubic."""
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
    segment: Annotated[list[int], Field(max_length=MOST_ROWS)] | None = Field(default=None, exclude=True)
    """The segments of the rows, without unit. Not read, as all columns below: the samples of an answer may be sent as
    they are."""
    jerk: Rows | None = Field(default=None, exclude=True)
    """The joint jerks, shape (times, joints), rad/s^3 or m/s^3. Not read."""
    torque: Rows | None = Field(default=None, exclude=True)
    """The joint torques, shape (times, joints), N m or N. Not read."""
    tcp_pose: ToolColumns | None = Field(default=None, exclude=True)
    """The poses of the tool. Not read."""
    tcp_rpy: Rows | None = Field(default=None, exclude=True)
    """The roll, pitch and yaw of the tool, shape (times, 3), rad. Not read."""
    tcp_velocity: ToolColumns | None = Field(default=None, exclude=True)
    """The velocities of the tool. Not read."""
    tcp_acceleration: ToolColumns | None = Field(default=None, exclude=True)
    """The accelerations of the tool. Not read."""


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


class GivenTrajectory(Schema):
    """A trajectory of any origin: samples, piecewise polynomials, or both, one of which counts."""

    samples: SampledTrajectory | None = None
    """The trajectory as samples; rows are time."""
    polynomials: Annotated[list[JointCurve], Field(min_length=1, max_length=64)] | None = None
    """The trajectory as polynomials, one a joint in the order of `joint_names`, as an answer holds them that includes
    `polynomials`."""
    interpolation: Interpolation | None = None
    """What the controller runs, which needs the columns that it meets; omitted: what the columns of the samples allow
    (`linear`, `cubic` or `quintic`), or without samples `polynomials`."""


class ValidateRequest(GivenTrajectory):
    """A trajectory to hold against limits: samples, piecewise polynomials, or both, one of which is checked.

    Limits are enforced as far as what runs bounds the quantity. Straight lines have to keep those of position and
    velocity, cubics those of acceleration and torque too, quintics that of jerk too; polynomials all of them, that of
    jerk if accelerations never jump. The tool's speeds have to be kept always.
    """

    robot: RobotId
    """The id of a robot, as GET /v1/robots lists them."""
    limits: Limits = Limits()
    """The limits to hold it against; what is omitted is the robot's own."""
    initial_velocity: JointVector | None = None
    """The joint velocities before the trajectory, rad/s or m/s; omitted: rest."""
    initial_acceleration: JointVector | None = None
    """The joint accelerations before the trajectory, rad/s^2 or m/s^2; omitted: none."""
    final_velocity: JointVector | None = None
    """The joint velocities after the trajectory, rad/s or m/s; omitted: rest."""
    scene: SceneOrId | None = None
    """What is around the robot, in the world or its base; it is held against that, too. Omitted: nothing is known."""
    self_collision: bool | None = None
    """Whether the arm is checked against itself; omitted: in a scene, unless its shapes are capsules along its
    kinematics."""
    speed_zones: SpeedZones = Field(default_factory=list)
    """The speeds that no point of the robot may exceed near objects of the `scene`."""
    deadline: Deadline = DEFAULT_DEADLINE
    """The time after which the service gives up, s from the arrival of the request."""
