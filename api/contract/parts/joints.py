"""Joints of robots: rows of tables, external axes, limits of an owner, and descriptions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from api.contract.parts.common import (
    LARGEST,
    Answer,
    Limit,
    LimitRange,
    Number,
    Pose,
    Positive,
    Schema,
    Vector3,
)
from api.contract.parts.limit_curves import TorqueCurve, VelocityCurves  # noqa: TC001 - pydantic evaluates the annotations

JointName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-/ ]*$", max_length=100)]
"""The name of a joint."""

DriveValue = Annotated[float, Field(ge=0.0, le=LARGEST)]
"""A friction or an inertia of a drive."""

FollowingError = Annotated[float, Field(ge=0.0, le=0.1)]
"""A following error of a joint, rad or m."""


class DhJoint(Schema):
    """One row of a Denavit-Hartenberg table."""

    kind: Literal["revolute", "continuous", "prismatic"]
    """The kind of joint; `continuous` is revolute without position limits."""
    theta: Number
    """The angle about z, rad; of a revolute joint: where its zero is."""
    d: Number
    """The offset along z, m; of a prismatic joint: where its zero is."""
    a: Number
    """The length along x, m."""
    alpha: Number
    """The twist about x, rad."""
    name: JointName | None = None
    """The name of the joint; omitted: `joint_1`, `joint_2`, ..."""
    lower: Number | None = None
    """The lower position limit, rad or m; omitted: none."""
    upper: Number | None = None
    """The upper position limit, rad or m; omitted: none."""
    velocity: Positive | None = None
    """The velocity limit, rad/s or m/s; omitted: a default, as the answer says."""
    acceleration: Positive | None = None
    """The acceleration limit, rad/s^2 or m/s^2; omitted: a default, as the answer says."""
    jerk: Positive | None = None
    """The jerk limit, rad/s^3 or m/s^3; omitted: a default, as the answer says."""
    torque: Positive | None = None
    """The torque limit, N m or N; omitted: none."""
    velocity_curves: VelocityCurves | None = Field(None, exclude_if=lambda curves: curves is None)
    """Velocity limits that depend on the position; omitted: none. The position limits end where a parabola leaves less
    than 2 % of the velocity limit; a remark among the `findings` says so."""
    torque_curve: TorqueCurve | None = Field(None, exclude_if=lambda curve: curve is None)
    """The torque limit that depends on the speed; omitted: none. `torque` is at most that at rest."""
    rms_torque: Limit | None = Field(None, exclude_if=lambda limit: limit is None)
    """The limit of the continuous (RMS) torque over a cycle, N m or N; omitted: none."""
    friction: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The Coulomb friction of the moving joint, N m or N, below the torque limit; omitted: none."""
    damping: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The viscous friction by the speed, N m s/rad or N s/m; omitted: none."""
    rotor_inertia: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The inertia of the drive's rotor, times the square of the gear ratio, kg m^2 or kg; omitted: none."""
    friction_tolerance: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the Coulomb friction from `friction`, N m or N; omitted: none."""
    damping_tolerance: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the viscous friction from `damping`, N m s/rad or N s/m; omitted: none."""
    following_error: FollowingError | None = Field(None, exclude_if=lambda value: value is None)
    """The largest distance of the actual position from the planned one, rad or m; omitted: none."""
    mass: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """The mass of the link that the joint moves, kg; omitted: unknown."""
    center_of_mass: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The center of mass x, y, z of that link, in the frame that this row ends in, m; omitted: its origin."""
    inertia: Annotated[list[Number], Field(min_length=6, max_length=6)] | None = None
    """The inertia ixx, ixy, ixz, iyy, iyz, izz about the center of mass, in the axes of that frame, kg m^2; omitted:
    unknown."""


class OwnLimits(Schema):
    """Limits of one joint by the robot's owner; omitted fields stay as they are."""

    lower: Number | None = None
    """The lower position limit, rad or m."""
    upper: Number | None = None
    """The upper position limit, rad or m."""
    velocity: Limit | None = None
    """The velocity limit, rad/s or m/s."""
    acceleration: Limit | None = None
    """The acceleration limit, rad/s^2 or m/s^2."""
    jerk: Limit | None = None
    """The jerk limit, rad/s^3 or m/s^3."""
    torque: Limit | None = None
    """The torque limit, N m or N."""
    velocity_range: LimitRange | None = None
    """The lower and the upper velocity where they differ, the lower one negative, rad/s or m/s."""
    acceleration_range: LimitRange | None = None
    """The lower and the upper acceleration where they differ, rad/s^2 or m/s^2."""
    torque_range: LimitRange | None = None
    """The lower and the upper torque where they differ, N m or N."""
    velocity_curves: VelocityCurves | None = Field(None, exclude_if=lambda curves: curves is None)
    """Velocity limits that depend on the position. They hold beside the joint's other velocity curves."""
    torque_curve: TorqueCurve | None = Field(None, exclude_if=lambda curve: curve is None)
    """The torque limit that depends on the speed, nowhere above the joint's other torque curve."""
    rms_torque: Limit | None = Field(None, exclude_if=lambda limit: limit is None)
    """The limit of the continuous (RMS) torque over a cycle, N m or N."""
    friction: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The Coulomb friction of the moving joint, N m or N, below the torque limit."""
    damping: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The viscous friction by the speed, N m s/rad or N s/m."""
    rotor_inertia: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The inertia of the drive's rotor, times the square of the gear ratio, kg m^2 or kg."""
    friction_tolerance: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the Coulomb friction from `friction`, N m or N. Torque limits hold for
    all friction within."""
    damping_tolerance: DriveValue | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the viscous friction from `damping`, N m s/rad or N s/m."""
    following_error: FollowingError | None = Field(None, exclude_if=lambda value: value is None)
    """The largest distance of the actual position from the planned one, rad or m. Limits hold for all actual
    positions."""


class JointDescription(Answer):
    """One degree of freedom."""

    name: str
    """The name of the joint."""
    kind: Literal["revolute", "continuous", "prismatic"]
    """The kind of joint; `continuous` is revolute without position limits."""
    lower: float | None
    """The lower position limit, rad or m; null: none."""
    upper: float | None
    """The upper position limit, rad or m; null: none."""
    velocity: float | None
    """The velocity limit, rad/s or m/s; null: none."""
    acceleration: float | None
    """The acceleration limit, rad/s^2 or m/s^2; null: none."""
    jerk: float | None
    """The jerk limit, rad/s^3 or m/s^3; null: none."""
    torque: float | None
    """The torque limit, N m or N; null: none."""
    velocity_range: list[float] | None
    """The lower and the upper velocity, rad/s or m/s, where they differ; null: the same in both directions."""
    acceleration_range: list[float] | None
    """The lower and the upper acceleration, rad/s^2 or m/s^2, where they differ; null: the same in both directions."""
    torque_range: list[float] | None
    """The lower and the upper torque, N m or N, where they differ; null: the same in both directions."""
    velocity_curves: VelocityCurves | None = Field(None, exclude_if=lambda curves: curves is None)
    """The velocity limits that depend on the position; omitted: none. `velocity` holds beside them."""
    torque_curve: TorqueCurve | None = Field(None, exclude_if=lambda curve: curve is None)
    """The torque limit that depends on the speed; omitted: none. `torque` holds beside it."""
    rms_torque: float | None = Field(None, exclude_if=lambda limit: limit is None)
    """The limit of the continuous (RMS) torque over a cycle, N m or N; omitted: none."""
    friction: float | None = Field(None, exclude_if=lambda value: value is None)
    """The Coulomb friction of the moving joint, N m or N; omitted: none."""
    damping: float | None = Field(None, exclude_if=lambda value: value is None)
    """The viscous friction by the speed, N m s/rad or N s/m; omitted: none."""
    rotor_inertia: float | None = Field(None, exclude_if=lambda value: value is None)
    """The inertia of the drive's rotor, as seen from the joint, kg m^2 or kg; omitted: none."""
    friction_tolerance: float | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the Coulomb friction from `friction`, N m or N; omitted: none."""
    damping_tolerance: float | None = Field(None, exclude_if=lambda value: value is None)
    """The largest difference of the viscous friction from `damping`, N m s/rad or N s/m; omitted: none."""
    following_error: float | None = Field(None, exclude_if=lambda value: value is None)
    """The largest distance of the actual position from the planned one, rad or m; omitted: none."""
    provenance: dict[str, Literal["published", "datasheet", "estimate", "default", "owner"]]
    """The source of each limit, by the name of its quantity. It is `published` with the robot, its `datasheet`, an
    `estimate`, a `default` of the service, or its `owner`."""


class ExternalAxis(Schema):
    """A linear or rotary axis that carries the base of the arm, the workpiece, or the next axis."""

    name: JointName
    """The name of the joint, by which limits and waypoints (`external`) name it."""
    kind: Literal["prismatic", "revolute", "continuous"]
    """The kind of joint: `prismatic`, a rail; `revolute`, a turntable, or `continuous` without position limits."""
    axis: Vector3
    """The direction along which the axis slides, or about which it turns, in its own frame, without unit and of any
    length above 1e-9."""
    origin: Pose | None = None
    """The frame of the axis at position 0, in the base frame (m), or in the link that the axis before it moves.
    Omitted: the same frame."""
    lower: Number | None = None
    """The lower position limit, rad or m; only a `continuous` axis has none."""
    upper: Number | None = None
    """The upper position limit, rad or m; only a `continuous` axis has none."""
    velocity: Limit | None = None
    """The velocity limit, rad/s or m/s; omitted: a default, as the answer says."""
    acceleration: Limit | None = None
    """The acceleration limit, rad/s^2 or m/s^2; omitted: a default, as the answer says."""
    jerk: Limit | None = None
    """The jerk limit, rad/s^3 or m/s^3; omitted: a default, as the answer says."""
    torque: Limit | None = None
    """The torque or force limit, N m or N; omitted: none."""
    mass: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """The mass of the carriage or table that the axis moves, without the arm and the axes behind it, but with the
    workpiece, kg. Omitted: it weighs nothing."""
    center_of_mass: Vector3 = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """The center of mass x, y, z of this mass, in the frame of the axis, m; omitted: its origin."""
    inertia: Annotated[list[Number], Field(min_length=6, max_length=6)] | None = None
    """The inertia ixx, ixy, ixz, iyy, iyz, izz of this mass about its center, kg m^2; omitted: unknown. Its directions
    are the axes of the frame of the axis."""
