"""What happens along a trajectory besides motion: outputs that are set, and waits."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AtWaypoint:
    """The arrival at a waypoint, and after it the waits that are listed before, one after the other.

    Attributes:
        waypoint: Index of the waypoint.
    """

    waypoint: int


@dataclass(frozen=True)
class AtDistance:
    """The moment at which the tool has gone so far.

    Attributes:
        distance: Length of the way of the tool from the start of the trajectory, m.
    """

    distance: float


@dataclass(frozen=True)
class AtTime:
    """A time of the trajectory.

    Attributes:
        time: Time from its start, s.
    """

    time: float


Moment = AtWaypoint | AtDistance | AtTime
"""When an action happens."""


@dataclass(frozen=True)
class SetOutput:
    """An output of the controller takes a value.

    Attributes:
        at: When.
        name: The controller's name of the output.
        value: The value, true and false for a digital one.
    """

    at: Moment
    name: str
    value: bool | float


@dataclass(frozen=True)
class Wait:
    """A wait at a waypoint where the robot rests, as a part of its dwell: actions listed after it happen later.

    Attributes:
        at: The waypoint.
        duration: Duration of the wait, s.
    """

    at: Moment
    duration: float


Action = SetOutput | Wait
"""Something that happens along a trajectory."""
