"""Pictures of a plan: their contents."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypeAliasType

from api.contract.parts.common import Schema

Shown = TypeAliasType(
    "Shown",
    Annotated[
        Literal[
            "position",
            "velocity",
            "acceleration",
            "jerk",
            "torque",
            "tcp_position",
            "tcp_orientation",
            "tcp_velocity",
            "tcp_angular_velocity",
            "tcp_acceleration",
            "tcp_angular_acceleration",
            "tcp_speed",
            "path",
            "robot",
        ],
        Field(
            description="Something that a picture shows. Over time `position`, `velocity`, `acceleration`, `jerk` and "
            "`torque` of the joints, with their limits; of the tool, in the axes of the base, `tcp_position`, "
            "`tcp_orientation` (roll, pitch, yaw), `tcp_velocity`, `tcp_angular_velocity`, `tcp_acceleration`, "
            "`tcp_angular_acceleration` and `tcp_speed`. In space the `path` of the tool, coloured by its speed, or "
            "the `robot` as a stick model at every waypoint."
        ),
    ],
)

PictureView = TypeAliasType(
    "PictureView",
    Annotated[
        Literal["isometric", "xy", "xz", "yz"],
        Field(description="Where a view in space looks from: obliquely, or onto a plane of the base frame."),
    ],
)

MOST_JOINTS = 64
"""The most names of joints in a picture."""


class Picture(Schema):
    """The contents of the pictures of a plan (`svg`, `png`); lengths are in mm, angles in degrees."""

    show: Annotated[list[Shown], Field(min_length=1, max_length=8)] | None = None
    """The parts of the picture, from above; omitted: positions, velocities and accelerations of the joints."""
    joints: Annotated[list[str], Field(min_length=1, max_length=MOST_JOINTS)] | None = None
    """The names of the joints whose graphs are drawn; omitted: all."""
    axes: Annotated[list[Literal["x", "y", "z"]], Field(min_length=1, max_length=3)] | None = None
    """The axes of the base along which quantities of the tool are drawn; omitted: all."""
    view: PictureView = "isometric"
    """Where the path and the robot are looked at from."""
    title: Annotated[str, Field(max_length=200)] | None = None
    """The title; omitted: the robot's id."""
