"""The common parts of the schemas: strictness, numbers within bounds, vectors, poses, limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator, model_validator
from typing_extensions import TypeAliasType

if TYPE_CHECKING:
    from collections.abc import Sequence

QUATERNION_TOLERANCE = 0.01
"""The largest error of a quaternion's norm, from 1; the contract states it."""

MATRIX_TOLERANCE = 0.01
"""The largest error of an element of R^T R, from the identity; the contract states it."""

LARGEST = 1e6
"""The largest length, angle or time (m, rad, s) of a request; products of some of them stay far from overflowing."""


SMALLEST = 1e-9
"""The smallest limit, scale or mass of a request, in its SI unit or without; smaller values are mistakes, and their
squares and reciprocals overflow."""

DEFAULT_DEADLINE = 10.0
"""The default deadline of a request, s."""


class Schema(BaseModel):
    """The base of requests, which are strict: no unknown fields, no coercion, no NaN, no infinity."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        hide_input_in_errors=True,
        defer_build=True,
    )


class Answer(BaseModel):
    """The base of answers: they are described by these models, not built through them. Fields may be added one day."""

    model_config = ConfigDict(frozen=True, defer_build=True)


Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
Limit = Annotated[float, Field(ge=SMALLEST, le=1e9)]
Scale = Annotated[float, Field(ge=SMALLEST, le=1.0)]
Seconds = Annotated[float, Field(ge=1e-6, le=LARGEST)]
Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[Number], Field(min_length=4, max_length=4)]
Matrix3 = Annotated[list[Vector3], Field(min_length=3, max_length=3)]
JointVector = Annotated[list[Number], Field(min_length=1, max_length=64)]
JointLimits = Annotated[list[Limit], Field(min_length=1, max_length=64)]
LimitRange = Annotated[list[Annotated[float, Field(ge=-1e9, le=1e9)]], Field(min_length=2, max_length=2)]
JointRanges = Annotated[list[LimitRange], Field(min_length=1, max_length=64)]
RobotId = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
NamedRobot = Annotated[RobotId, Field(description="The id of a robot, as GET /v1/robots lists them.")]
FrameName = Annotated[str, Field(min_length=1, max_length=200)]
Seed = Annotated[int, Field(ge=0, lt=2**31)]


class QuaternionOrientation(Schema):
    """A quaternion; normalised by the service, refused when its norm is off by more than 1 %."""

    kind: Literal["quaternion"]
    """The notation: a quaternion."""
    xyzw: Quaternion
    """The vector part x, y, z, then the scalar part w; four numbers without unit."""

    @field_validator("xyzw")
    @classmethod
    def _of_unit_norm(cls, xyzw: list[float]) -> list[float]:
        if abs(math.hypot(*xyzw) - 1.0) > QUATERNION_TOLERANCE:
            raise ValueError("must have a norm within 1 % of 1")
        return xyzw


class RpyOrientation(Schema):
    """Rotations about the fixed axes x, then y, then z, as in URDF."""

    kind: Literal["rpy"]
    """The notation: roll, pitch and yaw."""
    rpy: Vector3
    """Roll, pitch and yaw, rad: the angles about the base's x, y and z."""


class MatrixOrientation(Schema):
    """A rotation matrix R; refused when an element of R^T R - I exceeds 0.01, else projected onto SO(3)."""

    kind: Literal["matrix"]
    """The notation: a rotation matrix."""
    matrix: Matrix3
    """The three rows of R, three numbers without unit each; its columns are the axes of the rotated frame."""

    @field_validator("matrix")
    @classmethod
    def _a_rotation(cls, rows: list[list[float]]) -> list[list[float]]:
        x, y, z = zip(*rows, strict=True)
        products = {1.0: (_dot(x, x), _dot(y, y), _dot(z, z)), 0.0: (_dot(x, y), _dot(y, z), _dot(z, x))}
        if any(abs(p - wanted) > MATRIX_TOLERANCE for wanted, found in products.items() for p in found):
            raise ValueError("must be a rotation matrix; an element of R^T R - I exceeds 0.01")
        if _dot(x, _cross(y, z)) < 0.0:
            raise ValueError("must be a rotation matrix; got a reflection, whose determinant is negative")
        return rows


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(i * j for i, j in zip(a, b, strict=True))


def _cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


Orientation = TypeAliasType(
    "Orientation",
    Annotated[
        QuaternionOrientation | RpyOrientation | MatrixOrientation,
        Field(discriminator="kind", description="A rotation, in one of three notations."),
    ],
)


class Pose(Schema):
    """A pose of a frame: where its origin is and how it is turned."""

    position: Vector3
    """The origin x, y, z, m."""
    orientation: Orientation | None = None
    """The orientation; null or omitted: any, only the position is requested."""
    quaternion_xyzw: Quaternion | None = Field(default=None, exclude=True)
    """The orientation in the form of the `tool` and the `mounting` of GET /v1/robots/{id}, in place of `orientation`:
    a quaternion x, y, z, w without unit."""

    @model_validator(mode="after")
    def _with_one_orientation(self) -> Self:
        if self.quaternion_xyzw is not None:
            if self.orientation is not None:
                raise ValueError("must have an `orientation` or a `quaternion_xyzw`, not both")
            orientation = QuaternionOrientation(kind="quaternion", xyzw=self.quaternion_xyzw)
            object.__setattr__(self, "orientation", orientation)
            object.__setattr__(self, "quaternion_xyzw", None)
        return self


GIVES_UP = "The time after which the service gives up, s from the arrival of the request."
Deadline = Annotated[float, Field(gt=0.0, le=LARGEST, description=GIVES_UP)]
OF_TOOL = "The pose of the tool centre point in the tip frame (m); omitted: the robot's own."
Tool = Annotated[Pose | None, Field(description=OF_TOOL)]
OF_BASE = "The pose of the base in the world (m), whose z axis points up: gravity follows it. Omitted: the robot's own."
Mounting = Annotated[Pose | None, Field(description=OF_BASE)]
OF_ITSELF = (
    "Whether the arm is checked against itself; omitted: in a scene, unless its shapes are capsules along its "
    "kinematics."
)
SelfCollision = Annotated[bool | None, Field(description=OF_ITSELF)]

Shoulder = Literal["left", "right"]
Elbow = Literal["up", "down"]
Wrist = Literal["flip", "no_flip"]


class Limits(Schema):
    """Requested limits. An omitted limit is the robot's own, and none may be wider than that."""

    velocity: JointLimits | None = None
    """The largest velocity, one value for each joint, rad/s or m/s."""
    acceleration: JointLimits | None = None
    """The largest acceleration, one value for each joint, rad/s^2 or m/s^2."""
    jerk: JointLimits | None = None
    """The largest jerk, one value for each joint, rad/s^3 or m/s^3."""
    torque: JointLimits | None = None
    """The largest torque, one value for each joint, N m or N."""
    power: JointLimits | None = None
    """The largest mechanical power, one value for each joint, W: the magnitude of its torque times its velocity.
    Omitted: none."""
    total_power: Limit | None = None
    """The largest mechanical power of all joints together, W: the magnitude of the sum of torque times velocity. A
    braking joint counts as negative. The friction of the joints is in it, other losses are not. Omitted: none."""
    rms_torque: JointLimits | None = None
    """The largest continuous torque, one value for each joint, N m or N. It is the root of the mean of its square over
    the whole trajectory, or over `cycle_time`. Motions take longer until it is kept. Not at a waypoint. Omitted: that
    of the robot, if it has one."""
    cycle_time: Limit | None = None
    """The time from the start of the trajectory to its next start, s, for `rms_torque`: the robot rests after the end.
    Not at a waypoint. Omitted, or shorter than the trajectory: the trajectory repeats at once."""
    tcp_linear_velocity: Limit | None = None
    """The largest speed of the tool centre point, m/s; omitted: none."""
    tcp_angular_velocity: Limit | None = None
    """The largest angular speed of the tool, rad/s; omitted: none."""
    tcp_linear_acceleration: Limit | None = None
    """The largest acceleration of the tool centre point, m/s^2, without gravity, for loose loads; omitted: none."""
    tcp_angular_acceleration: Limit | None = None
    """The largest angular acceleration of the tool, rad/s^2; omitted: none."""
    tcp_centripetal_acceleration: Limit | None = None
    """The largest acceleration of the tool centre point across its path, m/s^2; it slows the tool in bends. Bends
    tighter than 0.1 mm, as near a reversal, count as 0.1 mm. Omitted: none."""
    tcp_linear_jerk: Limit | None = None
    """The largest jerk of the tool centre point, m/s^3; omitted: none. Back ends with jumps of the acceleration
    (`cubic`, `trapezoidal`, `toppra` without `jerk_limited`) only report it."""
    tcp_angular_jerk: Limit | None = None
    """The largest angular jerk of the tool, rad/s^3, kept and reported by the same back ends; omitted: none."""
    velocity_scale: Scale = 1.0
    """A factor without unit on the velocity limits of all joints: the speed override. A waypoint's factor multiplies
    with that of the whole trajectory. At teach speed, with a person near the arm, also set `tcp_linear_velocity` to at
    most 0.25 m/s (ISO 10218-1). Where a waypoint limits the tool's speed, too, the smaller limit holds there."""
    acceleration_scale: Scale = 1.0
    """A factor without unit on the acceleration limits of all joints."""
    torque_scale: Scale = 1.0
    """A factor without unit on the torque limits of all joints, also on torque curves. It leaves a reserve to the
    controller."""
    velocity_range: JointRanges | None = None
    """The lower and the upper velocity of each joint, shape (joints, 2), rad/s or m/s, where they differ; the lower
    ones are negative."""
    acceleration_range: JointRanges | None = None
    """The lower and the upper acceleration of each joint, shape (joints, 2), rad/s^2 or m/s^2, where they differ."""
    torque_range: JointRanges | None = None
    """The lower and the upper torque of each joint, shape (joints, 2), N m or N, where they differ."""


def _checked_moments(moments: list[float]) -> list[float]:
    """Return moments of inertia that a body can have."""
    if 2.0 * max(moments) > sum(moments) * (1.0 + 1e-9):
        raise ValueError("must have no moment above the sum of the two others")
    return moments


Moments = Annotated[
    list[Annotated[float, Field(ge=0.0, le=LARGEST)]],
    Field(min_length=3, max_length=3),
    AfterValidator(_checked_moments),
]
"""Principal moments of inertia, kg m^2."""


BoxSizes = Annotated[list[Annotated[float, Field(ge=0.0, le=LARGEST)]], Field(min_length=3, max_length=3)]
"""Half the sizes x, y, z of a box, m."""


class ProcessForce(Schema):
    """A constant force and moment that the tool exerts on the workpiece at the tool centre point."""

    force: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The force x, y, z, N; omitted: none. A drill that feeds along its z axis exerts a positive z."""
    moment: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The moment about the tool centre point x, y, z, N m; omitted: none."""
    frame: FrameName = "tool"
    """The name of the frame whose axes both are in: `tool`, whose axes turn with the tool, `base`, `world`, or one of
    the request's `frames`."""


class VibrationMode(Schema):
    """A vibration mode of the arm, driven by the acceleration of each joint."""

    frequency: Annotated[float, Field(ge=0.1, le=1000.0)]
    """The natural frequency of the undamped mode, Hz."""
    damping: Annotated[float, Field(ge=0.0, le=0.2)] = 0.0
    """The damping ratio of the mode, without unit; 1 is critical."""
    frequency_error: Annotated[float, Field(ge=0.0, le=0.19)] = 0.15
    """The largest relative error of the frequency in both directions, without unit."""


class ResidualVibration(VibrationMode):
    """A vibration mode of the arm whose residual vibration is suppressed, or only reported."""

    suppress: bool = True
    """Whether each motion from stop to stop is shaped. It then takes one period longer and leaves at most 5 % of the
    amplitude that the unshaped motion leaves. `false`: the certificate reports the amplitude."""


class Payload(Schema):
    """A body carried at the robot's tip frame (the flange, independent of the tool)."""

    mass: Annotated[float, Field(ge=SMALLEST, le=LARGEST)]
    """The mass, kg."""
    center_of_mass: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The centre of mass x, y, z in the tip frame, m; omitted: its origin."""
    inertia: Moments = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The moments of inertia ixx, iyy, izz about the centre of mass, in the axes of the tip frame, kg m^2."""
    mass_tolerance: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The largest difference of the mass from `mass`, kg, at most `mass`. Torque limits hold for every payload within
    the tolerances; the certificate has the check `torque_with_tolerances`. They cannot be combined with limits of power
    and RMS torque, nor with torque curves."""
    center_of_mass_tolerance: BoxSizes = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """Half the sizes x, y, z of a box about `center_of_mass` that contains the centre of mass, m."""
    inertia_tolerance: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """The largest difference of each moment from `inertia`, as a share of it: 0.2 is 20 %."""

    @model_validator(mode="after")
    def _with_a_positive_mass(self) -> Self:
        if self.mass_tolerance > self.mass:
            raise ValueError(f"`mass_tolerance` must be at most `mass`, {self.mass:g}; got {self.mass_tolerance:g}")
        return self
