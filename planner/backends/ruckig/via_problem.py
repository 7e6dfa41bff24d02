"""The problem of passing waypoints without stopping, its units, and the motion that solves it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.backends.jerk_limited.s_curves import least_times
from planner.backends.ruckig.state_to_state import Rates, Synchronization
from planner.limits import SegmentLimits
from planner.spatial import FloatArray
from planner.trajectories.polynomials import SegmentedPolynomial

LATE = 30.0
"""Weight of the time beyond a requested duration, against the duration."""

OUTSIDE_WEIGHT = 30.0
"""Weight of the travel beyond a position limit, in units of the search, against the duration."""

NO_TRAVEL = 1e-7
"""Share of a joint's possible travel below which the search ignores its travel.

Such a travel uses as small a share of the joint's limits. It is restored in the final motion.
"""

LEAST_TRAVEL = 1e-4
"""Share of a joint's possible travel below which its travel is not its unit of length.

In the resulting units its limits are at most about 3e5. Travels that count are 1e-3 or more, far above Ruckig's
tolerances of 1e-12 to 1e-8.
"""


@dataclass(frozen=True, eq=False)
class ViaProblem:
    """Waypoints to be passed.

    Attributes:
        positions: Positions (waypoints, joints), rad or m, within their limits.
        limits: Limits of position, and of velocity, acceleration and jerk of each segment and joint.
        requested: Requested durations (segments,), s; NaN: as short as can be.
        start: Rates (joints,) at the first waypoint.
        end: Rates (joints,) at the last.
        synchronization: How the joints are synchronised on a segment.
    """

    positions: FloatArray
    limits: SegmentLimits
    requested: FloatArray
    start: Rates
    end: Rates
    synchronization: Synchronization = "time"

    @property
    def travels(self) -> FloatArray:
        """The travels (segments, joints), rad or m."""
        travels: FloatArray = np.diff(self.positions, axis=0)
        return travels

    @property
    def narrower(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The narrower limits (segments, joints) of velocity, acceleration and jerk."""
        return self.limits.velocity.narrower, self.limits.acceleration.narrower, self.limits.jerk.narrower

    @property
    def least_times(self) -> FloatArray:
        """The times (segments, joints) that the tightest limit alone takes from rest to rest."""
        return least_times(self.travels, *self.narrower)

    @property
    def possible_travels(self) -> FloatArray:
        """Possible travels (segments, joints) from rest to rest in the time of the slowest joint."""
        t = self.least_times.max(axis=1)[:, None]
        velocity, acceleration, jerk = self.narrower
        possible: FloatArray = np.minimum(np.minimum(velocity * t, acceleration * t**2 / 4.0), jerk * t**3 / 32.0)
        return possible

    @property
    def resting_rates(self) -> Rates:
        """The rates (waypoints, joints) with all inner waypoints at rest."""
        inner = np.zeros_like(self.positions[1:-1])
        return Rates(*(np.vstack([start, inner, end]) for start, end in zip(self.start, self.end, strict=True)))

    def without_rounding(self) -> ViaProblem:
        """Hold the joints at rest that would move by no more than rounding."""
        moves = (np.abs(self.travels) > NO_TRAVEL * self.possible_travels).any(axis=0)
        moves |= np.any([rates != 0.0 for rates in (*self.start, *self.end)], axis=0)
        return replace(self, positions=np.where(moves, self.positions, self.positions[0]))

    def units(self) -> tuple[FloatArray, float]:
        """Return units of length (joints,), m or rad, and of time, s, in which the search is about 1.

        They are each joint's largest travel and the mean segment. A joint that hardly moves is measured by its possible
        travel: in units of its own travel, its limits would be huge.
        """
        reach, possible = np.abs(self.travels).max(axis=0), self.possible_travels.mean(axis=0)
        length = np.maximum(reach, LEAST_TRAVEL * np.where(np.isfinite(possible), possible, reach.max()))
        times = np.fmax(self.least_times.max(axis=1), self.requested)
        return length, float(times.mean())

    def in_units(self, length: FloatArray, time: float) -> ViaProblem:
        """Convert the problem to units of length (joints,), rad or m, one a joint, and of time, s."""
        speed, surge = length / time, length / time**2
        limits = replace(
            self.limits,
            position=self.limits.position.divided_by(length),
            velocity=self.limits.velocity.divided_by(speed),
            acceleration=self.limits.acceleration.divided_by(surge),
            jerk=self.limits.jerk.divided_by(surge / time),
        )
        return replace(
            self,
            positions=self.positions / length,
            limits=limits,
            requested=self.requested / time,
            start=Rates(self.start.velocity / speed, self.start.acceleration / surge),
            end=Rates(self.end.velocity / speed, self.end.acceleration / surge),
        )


class ViaMotion(NamedTuple):
    """A motion that passes the waypoints.

    Attributes:
        durations: Durations (segments,), s.
        pieces: The motion in cubics of time; their `segments` are rows of the problem.
        lowest: The least positions (segments, joints), rad or m.
        highest: The greatest positions (segments, joints), rad or m.
        slowest: Index (segments,) of the joint that takes the longest.
    """

    durations: FloatArray
    pieces: SegmentedPolynomial
    lowest: FloatArray
    highest: FloatArray
    slowest: np.ndarray
