"""The best change of a time scaling within limits that are linear in b, a and c at gridpoints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

GRIDPOINTS = 3
"""Gridpoints of an interval: start, middle and end."""


class PathCost(NamedTuple):
    """The integral of size(y) b^power, for each row y = by_b b + by_a a + by_c c + offset.

    Attributes:
        rows: Coefficients (4, rows, points) of b, a and c, and the offsets.
        power: The power of b.
        smoothing: The size is |y|, rounded by this much where y changes its sign; 0: it is y^2.
    """

    rows: FloatArray
    power: float
    smoothing: float = 0.0


class Objective(NamedTuple):
    """The objective that a retiming makes small: the duration by its weight, and further costs.

    Attributes:
        weights: Weights (points,), s, in the sums that stand for integrals; that of 1 / sqrt(b) is the duration.
        time_weight: The cost of a second.
        costs: The further costs.
    """

    weights: FloatArray
    time_weight: float = 1.0
    costs: tuple[PathCost, ...] = ()

    @property
    def arguments(self) -> tuple[int | float | NDArray[np.float64] | NDArray[np.int64], ...]:
        """The objective as the kernels read it."""
        points, count = len(self.weights), len(self.costs)
        numbers = [len(cost.rows[0]) for cost in self.costs]
        rows = np.concatenate(
            [doubles(cost.rows, 4, n, points).ravel() for cost, n in zip(self.costs, numbers, strict=True)]
            or [np.empty(0)]
        )
        return (
            doubles(self.weights, points),
            self.time_weight,
            count,
            indices(np.array(numbers, dtype=np.int64), max(numbers, default=0) + 1, count),
            doubles([cost.power for cost in self.costs], count),
            doubles([cost.smoothing for cost in self.costs], count),
            rows,
        )

    def at(self, states: FloatArray, concave: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return the value, the slope (3, points) and the curvature (6, points) at states (3, points).

        The curvature has the second derivatives by bb, ba, bc, aa, ac and cc. The curvature of 1 / sqrt(b) times
        `concave` (points,) is subtracted, and the result is made positive semidefinite. In place of |y| stands the
        parabola that touches it and is nowhere below.
        """
        points = len(self.weights)
        value, slope, curvature = np.empty(1), np.empty((3, points)), np.empty((6, points))
        where = doubles(states, 3, points), doubles(concave, points)
        call("retiming_objective", points, *self.arguments, *where, value, slope, curvature)
        return float(value[0]), slope, curvature


def joint_rows(
    width: int,
    at: np.ndarray,
    joint_limits: tuple[FloatArray, FloatArray, FloatArray],
    motion: FloatArray,
    speeds: FloatArray | None,
) -> FloatArray:
    """Return the arrays of `LinearLimits` (6, width, N): the first 1 + 2 joints rows are limits of the joints.

    The first row is the square of the path velocity as a share of its limits, then come accelerations, then jerks.

    Args:
        width: The number of rows, the others are left empty.
        at: The rows (N,) of the limits at N points.
        joint_limits: Lower and upper velocity limits, middle and half width of the acceleration limits, both (2, rows,
            joints), and the jerk limits (rows, joints).
        motion: Positions and their first three derivatives by time, (4, N, joints).
        speeds: Shares (N,) of further limits of the path velocity; None: there are none.
    """
    (_, points, joints), rows = motion.shape, len(joint_limits[2])
    parts = np.empty((6, width, points))
    velocity, acceleration, jerk = joint_limits
    known = doubles(velocity, 2, rows, joints), doubles(acceleration, 2, rows, joints), doubles(jerk, rows, joints)
    given = indices(at, rows, points), *known, doubles(motion, 4, points, joints)
    call("joint_rows", points, joints, width, rows, *given, None if speeds is None else doubles(speeds, points), parts)
    return parts


def spline_maps(widths: FloatArray, *, begins_evenly: bool) -> FloatArray:
    """Return the linear map (3, 3, gridpoints, intervals) of `QuadraticSpline`."""
    maps = np.empty((3, 3, GRIDPOINTS, len(widths)))
    call("spline_maps", len(widths), doubles(widths, len(widths)), int(begins_evenly), maps)
    return maps


def retime_scaling(
    widths: FloatArray, scaling: FloatArray, unknowns: FloatArray, gauss: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return lengths (pieces,) and quintics (pieces, 6) of a time scaling after a retiming.

    Args:
        widths: Lengths (pieces,), s, of the pieces before.
        scaling: Coefficients (pieces, order) of s(t), ascending powers of local time.
        unknowns: The unknowns (pieces + 2,) of the retiming.
        gauss: Points and weights (2, N) of Gauss's rule on each piece, for the lengths.
    """
    (pieces, order), (_, count) = scaling.shape, gauss.shape
    lengths, quintics = np.empty(pieces), np.empty((pieces, 6))
    known = doubles(widths, pieces), doubles(scaling, pieces, order), doubles(unknowns, pieces + 2)
    call("retimed", pieces, order, *known, count, doubles(gauss, 2, count), lengths, quintics)
    return lengths, quintics


def largest_scales(limits: Sequence[FloatArray], states: FloatArray) -> FloatArray:
    """Return the factors (points,) on b, each alone, with which limits are kept at states (3, points) or (3, 1)."""
    count, points = limits[0].shape
    found, at = np.empty(points), doubles(np.broadcast_to(states, (3, points)), 3, points)
    call("scales", points, count, *(doubles(part, count, points) for part in limits), at, found)
    return found


def smooth_start(
    maps: FloatArray,
    limits: Sequence[FloatArray],
    weights: FloatArray,
    reaches: np.ndarray,
    largest: float,
    worth: float,
) -> FloatArray:
    """Return a smooth start (intervals + 2,) for the fastest retiming of a slow motion, up to a factor.

    It is the largest constant b that the limits allow at each gridpoint, the least near each interval, smoothed by
    moving averages.

    Args:
        maps: The linear map from the unknowns.
        limits: The arrays (limits, points) of `LinearLimits`.
        weights: Weights (points,), s, in the sum of 1 / sqrt(b) that stands for the duration.
        reaches: Numbers (windows,) of intervals on either side over which it is smoothed, tried in turn.
        largest: Largest b, as a multiple of the least.
        worth: Duration, relative to the duration of the best before it, that makes it worth to begin with it.
    """
    intervals, (count, points) = maps.shape[3], limits[0].shape
    x = np.empty(intervals + 2)
    known = doubles(maps, 3, 3, GRIDPOINTS, intervals), count, *(doubles(part, count, points) for part in limits)
    of_windows = len(reaches), indices(reaches, intervals + 1, len(reaches))
    call("start_of_retiming", intervals, *known, doubles(weights, points), largest, worth, *of_windows, x)
    return x


def best_unknowns(
    maps: FloatArray,
    limits: Sequence[FloatArray],
    objective: Objective,
    requested: tuple[FloatArray, FloatArray],
    tolerance: float,
    steps: int,
    start: FloatArray,
) -> tuple[FloatArray, bool]:
    """Find the best unknowns (intervals + 2,) within limits.

    Args:
        maps: The linear map (3, 3, gridpoints, intervals) from the unknowns to b, a and c at the gridpoints.
        limits: The arrays (limits, points) of `LinearLimits`.
        objective: The objective.
        requested: Weights (parts, points), s, in sums of 1 / sqrt(b), and the durations (parts,), s, that they meet.
        tolerance: Gap between the objective and its lower bound, relative, that may be left.
        steps: Newton steps, at most.
        start: Unknowns within all limits.

    Returns:
        The unknowns, and whether nothing better is left, and the durations are met, within the tolerance.
    """
    intervals, (count, points), parts = maps.shape[3], limits[0].shape, len(requested[1])
    x, converged = doubles(start, intervals + 2).copy(), np.zeros(1, dtype=np.int64)
    arrays = [doubles(part, count, points) for part in limits]
    durations = doubles(requested[0], parts, points), doubles(requested[1], parts)
    known = doubles(maps, 3, 3, points // intervals, intervals), count, *arrays, *objective.arguments
    call("retime", intervals, *known, parts, *durations, tolerance, steps, x, converged)
    return x, bool(converged[0])
