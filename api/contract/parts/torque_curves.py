"""Torque limits of joints that depend on the speed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from api.contract.parts.common import LARGEST, Positive, Schema


class TorqueCurve(Schema):
    """The largest torque by speed, linear between the points and constant beyond the first and last one."""

    speeds: Annotated[list[Annotated[float, Field(ge=0.0, le=LARGEST)]], Field(min_length=2, max_length=64)]
    """The speeds, ascending, rad/s or m/s."""
    torques: Annotated[list[Positive], Field(min_length=2, max_length=64)]
    """The largest torques at these speeds, N m or N. They must not grow with the speed."""
