"""Curves cut into intervals by gridpoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.kernels.polynomials import states_on_pieces
from planner.kernels.profile import cut_curves
from planner.kinematics.turns import counted_velocity
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import SegmentedPolynomial, joined, shifted

MOST_INTERVAL_TURN = 0.25
"""Largest turn of a curve's direction on one interval, rad, joints measured by their velocity limits. With 0.3 random
splines lose another 0.1 % of the time."""

LEAST_GRID_INTERVALS = 20
"""Least number of intervals between two waypoints.

Intervals that lose time are split later. With 10, so many were split that motions were 0.01 % slower.
"""

FEWEST_OF_A_RUN = 40
"""Least number of intervals between two places of rest: lines of the tool lost 0.15 % with half as many."""

MOST_TURN_INTERVALS = 40
"""Largest number of intervals on one piece of a curve, however sharply it turns."""

MOST_SPLITTABLE_INTERVALS = 10_000
"""Number of intervals of a path above which no interval is split to gain time, since that would take seconds.

Only noisy curves with thousands of sharp turns have so many intervals.
"""

MANY_OF_A_SEGMENT = 100
"""Number of intervals per segment that is always permitted, for any number of segments."""

PROBES = np.linspace(0.0, 1.0, 5)
"""Points, as shares of an interval, where a curve's turn is measured and its speed limited."""

PARTS_AT_REST = 3
"""Parts of an interval that starts or ends at rest: so long does it take beside the next ones."""

CUTTING = MOST_INTERVAL_TURN, LEAST_GRID_INTERVALS, FEWEST_OF_A_RUN, MOST_TURN_INTERVALS, PARTS_AT_REST, ROUNDING
"""These numbers as the kernel reads them."""


@dataclass(frozen=True, eq=False)
class Intervals:
    """Curves, one after the other, cut into intervals by gridpoints.

    Attributes:
        lengths: (intervals,), in the unit of each curve's parameter s.
        coefficients: (intervals, joints, order), ascending powers of the local coordinate.
        segments: (intervals,), index of the segment that each interval belongs to.
        groups: (intervals,), index of the curve that each interval belongs to, ascending.
    """

    lengths: FloatArray
    coefficients: FloatArray
    segments: np.ndarray
    groups: np.ndarray

    @property
    def rests(self) -> np.ndarray:
        """Whether (intervals + 1,) the robot rests at a gridpoint, between one curve and the next."""
        return np.concatenate([[True], np.diff(self.groups) > 0, [True]])

    @property
    def are_many(self) -> bool:
        """Whether the path has too many intervals for a further split."""
        if len(self.lengths) <= MOST_SPLITTABLE_INTERVALS:
            return False
        segments = int(np.count_nonzero(np.diff(self.segments, prepend=-1)))
        return len(self.lengths) > MANY_OF_A_SEGMENT * segments

    def split(self, parts: np.ndarray) -> Intervals:
        """Cut each interval into a number (intervals,) of equal parts."""
        rows = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(rows)) - (np.cumsum(parts) - parts)[rows]
        return self.parts(rows, number / parts[rows], (number + 1) / parts[rows])

    def parts(self, rows: np.ndarray, starts: FloatArray, ends: FloatArray) -> Intervals:
        """Take parts (parts,) of intervals.

        Args:
            rows: (parts,), index of the interval that each is a part of.
            starts: (parts,), where it starts, as a share of the interval.
            ends: (parts,), where it ends.
        """
        lengths = self.lengths[rows]
        coefficients = shifted(self.coefficients[rows], (starts * lengths)[:, None])
        return Intervals((ends - starts) * lengths, coefficients, self.segments[rows], self.groups[rows])

    def of(self, rows: np.ndarray) -> Intervals:
        """Take some of the intervals."""
        return Intervals(self.lengths[rows], self.coefficients[rows], self.segments[rows], self.groups[rows])

    def at(self, points: FloatArray) -> list[FloatArray]:
        """Return positions and their first two derivatives by s, each (points, intervals, joints), at shares."""
        return list(states_on_pieces(self.lengths, self.coefficients, points))


def cut(curves: Sequence[SegmentedPolynomial], velocity: FloatArray, fewest: int = LEAST_GRID_INTERVALS) -> Intervals:
    """Cut the curves of groups into intervals, more of them where the curves turn and next to rest.

    An interval next to rest takes longer than others, and is split into parts of about equal time.

    Args:
        curves: One for each group.
        velocity: (segments, joints), limits, rad/s or m/s.
        fewest: Least number of intervals between two waypoints.
    """
    curve, groups = joined(curves), np.repeat(np.arange(len(curves)), [len(curve.segments) for curve in curves])
    pieces = curve.lengths, curve.coefficients, curve.segments, groups
    return Intervals(*pieces).parts(*cut_curves(*pieces, counted_velocity(velocity), np.array([fewest, *CUTTING])))
