"""Actions of a request: what happens along a trajectory besides motion."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from typing_extensions import TypeAliasType

from api.contract.parts.common import LARGEST, Schema


class ActionMoment(Schema):
    """When an action happens: at a waypoint, after a way of the tool, or at a time; one of the three."""

    waypoint: Annotated[int, Field(ge=0, le=1_000_000)] | None = None
    """The index of a waypoint, counted from 0: at the arrival there, after the waits there that are listed before. At
    a blended waypoint, it is the middle of the blend."""
    distance: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """The length of the way that the tool has gone from the start, m."""
    time: Annotated[float, Field(ge=0.0, le=LARGEST)] | None = None
    """The time from the start of the trajectory, s."""

    @model_validator(mode="after")
    def _one_of_three(self) -> ActionMoment:
        if sum(value is not None for value in (self.waypoint, self.distance, self.time)) != 1:
            raise ValueError("must have exactly one of `waypoint`, `distance` and `time`")
        return self


class SetOutput(Schema):
    """An output of the controller takes a value, on arrival at the waypoint."""

    kind: Literal["set_output"]
    """The action: an output is set."""
    name: Annotated[str, Field(min_length=1, max_length=200)]
    """The name of the output at the controller; programs of robots need a name that their language has."""
    value: bool | Annotated[float, Field(ge=-1e9, le=1e9)]
    """The value: true or false for a digital output, a number in the unit of the output for another."""


class Wait(Schema):
    """A wait at the waypoint, where the robot stops, besides its `dwell`."""

    kind: Literal["wait"]
    """The action: a wait."""
    duration: Annotated[float, Field(ge=1e-6, le=LARGEST)]
    """The duration of the wait, s; actions listed after it happen after it."""


WaypointAction = TypeAliasType(
    "WaypointAction",
    Annotated[
        SetOutput | Wait,
        Field(discriminator="kind", description="Something that happens at a waypoint besides motion."),
    ],
)


class SetOutputAction(SetOutput):
    """An output of the controller takes a value."""

    at: ActionMoment
    """When it is set."""


class WaitAction(Wait):
    """A wait at a waypoint where the robot stops, besides its `dwell`."""

    at: ActionMoment
    """The waypoint; actions listed after this one happen after it."""


Action = TypeAliasType(
    "Action",
    Annotated[
        SetOutputAction | WaitAction,
        Field(discriminator="kind", description="Something that happens along a trajectory besides motion."),
    ],
)
