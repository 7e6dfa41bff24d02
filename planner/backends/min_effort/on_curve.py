"""The time scaling of least cost along a segment group whose curve is given: lines, circles, blends.

Along a curve torques are linear in the square of the speed and in its derivative. Effort is a convex function of both.
See Verscheure et al., Time-optimal path tracking for robots: a convex optimization approach, IEEE Transactions on
Automatic Control 54, 2009. With b, a and c as in `retiming`, for a joint's torque m a + h b + gravity, its power and
its jerk, by their units:

    effort             integral of torque^2 / sqrt(b)
    mechanical work    integral of |torque q'|
    jerk               integral of (q''' b + 3 q'' a + q' c)^2 sqrt(b)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.backends.min_effort.cost import SMOOTHING, Cost
from planner.constraints import TORQUE
from planner.kernels.retiming import Objective, PathCost
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.time_scaling.fastest import QUARTERING_EXCESS, retimed
from planner.time_scaling.limits_on_curve import LimitsOnCurve, limits_on
from planner.time_scaling.linear_limits import QuadraticSpline
from planner.time_scaling.retiming import RequestedDurations, best_retiming, of_duration
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

ROUND_GAPS = (1e-2, 1e-4)
"""Rounds of the search: the gap to the optimum, relative to the cost, that may be left after each of them."""

MISSED_DURATION_SHARE = 1e-2
"""Share of a requested duration by which the search may miss it; a correction follows the search."""

CORRECTIONS = 10
"""Newton steps, at most, until the requested durations are met; they double the digits each time."""

STILL_MISSED = 1e-14
"""Share of a requested duration that may still be missed then: a few units in its last place."""


class FoundScaling(NamedTuple):
    """A time scaling that a search found, and whether nothing better is left."""

    scaling: SegmentedPolynomial
    converged: bool


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the time scaling of least cost along the curve of a segment group.

    Attributes:
        path: The path, with its limits.
        group: A segment group of the path.
        cost: The cost that is minimised.
        time_weight: The cost of a second.
        parts: Whether (parts, segments) a segment belongs to a part, whose duration as a whole is requested.
        durations: The requested durations (parts,), s.
        knots: Pieces of the time scaling.
        steps: Newton steps of each round, at most.
    """

    path: JointPath
    group: SegmentGroup
    cost: Cost
    time_weight: float
    parts: np.ndarray
    durations: FloatArray
    knots: int
    steps: int

    def improved(self, scaling: PiecewisePolynomial, margin: float) -> FoundScaling | None:
        """Find a better time scaling than a first one; None: the durations cannot be met.

        Args:
            scaling: A time scaling s(t), with a breakpoint where the curve has one.
            margin: Factor by which all limits are narrower.
        """
        limits = limits_on(self.path, self.group)
        for gap in ROUND_GAPS:
            even = np.ceil(self.knots * scaling.lengths / scaling.lengths.sum()).astype(int)
            most = limits.used(scaling)[0]
            scaling = scaling.split(np.maximum(even, np.where(most > QUARTERING_EXCESS, 4, np.where(most > 1.0, 2, 1))))
            requested, within = self._requested(limits.on_segments(scaling)), limits.along(scaling).narrowed(margin)
            found = best_retiming(scaling.lengths, within, self._objective(limits, scaling), requested, gap, self.steps)
            missed = requested.missed(QuadraticSpline(scaling.lengths).states(found.unknowns)[0])
            if (np.abs(missed) > MISSED_DURATION_SHARE * requested.durations).any():
                return None
            scaling = retimed(scaling, _on_time(scaling, found.unknowns, requested))
        return FoundScaling(limits.on_segments(scaling), found.converged)

    def _objective(self, limits: LimitsOnCurve, scaling: PiecewisePolynomial) -> Objective:
        """Return the cost of retiming a time scaling."""
        torque, power, jerk = self.cost.units
        along = limits.at_gridpoints(scaling)
        _, first, second, third = along.motion
        by_work = self.cost.objective == "mechanical_work"
        costs: list[PathCost] = []

        def add(rows: tuple[FloatArray, ...], exponent: float, smoothing: float = 0.0) -> None:
            costs.append(PathCost(np.stack([row.T for row in rows]), exponent, smoothing))

        if self.cost.objective != "jerk":
            unit, exponent = (first / power, 0.0) if by_work else (1.0 / torque, -0.5)
            by_b, by_a, gravity = (row * unit for row in along.of(TORQUE, TORQUE.rows(along.path)))
            add((by_b, by_a, np.zeros_like(by_b), gravity), exponent, SMOOTHING if by_work else 0.0)
        if self.cost.objective == "jerk" or self.cost.adds_jerk:
            add((third / jerk, 3.0 * second / jerk, first / jerk, np.zeros_like(first)), 0.5)
        return Objective(of_duration(scaling.lengths).weights, self.time_weight, tuple(costs))

    def _requested(self, scaling: SegmentedPolynomial) -> RequestedDurations:
        """Return the requested durations by the gridpoints of a time scaling."""
        own = self.parts[:, np.searchsorted(self.group.segments, scaling.segments)]
        return RequestedDurations.of_parts(scaling.lengths, own, self.durations)


def _on_time(scaling: PiecewisePolynomial, unknowns: FloatArray, requested: RequestedDurations) -> FloatArray:
    """Correct the unknowns as little as possible, until the requested durations are met to rounding."""
    spline = QuadraticSpline(scaling.lengths)
    parts = requested.weights[:, : len(scaling.lengths)] > 0.0
    for _ in range(CORRECTIONS):
        missed = parts @ retimed(scaling, unknowns).lengths - requested.durations
        if (np.abs(missed) <= STILL_MISSED * requested.durations).all():
            break
        slopes = np.array([spline.force(slope) for slope in requested.slopes(spline.states(unknowns)[0])])
        unknowns = unknowns - np.linalg.lstsq(slopes, missed)[0]
    return unknowns
