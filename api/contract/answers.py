"""Answers about trajectories and back ends."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from api.contract.kinematics import AnsweredConfiguration, AnsweredPose  # noqa: TC001 - pydantic evaluates annotations
from api.contract.parts.common import Answer
from api.contract.parts.scenes import ClearancesAnswer, CollisionAnswer, SpeedZoneAnswer  # noqa: TC001
from api.contract.parts.way_gains import WayGain  # noqa: TC001


class TcpPoses(Answer):
    """Poses of the tool in the base frame; rows are time."""

    position: list[list[float]]
    """The origin of the tool, shape (times, 3), m."""
    quaternion_xyzw: list[list[float]]
    """The orientation of the tool as quaternions of norm 1, shape (times, 4), without unit: x, y, z, then the
    scalar w."""


class TcpVelocities(Answer):
    """Velocities of the tool in the base's axes; rows are time."""

    linear: list[list[float]]
    """The velocity of the tool's origin, shape (times, 3), m/s."""
    angular: list[list[float]]
    """The angular velocity of the tool, shape (times, 3), rad/s."""


class TcpAccelerations(Answer):
    """Accelerations of the tool in the base's axes, without gravity; rows are time."""

    linear: list[list[float]]
    """The acceleration of the tool's origin, shape (times, 3), m/s^2."""
    angular: list[list[float]]
    """The angular acceleration of the tool, shape (times, 3), rad/s^2."""


class Samples(Answer):
    """The trajectory, sampled; rows are time."""

    time: list[float]
    """The times of the rows, s: the first is 0, the last is the duration, strictly increasing."""
    position: list[list[float]]
    """The joint positions, shape (times, joints), rad or m."""
    velocity: list[list[float]]
    """The joint velocities, shape (times, joints), rad/s or m/s."""
    acceleration: list[list[float]]
    """The joint accelerations, shape (times, joints), rad/s^2 or m/s^2."""
    segment: list[int]
    """The index of the segment that each row is on; segment i goes from waypoint i to waypoint i + 1."""
    jerk: list[list[float]] | None = None
    """The joint jerks, shape (times, joints), rad/s^3 or m/s^3; when included."""
    torque: list[list[float]] | None = None
    """The joint torques, shape (times, joints), N m or N; when included."""
    tcp_pose: TcpPoses | None = None
    """The poses of the tool; when included."""
    tcp_rpy: list[list[float]] | None = None
    """The orientation of the tool as roll, pitch and yaw, shape (times, 3), rad: turns about the fixed axes x, then y,
    then z of the base, as in URDF, R = Rz(yaw) Ry(pitch) Rx(roll); when included. The pitch is in [-pi/2, pi/2]; roll
    and yaw go on from row to row without jumps by whole turns, and may leave [-pi, pi]. Where the pitch is a quarter of
    a turn, the roll stays as it was (at the start 0)."""
    tcp_velocity: TcpVelocities | None = None
    """The velocities of the tool; when included."""
    tcp_acceleration: TcpAccelerations | None = None
    """The accelerations of the tool; when included."""


class RegionOffsets(Answer):
    """The offsets of a pose from the one that is written, by what the request leaves free."""

    x: float | None = None
    """The shift along the x axis of the pose, m."""
    y: float | None = None
    """The shift along its y axis, m."""
    z: float | None = None
    """The shift along its z axis, m."""
    rotation_x: float | None = None
    """The turn about its x axis, rad."""
    rotation_y: float | None = None
    """The turn about its y axis as turned so, rad."""
    rotation_z: float | None = None
    """The turn about the tool's own z axis, rad."""


class PlannedWaypoint(Answer):
    """A waypoint as it was solved and timed."""

    index: int
    """The index of the waypoint in the request, from 0; of a corner of a way (`way_around`) that where it leads."""
    name: str | None
    """The name that the request gave it; null: none."""
    arrival_time: float
    """When the robot arrives, s from the start of the trajectory."""
    departure_time: float
    """When it goes on after the dwell, s from the start of the trajectory."""
    position: list[float]
    """The joint position, one value a joint, rad or m."""
    pose: AnsweredPose
    """The pose of the tool there, in the base frame (m)."""
    position_error: float
    """The distance of the tool from the requested position, m; a move goes on from an open pose as it is reached."""
    orientation_error: float | None
    """The angle of the tool from the requested orientation, rad; null: none was requested."""
    solutions: int | None
    """The number of isolated solutions of the pose, in a scene of those at which the robot keeps clear if there is one;
    null: a joint waypoint, or a continuum."""
    solution: int | None
    """The index of the solution that was taken, in the order of their distance in time from the waypoint before: 0 is
    the nearest; null: a joint waypoint, or a continuum."""
    choice: Literal["given", "only", "shortest_way", "preferred", "continued", "way_around"]
    """Why it was taken: `given`, a joint waypoint; `only`, there is no other solution; `shortest_way`, with it the way
    through the whole list is shortest; `preferred`, it is the best by what the request prefers; `continued`, a motion
    of the tool ends there; `way_around`, it is a corner of the way that was found for a free motion."""
    configuration: AnsweredConfiguration
    """The configuration of the arm there, by its names."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: 0 where the arm is singular."""
    free: RegionOffsets | None = None
    """With `free` in the request: where in its region the waypoint is."""
    gain: WayGain | None = None
    """With `optimise` in the free motion to here: what was gained by it."""


class Check(Answer):
    """The worst of one quantity over the trajectory."""

    quantity: str
    """The quantity: `position`, `velocity`, `acceleration`, `jerk`, `torque`, `tcp_linear_velocity`,
    `tcp_angular_velocity`, `tcp_linear_acceleration`, `tcp_angular_acceleration`, `tcp_centripetal_acceleration` (that
    across its path), `tcp_linear_jerk`, `tcp_angular_jerk`; and how far the tool is off the path asked:
    `path_position_deviation`, `path_orientation_deviation`, `blend_deviation`; of `min_effort` how far it is off
    straight joint motions, m: `tool_deviation`; and how far the farthest joint is, rad or m: `joint_deviation`; where a
    velocity is asked at a waypoint, how far a joint's is off, rad/s or m/s: `passing_velocity_error`; where a duration,
    a least one or a dwell is asked, how far one is off, s: `duration_error`; how far the tool is off pose and relative
    waypoints, m, rad: `waypoint_position_error`, `waypoint_orientation_error`."""
    joint: str | None
    """The name of the joint that uses most of its limit; null: the quantity is the tool's."""
    peak: float
    """The most extreme value of that joint or of the tool, with the sign of a position and as a magnitude otherwise, in
    the unit of the quantity (rad or m, by s, s^2 and s^3; N m or N)."""
    limit: float | None
    """The limit that the peak is held against, in the same unit; null: there is none."""
    ratio: float | None
    """The share of the limit that is used, without unit: 1 is all of it. A position counts from the middle of its
    range. null: there is no limit, or the quantity has no bound."""
    time: float
    """When the peak is reached, s from the start of the trajectory."""
    method: Literal["exact", "sampled"]
    """How the peak was found: `exact`, at the extrema of the polynomials, or `sampled`, in samples that are refined
    where a peak may be."""
    enforced: bool
    """Whether the back end promises to keep the limit; false: it is only reported, and may be exceeded."""
    bounded: bool
    """Whether the peak bounds the quantity. It does not where the quantity below jumps: there this one has an impulse
    that no peak measures. A cubic that starts from rest is the usual case: its acceleration jumps at its ends, so its
    jerk is not bounded, and `peak` is the largest jerk between the jumps."""


class CertificateAnswer(Answer):
    """What was checked after planning, by code that shares only tested arithmetic with the back ends."""

    satisfied: bool
    """Whether every enforced limit is kept and every waypoint met; in the answer of a plan it always is."""
    waypoint_error: float
    """The largest distance of a joint from its waypoint at the arrival there, rad or m."""
    continuity: str
    """The derivatives that are continuous, rest before and after included: `C0`, the position; `C1`, the velocity, too;
    `C2`, the acceleration, too; and so on. `none`: not even the position."""
    checks: list[Check]
    """The worst of each quantity, one check a quantity."""
    clearance: ClearancesAnswer | None = None
    """How near the robot comes to itself and to the scene; missing: nothing was held against anything; null: it is not
    free."""
    speed_zones: list[SpeedZoneAnswer] | None = None
    """How fast the robot is near objects, in each of the zones that were asked; missing: none were."""


class InterpolationCertificate(CertificateAnswer):
    """What was checked of a trajectory as a controller runs it."""

    interpolation: Literal["linear", "cubic", "quintic", "polynomials"]
    """What the controller runs: the interpolation between samples, or the polynomials as they are."""
    collision: CollisionAnswer | None = None
    """The pair that does not keep its margin, so that the certificate is not satisfied; null: all do; missing: nothing
    was asked about collisions."""


class JointPolynomials(Answer):
    """One joint's piecewise polynomial."""

    joint: str
    """The name of the joint."""
    breakpoints: list[float]
    """The times at which the pieces begin and the last one ends, s: one more than there are pieces."""
    coefficients: list[list[float]]
    """The coefficients, one row a piece: ascending powers of the time since the start of the piece, rad or m by powers
    of s."""


class LinePolynomials(Answer):
    """A straight line of the tool as polynomials of time.

    The tool is at p(t) = p0 + u(t) (p1 - p0), where u(t) is the share of the line that lies behind. There is one row
    of coefficients a phase of the time law: one for a cubic or a quintic from stop to stop, three for a trapezoid, many
    for laws that follow limits of the joints. Where the line begins or ends in a blend, the rest of it is given.
    """

    segment: int
    """The index of the segment."""
    breakpoints: list[float]
    """The times at which the pieces begin and the last one ends, s from the start of the trajectory."""
    path_parameter: list[list[float]]
    """The coefficients of u(t), one row a piece: ascending powers of the time since the start of the piece, by powers
    of s."""
    x: list[list[float]]
    """The coefficients of x(t) in the base frame, one row a piece, m by powers of s."""
    y: list[list[float]]
    """The coefficients of y(t) in the base frame, one row a piece, m by powers of s."""
    z: list[list[float]]
    """The coefficients of z(t) in the base frame, one row a piece, m by powers of s."""
    deviation: float
    """How far the tool of the joint trajectory is from x(t), y(t), z(t) at most, m, found at 17 times of each piece
    of the joints' polynomials: the joints follow the line within its tolerance."""


class SlowPart(Answer):
    """A part of a motion on which the tool goes slower than its speed limit, by more than 1 %."""

    start_time: float
    """When it begins, s from the start of the trajectory."""
    end_time: float
    """When it ends, s from the start of the trajectory."""
    start_distance: float
    """How far the tool has gone since the start of the motion when the part begins, m."""
    end_distance: float
    """How far the tool has gone since the start of the motion when the part ends, m."""
    lowest_speed: float
    """The lowest speed of the tool on it, m/s."""
    quantity: Literal[
        "velocity",
        "acceleration",
        "jerk",
        "torque",
        "tcp_angular_velocity",
        "tcp_linear_acceleration",
        "tcp_angular_acceleration",
        "tcp_centripetal_acceleration",
        "tcp_linear_jerk",
        "tcp_angular_jerk",
        "duration",
        "time_law",
    ]
    """What keeps the tool slow where it is slowest: the limit of a joint or of the tool that it uses; `duration`, no
    limit binds and a duration is asked; `time_law`, neither: the back end's law has that form."""
    joint: str | None
    """The name of the joint whose limit it is; null: it is none of a joint."""
    use: float
    """The largest share of that limit that is used there; of `duration` and `time_law` that of any limit."""


class ToolSpeedReport(Answer):
    """How well one motion of the tool holds its speed."""

    segment: int
    """The index of the segment."""
    limit: float
    """The limit of the tool's speed there, m/s."""
    held: float
    """The share of the way on which the tool goes at it, within 1 %."""
    slow: list[SlowPart]
    """The parts on which it does not, in order."""


class TimedAction(Answer):
    """An action with its time."""

    index: int
    """The index of the action, counted from 0: the `actions` of the request come first, then those of its waypoints."""
    kind: Literal["set_output", "wait"]
    """What happens: an output is set, or the robot waits."""
    time: float
    """When it happens, s from the start of the trajectory; of a wait: when it begins."""
    distance: float
    """The length of the way that the tool has gone by then, m."""
    name: str | None = None
    """With `set_output`: the name of the output."""
    value: bool | float | None = None
    """With `set_output`: the value that it takes, a number in its own unit."""
    duration: float | None = None
    """With `wait`: how long, s."""


class PlanWarning(Answer):
    """Something to know about a plan that is good all the same."""

    code: str
    """The stable name of this kind of warning, in snake case."""
    message: str
    """What to know, for a person."""


class SegmentBounds(Answer):
    """The lower and upper limits in force of one quantity of the joints; rows are segments."""

    lower: list[list[float | None]]
    """The lower limits, shape (segments, joints), in the unit of the samples; null: none."""
    upper: list[list[float | None]]
    """The upper limits, shape (segments, joints), in the unit of the samples; null: none."""


class SegmentLimitsAnswer(Answer):
    """The limits in force on each segment: the robot's, narrowed by the request's and the waypoint's."""

    position: SegmentBounds
    """The position limits of the joints, rad or m."""
    velocity: SegmentBounds
    """Their velocity limits, rad/s or m/s."""
    acceleration: SegmentBounds
    """Their acceleration limits, rad/s^2 or m/s^2."""
    jerk: SegmentBounds
    """Their jerk limits, rad/s^3 or m/s^3."""
    torque: SegmentBounds
    """Their torque limits, N m or N."""
    tool: dict[str, list[float | None]]
    """The limits of the tool by quantity, such as `tcp_linear_velocity`: one value a segment, SI units; null: none. A
    quantity without any limit is absent."""


class PlanAnswer(Answer):
    """A certified trajectory."""

    robot: str
    """The id of the robot, as in the request."""
    joint_names: list[str]
    """The names of the joints in the order of every joint array."""
    backend: str
    """The kind of the back end that was asked for."""
    solver: str | None
    """The solver of the velocity profile of `toppra`, `kernel` or `package`; null: there is none, as of motions in
    closed form, with limited jerk and by other back ends."""
    duration: float
    """The duration of the trajectory, s."""
    samples: Samples
    """The trajectory, sampled every `sample_period`."""
    waypoints: list[PlannedWaypoint]
    """The waypoints as they were solved and timed, in order, with the corners of ways that were found for free motions;
    segment i goes from the i-th of them, counted from 0, to the next."""
    certificate: CertificateAnswer
    """What was checked after planning: the peaks of all quantities against their limits."""
    actions: list[TimedAction] | None = None
    """The actions of the request in the order in which they happen; when there are any."""
    polynomials: list[JointPolynomials] | None = None
    """The trajectory itself, as one piecewise polynomial a joint; when included."""
    tcp_polynomials: list[LinePolynomials] | None = None
    """The straight lines of the tool as polynomials of time, one entry a linear motion; when included."""
    tcp_speed_report: list[ToolSpeedReport] | None = None
    """How well the tool holds its speed, one entry a motion of the tool on whose segment `tcp_linear_velocity` is
    limited; when included."""
    limits: SegmentLimitsAnswer | None = None
    """The limits in force on each segment; when included."""
    sample_checks: list[InterpolationCertificate] | None = None
    """What a controller reaches that interpolates between these samples, by each interpolation, held against the limits
    in force on each segment, and how far it passes by the waypoints; when included. POST /v1/trajectories/validate says
    the same of the samples. Where accelerations jump (`continuity` is C1) or jerks do (C2), splines overshoot them in
    that one interval at any `sample_period`: cubics exceed accelerations by up to two thirds."""
    warnings: list[PlanWarning]
    """What to know about the plan all the same; usually nothing."""
    request_hash: str
    """The SHA-256 of the request, `sha256:...`: of its content with the defaults filled in, however it was written, and
    of the content of an uploaded robot, whose id may be given to another one later. A catalogue robot counts by its id:
    the catalogue belongs to the version of the service. The same hash from the same version means the same answer."""


class BackendDescription(Answer):
    """One back end."""

    kind: str
    """The kind by which requests name the back end."""
    summary: str
    """What it does, in one sentence."""
    options: Annotated[dict[str, Any], Field(description="The JSON Schema of each of the back end's options, by name.")]
    guarantees: dict[str, Literal["hard", "reported", "none"]]
    """What is promised about each quantity: its limit is kept (`hard`); it is only reported, and may be exceeded
    (`reported`); or nothing is known (`none`)."""


class BackendsAnswer(Answer):
    """Every back end that there is."""

    backends: list[BackendDescription]
    """The back ends, in the order of the documentation."""
