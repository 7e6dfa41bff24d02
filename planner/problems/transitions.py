"""Transitions: stopping at a waypoint, passing it or cutting the corner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class StopTransition:
    """A transition that comes to rest at the waypoint."""


@dataclass(frozen=True)
class ThroughTransition:
    """A transition that passes the waypoint exactly, without stopping.

    Attributes:
        velocity: Velocity of each joint at the waypoint, rad/s or m/s, between joint motions; None: free.
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
        radius: Distance from the waypoint at which the tool leaves its paths to and from it, m. In a scene, the planner
            reduces the radius to avoid a collision, with a warning.
    """

    radius: float


Transition = StopTransition | ThroughTransition | BlendTransition
"""Type of a transition at a waypoint."""
