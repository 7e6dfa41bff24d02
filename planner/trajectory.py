"""The one trajectory type: piecewise polynomials of time per joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.polynomials import PiecewisePolynomial

if TYPE_CHECKING:
    from planner.spatial import FloatArray


@dataclass(frozen=True)
class Remark:
    """Something that a back end has to say about its trajectory, which is good all the same."""

    code: str
    message: str


@dataclass(frozen=True, eq=False)
class Trajectory(PiecewisePolynomial):
    """Joint positions as piecewise polynomials of time; a path with time on it. Lengths are in s.

    Attributes:
        segments: (pieces,), index of the waypoint segment that each piece belongs to; the dwell at a
            waypoint belongs to the segment that ends there (at the first waypoint: to segment 0).
        arrivals: (waypoints,), s, when each waypoint is reached; one that is blended: the middle of its blend.
        departures: (waypoints,), s, when it is left again, after its dwell.
        remarks: Of the back end.
    """

    segments: np.ndarray
    arrivals: FloatArray
    departures: FloatArray
    remarks: tuple[Remark, ...] = ()

    @property
    def duration(self) -> float:
        """S."""
        return float(self.breakpoints[-1])

    def sample_times(self, period: float) -> FloatArray:
        """0, period, 2 period, ... and last the duration itself; strictly increasing."""
        steps = int(np.ceil(self.duration / period * (1.0 - 1e-9)))
        return np.append(np.arange(steps) * period, self.duration)
