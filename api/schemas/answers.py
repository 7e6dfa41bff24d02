"""Answers about trajectories, back ends and the service itself."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from api.schemas.common import Answer
from api.schemas.kinematics import AnsweredPose  # noqa: TC001 - pydantic evaluates the annotations
from api.schemas.problems import Problem  # noqa: TC001


class TcpPoses(Answer):
    """Poses of the tool in the base frame; rows are time."""

    position: list[list[float]]
    """m."""
    quaternion_xyzw: list[list[float]]


class Samples(Answer):
    """The trajectory, sampled; rows are time."""

    time: list[float]
    """s; the first is 0, the last is the duration, strictly increasing."""
    position: list[list[float]]
    """rad or m."""
    velocity: list[list[float]]
    """rad/s or m/s."""
    acceleration: list[list[float]]
    """rad/s^2 or m/s^2."""
    segment: list[int]
    """Which segment the row is on."""
    jerk: list[list[float]] | None = None
    """rad/s^3 or m/s^3; when included."""
    torque: list[list[float]] | None = None
    """N m or N; when included."""
    tcp_pose: TcpPoses | None = None
    """When included."""


class PlannedWaypoint(Answer):
    """A waypoint as it was solved and timed."""

    index: int
    name: str | None
    arrival_time: float
    """s."""
    departure_time: float
    """s, after the dwell."""
    position: list[float]
    """Joint position, rad or m."""
    pose: AnsweredPose
    position_error: float
    """m, from the pose asked."""
    orientation_error: float | None
    """rad; null: no orientation was asked."""
    solutions: int | None
    """How many isolated solutions the pose has; null: a joint waypoint, or a continuum."""
    solution: int | None
    """Which of them was taken, in the order of their distance in time from the waypoint before: 0 is the nearest; null:
    a joint waypoint, or a continuum."""
    choice: Literal["given", "only", "shortest_way", "continued"]
    """Why: `given`, a joint waypoint; `only`, there is no other solution; `shortest_way`, with it the way through the
    whole list is shortest; `continued`, a linear or circular motion ends there."""
    manipulability: float
    """sqrt(det(J J^T)) of Yoshikawa (1985)."""


class Check(Answer):
    """The worst of one quantity over the trajectory."""

    quantity: str
    joint: str | None
    """The worst joint; null for the tool's speeds."""
    peak: float
    """Signed for a position, a magnitude otherwise."""
    limit: float | None
    """null: there is none."""
    ratio: float | None
    """How much of the limit is used: 1 is all of it; null: no limit, or no bound."""
    time: float
    """s, when."""
    method: Literal["exact", "sampled"]
    """Extrema of the polynomials, or dense samples."""
    enforced: bool
    """Whether the limit is promised to be kept, or only reported."""
    bounded: bool
    """False: the quantity has impulses that no peak measures (the jerk of a cubic at its ends)."""


class CertificateAnswer(Answer):
    """What was checked after planning, by code that shares nothing with the back ends."""

    satisfied: bool
    """Every enforced limit is kept."""
    waypoint_error: float
    """Largest distance of a joint from its waypoint, rad or m."""
    continuity: str
    """`C1`: position and velocity are continuous; `C2`: the acceleration too; ..."""
    checks: list[Check]
    """One a quantity."""


class JointPolynomials(Answer):
    """One joint's piecewise polynomial."""

    joint: str
    breakpoints: list[float]
    """s."""
    coefficients: list[list[float]]
    """One row a piece: ascending powers of the time since the piece's start."""


class PlanWarning(Answer):
    """Something to know about a plan that is good all the same."""

    code: str
    message: str


class PlanAnswer(Answer):
    """A certified trajectory."""

    robot: str
    joint_names: list[str]
    backend: str
    duration: float
    """s."""
    samples: Samples
    waypoints: list[PlannedWaypoint]
    certificate: CertificateAnswer
    polynomials: list[JointPolynomials] | None = None
    """When included."""
    warnings: list[PlanWarning]
    request_hash: str
    """Of the request with its defaults filled in."""


class ComparedBackend(Answer):
    """What one back end makes of the waypoints."""

    backend: str
    status: str
    """`planned`, or the code of the problem."""
    duration: float | None
    """s."""
    peak_jerk: float | None
    """Of any joint, rad/s^3 or m/s^3; steps of the acceleration not counted."""
    rms_jerk: float | None
    """Root of the mean over time of the sum over joints of jerk^2."""
    effort: float | None
    """Integral of the sum of (torque / limit)^2, s; null: torques are unknown or unlimited."""
    mechanical_energy: float | None
    """Integral of the sum of |torque times velocity|, J; null: torques are unknown."""
    waypoint_error: float | None
    """Largest distance of a joint from a waypoint that is to be met, rad or m."""
    path_deviation: float | None
    """Largest distance of the tool from where it goes when it stops at every waypoint, m."""
    trajectory: PlanAnswer | None
    problem: Problem | None


class ComparisonAnswer(Answer):
    """The same waypoints through several back ends, in the order asked."""

    results: list[ComparedBackend]


class RosTime(Answer):
    """builtin_interfaces/Time or Duration."""

    sec: int
    nanosec: int


class RosHeader(Answer):
    """std_msgs/Header."""

    stamp: RosTime
    """0: start at once."""
    frame_id: str


class RosPoint(Answer):
    """trajectory_msgs/JointTrajectoryPoint."""

    positions: list[float]
    velocities: list[float]
    accelerations: list[float]
    effort: list[float]
    """Torques when included, else empty."""
    time_from_start: RosTime


class RosJointTrajectory(Answer):
    """trajectory_msgs/JointTrajectory."""

    header: RosHeader
    joint_names: list[str]
    points: list[RosPoint]


class BackendDescription(Answer):
    """One back end."""

    kind: str
    summary: str
    options: Annotated[dict[str, Any], Field(description="JSON Schema of the back end's options.")]
    guarantees: dict[str, Literal["hard", "reported", "none"]]
    """For each quantity: the limit is kept; or only reported; or nothing is known."""


class BackendsAnswer(Answer):
    """Every back end that there is."""

    backends: list[BackendDescription]


class ServiceLimits(Answer):
    """The service's caps."""

    max_body_bytes: int
    """Largest request body, bytes."""
    default_deadline: float
    """s, of a request that names none."""
    max_deadline: float
    """s, longest deadline that a request may ask."""
    max_waypoints: int
    """Most waypoints or poses in one request."""
    max_samples: int
    """Most samples in one answer: rows times joints."""
    max_robots: int
    """Most robots kept besides the catalogue's."""
    workers: int
    """Requests that are worked on at once."""
    queue_size: int
    """Requests that may wait."""
    worker_memory_mib: int
    """Memory of a worker, MiB."""


class Liveness(Answer):
    """The process answers."""

    status: Literal["alive"]


class Readiness(Answer):
    """Whether requests should be sent here."""

    status: Literal["ready", "starting"]
    workers: int
    """How many there are to be."""
    warm_workers: int
    """How many have solved their first problem with every back end."""
