"""Waypoints to be passed, and how they are passed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.jerk_limited.rate_limits import RateLimits
from planner.backends.ruckig.state_to_state import Rates

if TYPE_CHECKING:
    from planner.backends.ruckig.state_to_state import Synchronization
    from planner.spatial import FloatArray

LATE, OUTSIDE = 30.0, 30.0
"""Weights against the duration: of the time beyond an asked duration, of travel beyond the position limits."""

ROUNDING = 1e-9
"""Relative excess of a duration, or of a position, that is rounding."""


@dataclass(frozen=True, eq=False)
class ViaProblem:
    """Waypoints to be passed.

    Attributes:
        positions: (waypoints, joints), rad or m, within their limits.
        lower: (joints,), rad or m.
        upper: (joints,), rad or m.
        limits: Of each segment and joint.
        asked: (segments,), s; NaN: as short as can be.
        start: Rates (joints,) at the first waypoint.
        end: Rates (joints,) at the last.
        synchronization: Of the joints on a segment.
    """

    positions: FloatArray
    lower: FloatArray
    upper: FloatArray
    limits: RateLimits
    asked: FloatArray
    start: Rates
    end: Rates
    synchronization: Synchronization = "time"

    @property
    def travels(self) -> FloatArray:
        """(segments, joints)."""
        travels: FloatArray = np.diff(self.positions, axis=0)
        return travels

    def in_units(self, length: FloatArray, time: float) -> ViaProblem:
        """The same problem in other units: a length (joints,) for each joint, and a time."""
        speed, surge = length / time, length / time**2
        limits = RateLimits(
            self.limits.velocity / speed, self.limits.acceleration / surge, self.limits.jerk * time / surge
        )
        return replace(
            self,
            positions=self.positions / length,
            lower=self.lower / length,
            upper=self.upper / length,
            limits=limits,
            asked=self.asked / time,
            start=Rates(self.start.velocity / speed, self.start.acceleration / surge),
            end=Rates(self.end.velocity / speed, self.end.acceleration / surge),
        )


class ViaMotion(NamedTuple):
    """How the waypoints are passed.

    Attributes:
        durations: (segments,), s.
        lengths: Of the pieces of each segment, s.
        coefficients: Of the pieces of each segment, each (pieces, joints, 4).
        lowest: (segments, joints), the least positions.
        highest: (segments, joints), the greatest.
        slowest: (segments,), index of the joint that takes the longest.
    """

    durations: FloatArray
    lengths: list[FloatArray]
    coefficients: list[FloatArray]
    lowest: FloatArray
    highest: FloatArray
    slowest: np.ndarray
