"""The best change of a time scaling within limits that are linear in b, a and c at gridpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kernels.library import call, doubles, indices

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planner.spatial import FloatArray


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
