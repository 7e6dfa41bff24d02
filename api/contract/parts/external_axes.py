"""External axes: rails, gantries and turntables that carry an arm's base, or positioners that carry the workpiece."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from api.contract.parts.common import LARGEST, Limit, Number, Pose, Schema, Vector3

JointName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-/ ]*$", max_length=100)]


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
