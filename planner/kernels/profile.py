"""The fastest profile of the path velocity within limits on intervals of a path, and how it uses them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

POINTS = 3
"""The number of points of an interval at which limits are given, evenly spaced, both ends included."""

PROBES = 5
"""The number of probes of an interval at which x has a bound, evenly spaced, both ends included."""


class PathLimits(NamedTuple):
    """Limits on intervals, |per_u u + per_x x + rest| <= 1 at each point, and x <= bound at each probe.

    x is s'^2 and u is s''; on an interval of length d, u = (x1 - x0) / (2 d) on average.

    Attributes:
        lengths: (intervals,).
        per_u: (points, intervals, limits).
        per_x: (points, intervals, limits).
        rest: (points, intervals, limits), between -1 and 1: standing still keeps every limit.
        bounds: (probes, intervals).
    """

    lengths: FloatArray
    per_u: FloatArray
    per_x: FloatArray
    rest: FloatArray
    bounds: FloatArray

    def of(self, rows: np.ndarray) -> PathLimits:
        """Take some of the intervals, by index."""
        return PathLimits(*(part.take(rows, axis=-1 if part.ndim < 3 else 1) for part in self))

    def with_new(self, rows: np.ndarray, new: np.ndarray, limits: PathLimits) -> PathLimits:
        """Return the limits on rows (N,) of these intervals, but where they are new (N,) those given."""
        merged = self.of(rows)
        merged.lengths[new] = limits.lengths
        for values, fresh in zip(merged[1:], limits[1:], strict=True):
            values[:, new] = fresh
        return merged

    @property
    def arguments(self) -> tuple[int | NDArray[np.float64], ...]:
        """The limits as the kernels read them."""
        intervals, count = self.per_u.shape[1:]
        each = (doubles(part, POINTS, intervals, count) for part in self[1:4])
        return intervals, count, doubles(self.lengths, intervals), *each, doubles(self.bounds, PROBES, intervals)


class LimitRows(NamedTuple):
    """Limits as rows that are linear in u and x, with a bound for each segment.

    Attributes:
        by_u: (points, intervals, rows).
        by_x: (points, intervals, rows).
        rest: (points, intervals, rows).
        middle: (segments, rows), the middle between the lower and the upper bound.
        half: (segments, rows), their distance from there.
    """

    by_u: FloatArray
    by_x: FloatArray
    rest: FloatArray
    middle: FloatArray
    half: FloatArray


class Parts(NamedTuple):
    """The intervals for another solution, as parts of the intervals of the solution before.

    Attributes:
        rows: (parts,), the interval that each is a part of.
        starts: (parts,), where it starts, as a share of the interval.
        ends: (parts,), where it ends.
        throughout: (parts,), where a constant u has to keep the limits over the whole interval.
    """

    rows: np.ndarray
    starts: FloatArray
    ends: FloatArray
    throughout: np.ndarray


def cut_curves(
    lengths: FloatArray,
    coefficients: FloatArray,
    segments: np.ndarray,
    groups: np.ndarray,
    weights: FloatArray,
    rule: FloatArray,
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Cut pieces of curves into intervals.

    Args:
        lengths: (pieces,).
        coefficients: (pieces, joints, order), ascending powers of the local coordinate.
        segments: (pieces,), the segment of each piece.
        groups: (pieces,), the curve of each piece, ascending from 0 on without gaps.
        weights: (segments, joints), the motions of the joints that count alike.
        rule: The numbers of the structure `Cutting` of the kernels.

    Returns:
        The row (intervals,) of the piece of each interval, and the shares (intervals,) of it where it starts and ends.
    """
    (pieces, joints, order), most = coefficients.shape, int(rule[4] + 2 * rule[5]) * len(lengths)
    (starts, ends), rows, count = np.empty((2, most)), np.empty(most, dtype=np.int64), np.zeros(1, dtype=np.int64)
    given = doubles(lengths, pieces), doubles(coefficients, pieces, joints, order)
    at = indices(segments, len(weights), pieces), indices(groups, pieces, pieces)
    limits = len(weights), doubles(weights, len(weights), joints), doubles(rule, 7)
    call("cut", pieces, joints, order, *given, *at, *limits, rows, starts, ends, count)
    found = int(count[0])
    return rows[:found], starts[:found], ends[:found]


def limits_on_intervals(
    lengths: FloatArray,
    segments: np.ndarray,
    derivatives: tuple[FloatArray, FloatArray],
    joint_limits: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    rows: LimitRows,
    used: FloatArray | None,
    slower: FloatArray,
    numbers: FloatArray,
) -> PathLimits:
    """Compute the limits on intervals of a path as shares.

    Args:
        lengths: (intervals,).
        segments: (intervals,), the rows of their limits.
        derivatives: q' and q'' (probes, intervals, joints) by s.
        joint_limits: Middle and half width of the acceleration limits, lower and upper velocity limits, (segments,
            joints) each.
        rows: The further limits.
        used: Shares (probes, intervals) that s' = 1 uses of further limits of the path velocity; None: there are none.
        slower: (intervals,), squares of factors on the time.
        numbers: Largest share of a limit at rest, least share of a velocity limit, largest ratio of the bounds of an
            interval.
    """
    (_, intervals, joints), (count, width) = derivatives[0].shape, rows.half.shape
    moved = (doubles(part, PROBES, intervals, joints) for part in derivatives)
    of_joints = (doubles(part, count, joints) for part in joint_limits)
    of_rows = (doubles(part, POINTS, intervals, width) for part in rows[:3])
    bounds_of_rows = (doubles(part, count, width) for part in rows[3:])
    shares = None if used is None else doubles(used, PROBES, intervals)
    per_u, per_x, rest = (np.empty((POINTS, intervals, joints + width)) for _ in range(3))
    bounds = np.empty((PROBES, intervals))
    at, other = indices(segments, count, intervals), doubles(numbers, 3)
    given = doubles(slower, intervals), *of_joints, *of_rows, *bounds_of_rows
    found = per_u, per_x, rest, bounds
    call("path_limits", intervals, joints, width, *moved, at, *given, shares, other, *found)
    return PathLimits(lengths, per_u, per_x, rest, bounds)


def fastest_profile(limits: PathLimits, throughout: np.ndarray, rests: np.ndarray) -> FloatArray:
    """Compute the fastest profile (intervals + 1,) of x by a backward and a forward pass.

    Args:
        limits: The limits on the intervals.
        throughout: (intervals,), where a constant u has to keep them all over the interval. Elsewhere u may follow a
            limit, and it is enough that its mean keeps them in the middle.
        rests: (intervals + 1,), where x is 0; both ends at least.
    """
    intervals = len(limits.lengths)
    flags = indices(throughout, 2, intervals), indices(rests, 2, intervals + 1)
    x = np.empty(intervals + 1)
    call("profile", *limits.arguments, *flags, x)
    return x


def judge_profile(
    limits: PathLimits,
    throughout: np.ndarray,
    groups: np.ndarray,
    x: FloatArray,
    rule: FloatArray,
    *,
    may_split: bool,
    is_first: bool,
) -> tuple[FloatArray, Parts | None]:
    """Find the bends of a profile, and the intervals for another solution.

    Intervals that break limits, or lose time, are split, the first time in any case; or u becomes constant on them.

    Args:
        limits: The limits on the intervals.
        throughout: (intervals,), where u is constant.
        groups: (intervals,), the curve that each belongs to, ascending from 0 on without gaps.
        x: (intervals + 1,).
        rule: The numbers of the structure `Splitting` of the kernels.
        may_split: Whether intervals may be split.
        is_first: Whether this is the first solution.

    Returns:
        The bends (intervals,), half of what u grows by on each interval: they keep the limits at both ends, or break
        them the least. Then the next intervals; None: this is the last solution.
    """
    intervals, most = len(limits.lengths), int(rule[-1]) * len(limits.lengths)
    bend, (starts, ends), (rows, again) = np.empty(intervals), np.empty((2, most)), np.empty((2, most), dtype=np.int64)
    count = np.zeros(1, dtype=np.int64)
    flags = indices(throughout, 2, intervals), indices(groups, intervals, intervals)
    given = *limits.arguments, doubles(rule, 8), *flags, doubles(x, intervals + 1), int(may_split), int(is_first)
    call("judge", *given, bend, rows, starts, ends, again, count)
    found = int(count[0])
    parts = Parts(rows[:found], starts[:found], ends[:found], again[:found].astype(bool))
    return bend, parts if found else None


def times_between(lengths: FloatArray, x: FloatArray, bend: FloatArray, start: float, end: float) -> FloatArray:
    """Compute the times (intervals,), s, from one share of each interval to another.

    Args:
        lengths: (intervals,).
        x: (intervals + 1,).
        bend: (intervals,), half of what u grows by.
        start: A share of the intervals.
        end: Another one.
    """
    count, times = len(lengths), np.empty(len(lengths))
    call(
        "times_between", count, doubles(lengths, count), doubles(x, count + 1), doubles(bend, count), start, end, times
    )
    return times
