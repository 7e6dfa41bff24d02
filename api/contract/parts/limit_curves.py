"""Limits of joints that depend on the position or the speed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.common import LARGEST, Number, Positive, Schema


class VelocityParabola(Schema):
    """The largest speed towards a position: (speed + `offset`)^2 is at most `rate` times the distance to `end`."""

    kind: Literal["parabola"]
    """The kind of curve: a parabola."""
    rate: Positive
    """The factor of the distance, rad/s^2 or m/s^2. A joint on the curve decelerates by half of it at most."""
    end: Number
    """The position that the joint moves towards, rad or m."""
    offset: Annotated[float, Field(ge=0.0, le=LARGEST)] = 0.0
    """The offset of the speed, rad/s or m/s."""


class VelocityTable(Schema):
    """The largest speed by position, linear between the points and constant beyond the first and last one."""

    kind: Literal["table"]
    """The kind of curve: a table."""
    positions: Annotated[list[Number], Field(min_length=2, max_length=64)]
    """The positions, ascending, rad or m."""
    velocities: Annotated[list[Positive], Field(min_length=2, max_length=64)]
    """The largest speeds at these positions, rad/s or m/s."""


VelocityCurve = TypeAliasType(
    "VelocityCurve",
    Annotated[
        VelocityParabola | VelocityTable, Field(discriminator="kind", description="A velocity limit by position.")
    ],
)


class VelocityCurves(Schema):
    """The velocity limits of a joint by its position, beside its limit for all positions; all of them hold."""

    upper: Annotated[list[VelocityCurve], Field(max_length=8)] = Field(default_factory=list)
    """The limits of motion towards larger positions."""
    lower: Annotated[list[VelocityCurve], Field(max_length=8)] = Field(default_factory=list)
    """The limits of motion towards smaller positions, as magnitudes."""


class TorqueCurve(Schema):
    """The largest torque by speed, linear between the points and constant beyond the first and last one."""

    speeds: Annotated[list[Annotated[float, Field(ge=0.0, le=LARGEST)]], Field(min_length=2, max_length=64)]
    """The speeds, ascending, rad/s or m/s."""
    torques: Annotated[list[Positive], Field(min_length=2, max_length=64)]
    """The largest torques at these speeds, N m or N. They must not grow with the speed."""
