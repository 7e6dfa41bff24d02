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
    Mounting,
    NamedRobot,
    Number,
    Payload,
    Pose,
    ResidualVibration,
    Schema,
    Seconds,
    Seed,
    SelfCollision,
    Tool,
    VibrationMode,
)
from api.contract.parts.goal_sets import Waypoint  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.pictures import Picture  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.scenes import SceneOrId, SpeedZones  # noqa: TC001 - pydantic evaluates the annotations

MOST_ROWS = 1_000_000
"""The most rows of any list that the schemas allow; the service's own caps (GET /v1/limits) are narrower."""

Rows = Annotated[list[JointVector], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)]
"""Joint vectors, one in each row; validation stops at the first invalid row."""

ToolColumns = Annotated[dict[FrameName, Rows], Field(max_length=2)]
"""Columns of the tool in the samples of an answer."""

LARGEST_COEFFICIENT = 1e30
"""The largest coefficient of a polynomial, rad or m by powers of s. Short pieces have large ones, and times powers of a
time none of these overflows."""

MOST_BACKENDS = 16
"""The most back ends that one request compares."""


Preference = TypeAliasType(
    "Preference",
    Annotated[
        Literal["continuous", "near_reference", "manipulability", "far_from_limits", "arm", "weld_flat"],
        Field(
            description="The choice among solutions of a pose. `continuous`: the solutions on the shortest path "
            "through the whole list, in time at the velocity limits. `near_reference`: the solution nearest to the "
            "`reference`, likewise in time. `manipulability`: the solution with the largest manipulability, which is "
            "the farthest from a singularity. `far_from_limits`: the solution whose worst joint is nearest to the "
            "middle of its limits. `arm`: the solution with the least motion of external axes. The arm then reaches "
            "poses and follows motions alone where it can. `weld_flat`: the solution for which a positioner holds the "
            "workpiece flat: its normal, opposite to the tool's z axis, points up as nearly as possible. So it does "
            "along motions of the tool to poses without `external` positions. It needs a robot with a positioner. "
            "A motion of the tool starts at the solution of the waypoint before it. The planner takes another solution "
            "there only where the motion fails. A free motion ends at another solution if no path is found."
        ),
    ],
)


class InverseKinematicsOptions(Schema):
    """Options of the inverse kinematics."""

    tolerance_position: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The largest position error of the inverse kinematics, m."""
    tolerance_orientation: Annotated[float, Field(ge=1e-9, le=1.0)] = 1e-6
    """The largest orientation error of the inverse kinematics, rad."""
    reference: JointVector | None = None
    """The joint position (one value for each joint, rad or m) from which the path through the solutions starts;
    omitted: anywhere, and ties go to the middle of the limits."""
    prefer: Preference = "continuous"
    """The preference among several solutions, and among the joint positions of a redundant arm or within `free`."""


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
            "proof",
        ],
        Field(
            description="Something that an answer holds on demand: columns of the samples (`jerk`, `torque`; of the "
            "tool `tcp_pose`, `tcp_rpy`, `tcp_velocity`, `tcp_acceleration`), the joints' piecewise `polynomials`, the "
            "`tcp_polynomials` x(t), y(t), z(t) of its straight lines, `sample_checks`: what a controller reaches that "
            "interpolates between the samples, the `tcp_speed_report`: where the tool goes slower than "
            "`tcp_linear_velocity`, and why, the `limits` in force on each segment, or the `proof` of the certificate, "
            "which stand-alone programs check."
        ),
    ],
)


class RobotProblem(Schema):
    """The parts of a planning problem that are a robot's own: its limits, tool, payload and options."""

    robot: NamedRobot
    limits: Limits = Limits()
    """Limits of the whole trajectory; where a waypoint has limits of its own, the narrower limit holds on its
    segment."""
    ik: InverseKinematicsOptions = InverseKinematicsOptions()
    """Options of the inverse kinematics of poses and relative moves."""
    tool: Tool = None
    mounting: Mounting = None
    payload: Payload | None = None
    """The payload until a waypoint changes it; omitted: none."""
    start_tolerance: Annotated[float, Field(ge=0.0, le=0.1)] = 1e-4
    """The distance by which a joint waypoint may lie outside a position limit, rad or m. It is moved to the limit, and
    the warning `position_snapped` says so."""
    self_collision: SelfCollision = None
    speed_zones: SpeedZones = Field(default_factory=list)
    """Speed limits of every point of the robot near objects of the `scene`. The trajectory is slowed on its own path,
    and the certificate reports `speed_zones`. This is not a safety function."""
    residual_vibration: ResidualVibration | None = None
    """The vibration mode of the arm whose residual vibration after each motion is suppressed or reported, as the check
    `residual_vibration`. Omitted: no mode is known."""
    sample_period: Annotated[float, Field(ge=1e-6, le=LARGEST)] = 0.01
    """The sample period of the answer, s."""
    include: Annotated[list[Include], Field(max_length=16)] = Field(default_factory=list)
    """Additional parts of the answer; each makes it larger."""
    seed: Seed = 0
    """The seed of the random starts of the inverse kinematics; the same seed gives the same answer."""


class ProblemRequest(RobotProblem):
    """The planning problem without its waypoints and the back end: a robot, limits and options."""

    frames: Annotated[dict[FrameName, Pose], Field(max_length=64)] = Field(default_factory=dict)
    """Work objects by name, each with its pose in the world (m), for the `frame` of waypoints; `base` and `world` are
    predefined. Without a mounting the base is the world."""
    scene: SceneOrId | None = None
    """The scene with objects and attached objects. The plan is proved collision-free at all times, and its certificate
    reports the `clearance`. Omitted: no scene."""
    deadline: Deadline = DEFAULT_DEADLINE


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
    """The coefficients of ascending powers of the time since the start of the piece, rad or m by powers of s. There is
    one row a piece, all of one length."""


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
    """The interpolation of the controller, which needs the columns that it interpolates. Omitted: the best for the
    columns of the samples (`linear`, `cubic` or `quintic`), or `polynomials` without samples."""


class WaypointList(Schema):
    """The waypoints of a robot, with the duration, the objective and the actions of its trajectory."""

    waypoints: Annotated[list[Waypoint], Field(min_length=1)]
    """The waypoints in order; the robot starts at rest at the first and ends at rest at the last. A waypoint at the
    joint position of the one before (within 1e-9 rad or m) is merged with it under the stricter transition. A warning
    says so. Its `duration` or `minimum_duration` becomes a rest. A trajectory without motion and without a
    requested rest is a rest of 0.01 s."""
    duration: Seconds | None = None
    """The duration of the whole trajectory with dwells, s. Segments without a duration of their own share the
    remaining time in proportion to their shortest durations. Omitted: as fast as the limits allow."""
    optimise: Literal["duration"] | None = None
    """The objective that the planner minimises within the open coordinates of the request. With `duration`, joint
    positions at poses move: in tolerance regions (`free`), with open orientations and elbows. Radii of blends shrink,
    and corners of free motions without an `optimise` of their own move. The answer is the shortest certified
    trajectory, never longer than without, and has the `optimisation`. The warning `nothing_to_optimise` says that
    nothing is open. Omitted: the first certified plan is the answer."""
    time_budget: Annotated[float, Field(gt=0.0, le=600.0)] | None = None
    """The time budget of `optimise`, s from the start of planning. The answer depends on the speed of the service. The
    optimisation also ends before the `deadline`. Omitted: it ends after `optimise_iterates`."""
    optimise_iterates: Annotated[int, Field(ge=1, le=10_000)] | None = None
    """The largest number of trajectories that `optimise` tries, and tries again at the corners of each free motion.
    Equal requests then have equal answers. Omitted: 100, or any number with a `time_budget`."""
    warm_start: GivenTrajectory | None = None
    """A trajectory of any origin, such as the `samples` of an earlier answer. `optimise` also begins at its joint
    positions where it comes nearest to the waypoints, in order. Its times do not matter. Omitted: none."""
    actions: Annotated[list[Action], Field(max_length=10_000)] = Field(default_factory=list)
    """Actions during the trajectory, other than the `actions` of waypoints; the answer gives their times."""


class TrajectoryRequest(WaypointList, ProblemRequest):
    """The planning problem without the back end: a robot, its waypoints, limits and options."""

    repeat: Annotated[int, Field(ge=0, le=1_000_000)] = 1
    """The number of times that a robot program runs the trajectory; 0: until an operator stops it. Such a trajectory
    ends at the joint position of its start. Answers in other formats contain the trajectory once."""


class PlanRequest(TrajectoryRequest):
    """The planning problem: a robot, its waypoints, limits and options."""

    backend: Backend = Field(
        default_factory=lambda: default_backend(), description="What puts time on the path; omitted: the cubic."
    )
    picture: Picture | None = None
    """The contents of a picture of the plan (`?format=svg`, `png`); omitted: positions, velocities and accelerations
    of the joints."""


class CompareRequest(TrajectoryRequest):
    """The same waypoints for several back ends."""

    backends: Annotated[list[Backend], Field(min_length=1, max_length=MOST_BACKENDS)]
    """The back ends, each of which plans independently; the results are in this order."""


def default_backend() -> Any:
    """Make the back end of a request that names none: the cubic."""
    return backend_schemas()["cubic"](kind="cubic")  # type: ignore[call-arg] # made by create_model


class ValidateRequest(GivenTrajectory):
    """A trajectory to check against limits: samples, piecewise polynomials, or both, one of which is checked.

    Limits are enforced where the interpolation bounds the quantity. Linear interpolation bounds position and velocity,
    cubic also acceleration and torque, quintic also jerk. Polynomials bound all, and jerk if accelerations never jump.
    The limits of the tool's speed are always enforced.
    """

    robot: NamedRobot
    limits: Limits = Limits()
    """The limits to check against; omitted limits are the robot's own."""
    initial_velocity: JointVector | None = None
    """The joint velocities before the trajectory, rad/s or m/s; omitted: rest."""
    initial_acceleration: JointVector | None = None
    """The joint accelerations before the trajectory, rad/s^2 or m/s^2; omitted: none."""
    final_velocity: JointVector | None = None
    """The joint velocities after the trajectory, rad/s or m/s; omitted: rest."""
    scene: SceneOrId | None = None
    """The scene to check against, in the world or the base frame. Omitted: no scene."""
    self_collision: SelfCollision = None
    speed_zones: SpeedZones = Field(default_factory=list)
    """Speed limits of every point of the robot near objects of the `scene`."""
    residual_vibration: VibrationMode | None = None
    """The vibration mode whose amplitude at the end of the trajectory is reported; omitted: none."""
    deadline: Deadline = DEFAULT_DEADLINE
