"""Answers about trajectories."""

from __future__ import annotations

from typing import Any, Literal

from api.contract.kinematics import AnsweredConfiguration, AnsweredPose  # noqa: TC001 - pydantic evaluates annotations
from api.contract.parts.common import Answer
from api.contract.parts.free_motions import OptimisationAnswer, RideAnswer, WayGain  # noqa: TC001
from api.contract.parts.problem_documents import Choice  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.scenes import ClearancesAnswer, CollisionAnswer, SpeedZoneAnswer  # noqa: TC001


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
    """Samples of the trajectory; rows are time."""

    time: list[float]
    """The times of the rows, s: the first is 0, the last is the duration, strictly increasing."""
    position: list[list[float]]
    """The joint positions, shape (times, joints), rad or m."""
    velocity: list[list[float]]
    """The joint velocities, shape (times, joints), rad/s or m/s."""
    acceleration: list[list[float]]
    """The joint accelerations, shape (times, joints), rad/s^2 or m/s^2."""
    segment: list[int]
    """The index of each row's segment; segment i goes from waypoint i to waypoint i + 1."""
    jerk: list[list[float]] | None = None
    """The joint jerks, shape (times, joints), rad/s^3 or m/s^3; when included."""
    torque: list[list[float]] | None = None
    """The joint torques, shape (times, joints), N m or N; when included."""
    tcp_pose: TcpPoses | None = None
    """The poses of the tool; when included."""
    tcp_rpy: list[list[float]] | None = None
    """The orientation of the tool as roll, pitch and yaw, shape (times, 3), rad; when included. The angles are
    rotations about the fixed axes x, y, z of the base, as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll). The pitch is in
    [-pi/2, pi/2]; roll and yaw are continuous from row to row and may leave [-pi, pi]. At a pitch of a quarter turn,
    the roll keeps its last value (0 at the start)."""
    tcp_velocity: TcpVelocities | None = None
    """The velocities of the tool; when included."""
    tcp_acceleration: TcpAccelerations | None = None
    """The accelerations of the tool; when included."""


class RegionOffsets(Answer):
    """The offsets of a pose from the requested pose, within its tolerance region."""

    x: float | None = None
    """The shift along the x axis of the pose, m."""
    y: float | None = None
    """The shift along its y axis, m."""
    z: float | None = None
    """The shift along its z axis, m."""
    rotation_x: float | None = None
    """The rotation about its x axis, rad."""
    rotation_y: float | None = None
    """The rotation about the y axis after that rotation, rad."""
    rotation_z: float | None = None
    """The rotation about the tool's own z axis, rad."""


class PlannedWaypoint(Answer):
    """A waypoint with its joint position and its times."""

    index: int
    """The index of the waypoint in the request, from 0. A corner of a detour (`detour`) has the index of the
    waypoint that the detour leads to. All waypoints of an option have the index of their goal set."""
    name: str | None
    """The name in the request; null: none."""
    arrival_time: float
    """The time of arrival, s from the start of the trajectory."""
    departure_time: float
    """The time of departure after the dwell, s from the start of the trajectory."""
    position: list[float]
    """The joint position, one value for each joint, rad or m."""
    pose: AnsweredPose
    """The pose of the tool there, in the base frame (m)."""
    position_error: float
    """The position error of the tool, m; for a move after an open pose, relative to the pose that was reached."""
    orientation_error: float | None
    """The orientation error of the tool, rad; null: no orientation was requested."""
    solutions: int | None
    """The number of isolated solutions of the pose; in a scene, of the collision-free ones if there are any. Null: a
    joint waypoint, a continuum, or a pose on a moving object."""
    solution: int | None
    """The index of the chosen solution, ordered by the travel time from the waypoint before: 0 is the nearest. Null: a
    joint waypoint, a continuum, or a pose on a moving object."""
    choice: Literal["given", "only", "shortest_path", "preferred", "continued", "detour"]
    """The reason for this solution. `given`: a joint waypoint. `only`: the only solution. `shortest_path`: the path
    through the whole list is shortest with it. `preferred`: best by the preference of the request. `continued`: the
    end of a tool motion. `detour`: a corner of the detour of a free motion, or where the robot gets on or off a
    moving object."""
    configuration: AnsweredConfiguration
    """The configuration of the arm, by its names."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985), in the units of J: 0 where the arm is singular."""
    free: RegionOffsets | None = None
    """With `free` in the request: the place of the waypoint in its tolerance region."""
    gain: WayGain | None = None
    """With a free motion to here: the gain of its optimisation."""


class Check(Answer):
    """The peak of one quantity over the trajectory."""

    quantity: str
    """The quantity: `position`, `velocity`, `velocity_at_position`, `acceleration`, `jerk`, `torque`,
    `acceleration_at_speed`, `jerk_at_speed`, `torque_at_speed`, `rms_torque`,
    `torque_with_tolerances` (the largest within tolerances and following errors),
    `power`, `total_power` (of all joints). Of the tool: `tcp_linear_velocity`, `tcp_angular_velocity`,
    `tcp_linear_acceleration`, `tcp_angular_acceleration`, `tcp_centripetal_acceleration` (across the path),
    `tcp_linear_jerk`, `tcp_angular_jerk`. Deviations of the tool from the requested path: `path_position_deviation`,
    `path_orientation_deviation`, `blend_deviation`. From its poses and lines on a moving object:
    `object_position_deviation`, m, and `object_orientation_deviation`, rad. With `min_effort`, the deviation from
    straight joint motions: `tool_deviation` of the tool, m, and `joint_deviation` of the farthest joint, rad or m.
    Errors against the request: `passing_velocity_error` of a joint, rad/s or m/s, and `duration_error` of durations,
    dwells and arrivals, s. The tool has `waypoint_position_error`, m, and `waypoint_orientation_error`, rad, at pose
    and relative waypoints. `residual_vibration` is the largest amplitude that a motion from stop to stop leaves in the
    requested vibration mode, rad or m. Its limit is 5 % of the amplitude that the unshaped motion leaves."""
    joint: str | None
    """The name of the joint with the largest share of its limit; null: the quantity belongs to the tool."""
    peak: float
    """The peak of that joint or of the tool: signed for a position, else a magnitude, in the unit of the quantity."""
    limit: float | None
    """The limit of the peak, in the same unit; null: none."""
    ratio: float | None
    """The used share of the limit, without unit: 1 is the whole limit. A position counts from the middle of its range.
    null: no limit, or the quantity is unbounded."""
    time: float
    """The time of the peak, s from the start of the trajectory."""
    method: Literal["exact", "bounded", "sampled"]
    """The method. `exact`: at the extrema of the polynomials. `bounded`: the quantity exceeds `peak` at no time.
    `sampled`: in fine samples; quantities of the service are never sampled."""
    enforced: bool
    """Whether the back end promises to keep the limit; false: the value is only reported and may exceed it."""
    bounded: bool
    """Whether the peak bounds the quantity. It does not where the derivative below jumps: the quantity then has an
    impulse. The usual case is a cubic from rest. Its acceleration jumps at its ends, so its jerk is unbounded, and
    `peak` is the largest jerk between the jumps."""
    lower: float | None = None
    """With `bounded`, the value at `time` in the unit of `peak`; the true peak is between them. Missing: no bound."""
    segment: int | None = None
    """The index of the segment on which a limit of a plan binds: at least 99 % of it are used. Missing: it does not."""
    relaxed_by: list[str] | None = None
    """The names of the fields of the request, and of its robot, that would relax this limit. Missing: none binds."""


class CertificateAnswer(Answer):
    """The checks after planning, by code that shares only tested arithmetic with the back ends."""

    satisfied: bool
    """Whether the trajectory keeps every enforced limit and meets every waypoint; always true in the answer of a
    plan."""
    waypoint_error: float
    """The largest distance of a joint from its waypoint at the arrival there, rad or m."""
    continuity: str
    """The continuity, rest before and after included: `C0`, the position is continuous; `C1`, also the velocity; `C2`,
    also the acceleration; and so on. `none`: not even the position."""
    checks: list[Check]
    """One check for each quantity."""
    clearance: ClearancesAnswer | None = None
    """The clearance of the robot to itself and to the scene; missing: not checked; null: not collision-free."""
    speed_zones: list[SpeedZoneAnswer] | None = None
    """The speed of the robot in each requested speed zone; missing: none requested."""


class InterpolationCertificate(CertificateAnswer):
    """The checks of a trajectory as a controller interpolates it."""

    interpolation: Literal["linear", "cubic", "quintic", "polynomials"]
    """The interpolation between samples, or the polynomials themselves."""
    collision: CollisionAnswer | None = None
    """The pair that violates its margin, so that `satisfied` is false; null: none; missing: collisions were not
    checked."""


class JointPolynomials(Answer):
    """One joint's piecewise polynomial."""

    joint: str
    """The name of the joint."""
    breakpoints: list[float]
    """The times at which the intervals begin and the last one ends, s: one more than there are intervals."""
    coefficients: list[list[float]]
    """The coefficients, one row for each interval: ascending powers of the time since the start of the interval, rad
    or m by powers of s."""


class LinePolynomials(Answer):
    """A straight line of the tool as polynomials of time.

    The tool is at p(t) = p0 + u(t) (p1 - p0), where u(t) is the fraction of the line covered. There is one row of
    coefficients for each phase of the time scaling. A cubic or a quintic from stop to stop has one, a trapezoid
    three, and a time scaling that joint limits shape has many. Where the line begins or ends in a blend, only the rest
    of it is given.
    """

    segment: int
    """The index of the segment."""
    breakpoints: list[float]
    """The times at which the phases begin and the last one ends, s from the start of the trajectory."""
    path_parameter: list[list[float]]
    """The coefficients of u(t), one row for each phase: ascending powers of the time since the start of the phase, by
    powers of s."""
    x: list[list[float]]
    """The coefficients of x(t) in the base frame, one row for each phase, m by powers of s."""
    y: list[list[float]]
    """The coefficients of y(t) in the base frame, one row for each phase, m by powers of s."""
    z: list[list[float]]
    """The coefficients of z(t) in the base frame, one row for each phase, m by powers of s."""
    deviation: float
    """The largest distance of the tool from x(t), y(t), z(t), m, at 17 times of each interval of the joints'
    polynomials: the joints follow the line within its tolerance."""


class SlowPart(Answer):
    """An interval in which the tool is slower than its speed limit, by more than 1 %."""

    start_time: float
    """The start, s from the start of the trajectory."""
    end_time: float
    """The end, s from the start of the trajectory."""
    start_distance: float
    """The distance of the tool at the start, m from the start of the motion."""
    end_distance: float
    """The distance of the tool at the end, m from the start of the motion."""
    lowest_speed: float
    """The lowest speed of the tool in the interval, m/s."""
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
    """The cause at the slowest point: the binding limit of a joint or of the tool. `duration`: a requested duration
    and no limit. `time_law`: the form of the back end's time scaling."""
    joint: str | None
    """The name of the joint with the binding limit; null: no joint's limit binds."""
    use: float
    """The largest used share of that limit; for `duration` and `time_law`, of any limit."""


class ToolSpeedReport(Answer):
    """The speed of one tool motion, compared with its limit."""

    segment: int
    """The index of the segment."""
    limit: float
    """The limit of the tool's speed there, m/s."""
    held: float
    """The share of the path on which the tool moves at this speed, within 1 %."""
    slow: list[SlowPart]
    """The slower intervals, in order."""


class TimedAction(Answer):
    """An action with its time."""

    index: int
    """The index of the action, counted from 0: the request's `actions` come first, then its waypoints'."""
    kind: Literal["set_output", "wait"]
    """The kind of action: an output is set, or the robot waits."""
    time: float
    """The time of the action, s from the start of the trajectory; for a wait, its start."""
    distance: float
    """The distance of the tool by then, m."""
    name: str | None = None
    """With `set_output`: the name of the output."""
    value: bool | float | None = None
    """With `set_output`: the new value, a number in its own unit."""
    duration: float | None = None
    """With `wait`: its duration, s."""


class PlanWarning(Answer):
    """A remark about a valid plan."""

    code: str
    """The stable name of this kind of warning, in snake case."""
    message: str
    """The remark, for a person."""


class SegmentBounds(Answer):
    """The lower and upper limits in force of one quantity of the joints; rows are segments, in `at_samples` samples."""

    lower: list[list[float | None]]
    """The lower limits, shape (rows, joints), in the unit of the samples; null: none."""
    upper: list[list[float | None]]
    """The upper limits, shape (rows, joints), in the unit of the samples; null: none."""


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
    at_samples: dict[str, SegmentBounds] | None = None
    """The limits at each sample, for quantities whose limits depend on the robot's state, such as `velocity` with
    velocity curves. They are never wider than the segment's. Absent: no limit depends on the state."""


class PlanAnswer(Answer):
    """A certified trajectory."""

    robot: str
    """The id of the robot, as in the request."""
    joint_names: list[str]
    """The names of the joints in the order of every joint array."""
    backend: str
    """The kind of the requested back end."""
    solver: str | None
    """The solver of the velocity profile of `toppra`, `kernel` or `package`; null: none, as for closed-form motions,
    limited jerk and other back ends."""
    duration: float
    """The duration of the trajectory, s."""
    samples: Samples
    """The samples of the trajectory, one every `sample_period`."""
    waypoints: list[PlannedWaypoint]
    """The waypoints with their solutions and times, in order, including the corners of detours. Segment i goes from
    the i-th of them, counted from 0, to the next."""
    choices: list[Choice] | None = None
    """The chosen options of the goal sets of the request, if there are any, and the reasons against the others."""
    optimisation: OptimisationAnswer | None = None
    """With `optimise`: the durations without and with it."""
    rides: list[RideAnswer] | None = None
    """With waypoints `on` moving objects: the times of each ride, in order."""
    certificate: CertificateAnswer
    """The checks after planning: the peaks of all quantities and their limits."""
    actions: list[TimedAction] | None = None
    """The actions of the request in the order in which they happen; when there are any."""
    polynomials: list[JointPolynomials] | None = None
    """The trajectory itself, as one piecewise polynomial for each joint; when included."""
    tcp_polynomials: list[LinePolynomials] | None = None
    """The straight lines of the tool as polynomials of time, one entry for each linear motion; when included."""
    tcp_speed_report: list[ToolSpeedReport] | None = None
    """The speed of the tool compared with its limit, one entry for each tool motion whose segment limits
    `tcp_linear_velocity`; when included."""
    limits: SegmentLimitsAnswer | None = None
    """The limits in force on each segment; when included."""
    proof: dict[str, Any] | None = None
    """The proof of the certificate, a file that `planner check` and other stand-alone checkers verify; when included.
    docs/proof.md has its format. `statement.not_covered` names the checks that the proof does not cover."""
    sample_checks: list[InterpolationCertificate] | None = None
    """The checks of these samples as a controller interpolates them, for each interpolation; when included. The limits
    are the ones in force on each segment. POST /v1/trajectories/validate gives
    the same checks. Where accelerations jump (`continuity` is C1) or jerks do (C2), splines overshoot in that interval
    at any `sample_period`. Cubics exceed accelerations by up to two thirds."""
    warnings: list[PlanWarning]
    """Remarks about the plan; usually none."""
    request_hash: str
    """The SHA-256 of the request, `sha256:...`. It is of the content with the defaults filled in, independent of its
    notation. The content of an uploaded robot is included, because its id may be reused. A catalogue robot counts by
    its id: the catalogue belongs to the version of the service. Equal hashes of one version mean equal answers."""
