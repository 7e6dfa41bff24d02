"""Requests and answers of the operations on trajectories: retime, stop, reverse, slice, join, resample."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.answers import (
    CertificateAnswer,
    InterpolationCertificate,
    JointPolynomials,
    PlanWarning,
    Samples,
)
from api.contract.parts.backends import Backend  # noqa: TC001
from api.contract.parts.common import (
    DEFAULT_DEADLINE,
    LARGEST,
    Answer,
    BoxSizes,
    Deadline,
    JointVector,
    Limits,
    Moments,
    Mounting,
    NamedRobot,
    Number,
    Payload,
    Schema,
    Tool,
    Vector3,
)
from api.contract.parts.scenes import SceneOrId, SpeedZones  # noqa: TC001
from api.contract.requests import MOST_ROWS, GivenTrajectory, default_backend

Quantity = TypeAliasType(
    "Quantity",
    Annotated[
        Literal[
            "position",
            "velocity",
            "acceleration",
            "jerk",
            "torque",
            "tcp_linear_velocity",
            "tcp_angular_velocity",
            "tcp_linear_acceleration",
            "tcp_angular_acceleration",
            "tcp_centripetal_acceleration",
            "tcp_linear_jerk",
            "tcp_angular_jerk",
        ],
        Field(description="A quantity that a limit is put on: of the joints, or of the tool's motion."),
    ],
)

IncludeOfOperation = TypeAliasType(
    "IncludeOfOperation",
    Annotated[
        Literal[
            "jerk", "torque", "tcp_pose", "tcp_rpy", "tcp_velocity", "tcp_acceleration", "polynomials", "sample_checks"
        ],
        Field(
            description="Something that an answer holds on demand: columns of the samples (`jerk`, `torque`; of the "
            "tool `tcp_pose`, `tcp_rpy`, `tcp_velocity`, `tcp_acceleration`), the joints' piecewise `polynomials`, "
            "with which other operations go on, or `sample_checks`: what a controller reaches that interpolates "
            "between the samples."
        ),
    ],
)


class OperationRequest(Schema):
    """What all operations on trajectories share: the robot, the limits of the answer and its form."""

    robot: NamedRobot
    limits: Limits = Limits()
    """The limits that the answer keeps; omitted limits are the robot's own."""
    tool: Tool = None
    mounting: Mounting = None
    payload: Payload | None = None
    """The body that the robot carries; omitted: none."""
    scene: SceneOrId | None = None
    """The scene around the robot, in the world or its base. The answer is proved to keep clear of it at all times, and
    its certificate has the `clearance`, or it is refused. Omitted: nothing is known."""
    self_collision: bool | None = None
    """Whether the arm is proved not to meet itself; omitted: in a scene, unless its shapes are capsules along
    its kinematics."""
    speed_zones: SpeedZones = Field(default_factory=list)
    """The speeds that no point of the robot exceeds near objects of the `scene`, with `speed_zones` in the certificate.
    `retime` slows the motion there on its path; what another operation makes is proved to keep them, or refused. It is
    no safety function."""
    include: Annotated[list[IncludeOfOperation], Field(max_length=16)] = Field(default_factory=list)
    """What else the answer should hold; each makes it larger."""
    deadline: Deadline = DEFAULT_DEADLINE


class EditRequest(OperationRequest):
    """The common fields of the operations that keep polynomials."""

    enforced: Annotated[list[Quantity], Field(max_length=32)] | None = None
    """The quantities whose limits the answer keeps, or is a problem document; omitted: all that are bounded. A quantity
    that jumps bounds no derivative: where accelerations jump, no jerk is bounded, and its limit is only reported."""


SamplePeriod = Annotated[float, Field(ge=1e-6, le=LARGEST, description="The time between two rows of the answer, s.")]


class ReverseRequest(EditRequest):
    """A trajectory to run backwards."""

    trajectory: GivenTrajectory
    """The trajectory."""
    sample_period: SamplePeriod = 0.01


class SliceRequest(EditRequest):
    """A trajectory to cut a part out of."""

    trajectory: GivenTrajectory
    """The trajectory."""
    start: Number = 0.0
    """When the slice begins, s from the start of the trajectory."""
    end: Number | None = None
    """When the slice ends, s from the start of the trajectory; omitted: at its end."""
    sample_period: SamplePeriod = 0.01


class JoinRequest(EditRequest):
    """Trajectories to run one after the other."""

    trajectories: Annotated[list[GivenTrajectory], Field(min_length=1, max_length=1000)]
    """The trajectories, in order."""
    tolerance: Annotated[float, Field(ge=0.0, le=0.1)] = 1e-6
    """The largest distance of a joint at the start of a trajectory from the end of the one before, rad or m. The later
    one is shifted to begin there. Velocities must meet but for rounding."""
    sample_period: SamplePeriod = 0.01


class ResampleRequest(EditRequest):
    """A trajectory to sample again, as the controller runs it that `interpolation` names."""

    trajectory: GivenTrajectory
    """The trajectory."""
    period: Annotated[float, Field(ge=1e-6, le=LARGEST)] | None = None
    """The time between two rows of the answer, s, the last of which is at the end; omitted: 0.01, or what `times`
    says."""
    times: Annotated[list[Number], Field(min_length=1, max_length=MOST_ROWS, fail_fast=True)] | None = None
    """The times of the rows of the answer in place of a period, s from the start of the trajectory, strictly
    increasing."""


class RetimeRequest(OperationRequest):
    """A dense list of joint positions, or a trajectory of any origin, to put time on; from rest to rest."""

    points: Annotated[list[JointVector], Field(min_length=1, max_length=20_000, fail_fast=True)] | None = None
    """The joint positions, shape (points, joints), rad or m; repeated points count once."""
    trajectory: GivenTrajectory | None = None
    """A trajectory in place of points: the positions of its samples, or 2,000 positions along its polynomials."""
    backend: Backend = Field(
        default_factory=lambda: default_backend(), description="What puts time on the path; omitted: the cubic."
    )
    max_deviation: Annotated[float, Field(ge=1e-6, le=1.0)] = 1e-3
    """The largest distance of a joint from the points and the straight lines between them, rad or m. Smaller noise
    vanishes, and corners are rounded; noise that is larger has to be followed, which is slow."""
    sample_period: SamplePeriod = 0.01


class GivenJointState(Schema):
    """The motion of all joints at one time."""

    position: JointVector
    """The joint positions, one value a joint, rad or m."""
    velocity: JointVector
    """The joint velocities, one value a joint, rad/s or m/s."""
    acceleration: JointVector | None = None
    """The joint accelerations, one value a joint, rad/s^2 or m/s^2; omitted: none."""


class MaxPayloadRequest(Schema):
    """A trajectory, and the centre of mass of the payload whose largest mass is requested."""

    robot: NamedRobot
    trajectory: GivenTrajectory
    """The trajectory."""
    center_of_mass: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The centre of mass x, y, z in the tip frame, m; omitted: its origin."""
    center_of_mass_tolerance: BoxSizes = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Half the sizes x, y, z of a box about the centre of mass, m. The robot carries the mass with any centre of mass
    in the box."""
    inertia: Moments = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The moments of inertia ixx, iyy, izz about the centre of mass, in the axes of the tip frame, kg m^2, whatever the
    mass."""
    inertia_tolerance: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """The largest difference of each moment from `inertia`, as a share of it: 0.2 is 20 %."""
    carried: Payload | None = None
    """The body that the robot carries already, such as a gripper; omitted: none."""
    mounting: Mounting = None
    limits: Limits = Limits()
    """The limits of torque, RMS torque and power. Limits that are omitted are the robot's own, and limits that do not
    depend on the payload do not count."""
    deadline: Deadline = DEFAULT_DEADLINE


class MaxPayloadAnswer(Answer):
    """The heaviest payload with which a trajectory keeps its torque limits."""

    robot: str
    """The id of the robot, as in the request."""
    mass: float | None
    """The mass, kg, besides the carried one, accurate to 0.01 %; null: no joint feels it, and the robot has no known
    rating."""
    limited_by: (
        Literal[
            "torque",
            "torque_at_speed",
            "rms_torque",
            "power",
            "total_power",
            "acceleration",
            "acceleration_at_speed",
            "jerk",
            "jerk_at_speed",
            "rating",
        ]
        | None
    )
    """The quantity whose limit bounds the mass, or `rating`, the rated payload of the robot; null: none."""
    joint: str | None
    """The name of the joint whose limit it is; null: it is not one of a joint."""
    time: float | None
    """The time at which it does, s; null: no limit of the motion does."""


class StopRequest(EditRequest):
    """A motion to stop as fast as the limits let it: a trajectory and a time, or a state."""

    trajectory: GivenTrajectory | None = None
    """The trajectory that is under way."""
    time: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """When the stop begins, s from the start of the trajectory; only with one."""
    state: GivenJointState | None = None
    """The state in which the stop begins, in place of a trajectory and a time."""
    mode: Literal["on_path", "joints"] | None = None
    """How to stop. `on_path`: the tool keeps to the path of the trajectory. `joints`: each joint by itself as fast
    as its limits let it, which may leave the path. Omitted: on the path of a trajectory, from a state joint by
    joint."""
    sample_period: SamplePeriod = 0.01


class AnsweredJointState(Answer):
    """The motion of all joints at one time."""

    position: list[float]
    """The joint positions, one value a joint, rad or m."""
    velocity: list[float]
    """The joint velocities, one value a joint, rad/s or m/s."""
    acceleration: list[float]
    """The joint accelerations, one value a joint, rad/s^2 or m/s^2."""


class OperationAnswer(Answer):
    """A certified trajectory that an operation made."""

    robot: str
    """The id of the robot, as in the request."""
    joint_names: list[str]
    """The names of the joints in the order of every joint array."""
    duration: float
    """The duration of the trajectory, s."""
    initial: AnsweredJointState
    """The state that it begins in, which may be in motion: then the warning `starts_in_motion` says so."""
    final: AnsweredJointState
    """The state that it ends in, which may be in motion: then the warning `ends_in_motion` says so."""
    samples: Samples
    """The trajectory, sampled; the polynomials that were sent are one segment, of index 0."""
    certificate: CertificateAnswer
    """The checks: the peaks of all quantities against their limits, with the motion before and after the
    trajectory as its own."""
    polynomials: list[JointPolynomials] | None = None
    """The trajectory itself, as one piecewise polynomial a joint; when included."""
    sample_checks: list[InterpolationCertificate] | None = None
    """The checks of these samples as a controller interpolates them, for each interpolation, against the same limits;
    when included."""
    warnings: list[PlanWarning]
    """What to know about the trajectory all the same; usually nothing."""


class ValidationAnswer(InterpolationCertificate):
    """The checks of a trajectory of any origin."""

    warnings: list[PlanWarning]
    """The remarks, such as limits that hold for planned positions alone; usually none."""


class RetimeAnswer(OperationAnswer):
    """A list of joint positions with time on it."""

    backend: str
    """The kind of the requested back end."""
    solver: str | None
    """The solver of the velocity profile of `toppra`, `kernel` or `package`. Null: none, as for motions in closed form,
    with limited jerk and by other back ends."""
    deviation: float
    """The largest distance of a joint from the points and the straight lines between them, rad or m."""


class JunctionAnswer(Answer):
    """Where two joined trajectories meet."""

    time: float
    """When, s from the start of the whole."""
    position_gap: list[float]
    """The shift of the later one so that it begins where the one before ends, one value a joint, rad or m."""
    velocity_gap: list[float]
    """The differences of the velocities, one value a joint, rad/s or m/s: rounding."""
    acceleration_gap: list[float]
    """The jumps of the accelerations, one value a joint, rad/s^2 or m/s^2."""


class JoinAnswer(OperationAnswer):
    """Several trajectories as one."""

    junctions: list[JunctionAnswer]
    """Where they meet, one fewer than there are trajectories."""
