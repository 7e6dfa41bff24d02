"""The fastest profile of the path velocity within limits on intervals of a path, and how it uses them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kernels.library import call, doubles, indices

if TYPE_CHECKING:
    from numpy.typing import NDArray

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


class UseOfLimits(NamedTuple):
    """How a profile uses the limits on each interval, each (intervals,).

    Attributes:
        bend: Half of what u grows by: it keeps the limits at both ends, or breaks them the least; 0: u is constant.
        used: The largest share of a limit that is used then.
        unused: The share of the tightest limit that a constant u leaves unused, on average; elsewhere 0.
        dips: Largest excess of x over its bound between probes, relative to the bound; 0 where x is far below it.
    """

    bend: FloatArray
    used: FloatArray
    unused: FloatArray
    dips: FloatArray


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


def use_of_limits(limits: PathLimits, throughout: np.ndarray, x: FloatArray) -> UseOfLimits:
    """Compute how a profile (intervals + 1,) of x uses the limits, by a constant u where `throughout` (intervals,)."""
    intervals = len(limits.lengths)
    use = np.empty((4, intervals))
    call("use", *limits.arguments, indices(throughout, 2, intervals), doubles(x, intervals + 1), *use)
    return UseOfLimits(*use)


def fastest_crossings(limits: PathLimits, x: FloatArray, steepest: float) -> tuple[FloatArray, FloatArray]:
    """Compute how fast each interval could be crossed by gaining speed, going on at the highest and braking again.

    Args:
        limits: The limits on the intervals.
        x: (intervals + 1,).
        steepest: Largest u that is no jump, as a multiple of the highest bound of x by the interval's length.

    Returns:
        The times (intervals,), and the shares (intervals, 2) of the interval at which these meet.
    """
    times, meet = np.empty(len(limits.lengths)), np.empty((len(limits.lengths), 2))
    call("crossings", *limits.arguments, doubles(x, len(times) + 1), steepest, times, meet)
    return times, meet
