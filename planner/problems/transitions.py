"""Transitions: the ways in which a waypoint is passed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True)
class StopTransition:
    """A transition that comes to rest at the waypoint."""


@dataclass(frozen=True)
class ThroughTransition:
    """A transition that passes the waypoint exactly, without stopping.

    Attributes:
        velocity: Velocity of each joint at the waypoint, rad/s or m/s, between joint motions; None: one that suits.
    """

    velocity: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Keep plain numbers, which are compared and cannot change."""
        if self.velocity is not None:
            object.__setattr__(self, "velocity", tuple(map(float, self.velocity)))


@dataclass(frozen=True)
class BlendTransition:
    """A transition that cuts the corner without stopping.

    Attributes:
        radius: How near to the waypoint the tool is where it leaves its paths to and from it, m; in a scene it is less
            where the robot would collide otherwise, and a warning says so.
    """

    radius: float


Transition = StopTransition | ThroughTransition | BlendTransition
