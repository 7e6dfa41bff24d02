"""Curves cut into intervals by gridpoints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.kernels.polynomials import states_on_pieces
from planner.kinematics.turns import counted_velocity
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import joined, shifted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import SegmentedPolynomial

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

PROBES = np.linspace(0.0, 1.0, 5)
"""Points, as shares of an interval, where a curve's turn is measured and its speed limited."""


PARTS_AT_REST = 3
"""Parts of an interval that starts or ends at rest: so long does it take beside the next ones."""


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


def shares_between(inner: FloatArray) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Return the parts between points on intervals: their row, and the shares at which they start and end.

    Args:
        inner: (intervals, N), the points, as shares of each interval, in any order.
    """
    count = len(inner)
    points = np.column_stack([np.zeros(count), np.sort(inner, axis=1), np.ones(count)])
    there = np.diff(points, axis=1) > 0.0
    return np.nonzero(there)[0], points[:, :-1][there], points[:, 1:][there]


def cut(curves: Sequence[SegmentedPolynomial], velocity: FloatArray, fewest: int = LEAST_GRID_INTERVALS) -> Intervals:
    """Cut the curves of groups into intervals, more of them where the curves turn and next to rest.

    An interval next to rest takes longer than others, and is split into parts of about equal time.

    Args:
        curves: One for each group.
        velocity: (segments, joints), limits, rad/s or m/s.
        fewest: Least number of intervals between two waypoints.
    """
    curve, groups = joined(curves), np.repeat(np.arange(len(curves)), [len(curve.segments) for curve in curves])
    whole = Intervals(curve.lengths, curve.coefficients, curve.segments, groups)
    limit = velocity[whole.segments]
    _, first, second = (rows / counted_velocity(limit) for rows in whole.at(PROBES))
    speeds, bends = np.linalg.norm(first, axis=2), np.linalg.norm(second, axis=2)
    rounding = np.sqrt(ROUNDING) * bends.max(axis=0)
    rates = np.where(bends > rounding, bends, 0.0) / np.maximum(speeds, ROUNDING * speeds.max(axis=0))
    turns = rates.mean(axis=0) * whole.lengths
    spans = np.bincount(whole.segments, whole.lengths)[whole.segments]
    lengths = np.bincount(whole.groups, whole.lengths)[whole.groups]
    shares = np.maximum(whole.lengths / spans, FEWEST_OF_A_RUN / LEAST_GRID_INTERVALS * whole.lengths / lengths)
    wanted = np.ceil(fewest * np.maximum(turns / (MOST_INTERVAL_TURN * LEAST_GRID_INTERVALS), shares) - ROUNDING)
    parts = np.clip(wanted, 1, MOST_TURN_INTERVALS).astype(int)[:, None]
    starts, ends = whole.rests[:-1, None], whole.rests[1:, None]
    near = np.linspace(0.0, 1.0, PARTS_AT_REST + 1)[1:-1] ** 2 / np.maximum(parts, 1 + (starts & ends))
    inner = np.arange(1, parts.max()) / parts, np.where(starts, near, 0.0), np.where(ends, 1.0 - near, 1.0)
    return whole.parts(*shares_between(np.minimum(np.hstack(inner), 1.0)))
