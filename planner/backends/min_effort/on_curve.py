"""The law of least cost along a run whose curve is given: lines, circles, blends.

Along a curve torques are linear in the square of the speed and its derivative, and effort is a convex function of them
(Verscheure et al., Time-optimal path tracking for robots: a convex optimization approach, IEEE Transactions on
Automatic Control 54, 2009). With b, a and c as in `retiming`, for a joint's torque m a + h b + gravity, its power and
its jerk, by their units:

    effort             integral of torque^2 / sqrt(b)
    mechanical work    integral of |torque q'|
    jerk               integral of (q''' b + 3 q'' a + q' c)^2 sqrt(b)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.min_effort.stage import SMOOTHING
from planner.constraints import TORQUE
from planner.time_scaling.linear_limits import QuadraticSpline
from planner.time_scaling.retiming import (
    LEAST_CURVATURE,
    Aim,
    AskedDurations,
    Duration,
    best_retiming,
)
from planner.time_scaling.time_law import COARSE, limits_on, retimed, retimed_lengths

if TYPE_CHECKING:
    from planner.backends.min_effort.cost import Cost
    from planner.paths import JointPath, Run
    from planner.spatial import FloatArray
    from planner.time_scaling.time_law import LimitsOnCurve
    from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

ROUNDS = (1e-2, 1e-4)
"""Rounds of the search: the gap to the optimum, relative to the cost, that may be left after each of them."""

NEARLY = 1e-2
"""Share of an asked duration by which the search may miss it; what is missed is mended after the search."""

CORRECTIONS = 10
"""Newton steps, at most, until the asked durations are met; they double the digits each time."""

STILL_MISSED = 1e-14
"""Share of an asked duration that may still be missed then: a few units in its last place."""


@dataclass(frozen=True, eq=False)
class RetimingCost(Aim):
    """The integral of size(y) b^power, for each row y = by_b b + by_a a + by_c c + offset; and of time.

    Attributes:
        by_b: Coefficients (rows, points) of b.
        by_a: Coefficients (rows, points) of a.
        by_c: Coefficients (rows, points) of c.
        offset: Constants (rows, points).
        power: The power of b.
        absolute: Whether the size is |y|, rounded where y changes its sign; otherwise it is y^2.
        duration: The duration, whose weights are those of the integral.
        time_weight: The cost of a second.
    """

    by_b: FloatArray
    by_a: FloatArray
    by_c: FloatArray
    offset: FloatArray
    power: float
    absolute: bool
    duration: Duration
    time_weight: float

    def _rows(self, states: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the rows y (rows, points), the sum of their sizes (points,), and half of each size's slope over y."""
        b, a, c = states
        y = self.by_b * b + self.by_a * a + self.by_c * c + self.offset
        if not self.absolute:
            return y, (y**2).sum(axis=0), np.ones_like(y)
        size = np.sqrt(y**2 + SMOOTHING**2)
        return y, size.sum(axis=0), 0.5 / size

    def value(self, states: FloatArray) -> float:
        """Return the cost at states (3, points)."""
        size = self._rows(states)[1]
        return float((self.duration.weights * size * states[0] ** self.power).sum()) + (
            self.time_weight * self.duration.value(states)
        )

    def slope(self, states: FloatArray) -> FloatArray:
        """Return the derivative (3, points) of the cost by b, a and c."""
        b, p = states[0], self.power
        y, size, stiffness = self._rows(states)
        scale = self.duration.weights * b**p
        slope = np.stack([2.0 * scale * (stiffness * y * row).sum(axis=0) for row in (self.by_b, self.by_a, self.by_c)])
        slope[0] += scale * p * size / b
        slope += self.time_weight * self.duration.slope(states)
        return slope

    def curvature(self, states: FloatArray, concave: FloatArray) -> FloatArray:
        """Return the second derivative (3, 3, points) of the cost, made positive semidefinite.

        That of y^2 b^p is 2 b^p u u^T - p (p + 1) y^2 b^(p - 2) e e^T, where u = dy + p y / b e, and e is the direction
        of b. That of |y| is taken from the parabola which touches it and is nowhere below.
        """
        b, p = states[0], self.power
        y, size, stiffness = self._rows(states)
        scale = 2.0 * self.duration.weights * b**p
        rows = (self.by_b + p * y / b, self.by_a, self.by_c)
        result = np.empty((3, *states.shape))
        for i, row in enumerate(rows):
            for k in range(i, 3):
                result[i, k] = result[k, i] = scale * (stiffness * row * rows[k]).sum(axis=0)
        weights = self.duration.weights
        own = -p * (p + 1.0) * weights * size * b ** (p - 2.0)
        times = 0.75 * b**-2.5 * (self.time_weight * weights - concave)
        least = LEAST_CURVATURE * weights * (size * b ** (p - 2.0) + self.time_weight * b**-2.5)
        result[0, 0] += np.maximum(own + times, least)
        return result


@dataclass(frozen=True, eq=False)
class CostWithJerk(Aim):
    """The sum of two costs.

    Attributes:
        cost: The cost, that of time included.
        jerk: The cost of the jerk.
    """

    cost: RetimingCost
    jerk: RetimingCost

    def value(self, states: FloatArray) -> float:
        """Return the cost at states (3, points)."""
        return self.cost.value(states) + self.jerk.value(states)

    def slope(self, states: FloatArray) -> FloatArray:
        """Return the derivative (3, points) of the cost by b, a and c."""
        return self.cost.slope(states) + self.jerk.slope(states)

    def curvature(self, states: FloatArray, concave: FloatArray) -> FloatArray:
        """Return the second derivative (3, 3, points) of the cost, made positive semidefinite."""
        return self.cost.curvature(states, concave) + self.jerk.curvature(states, np.zeros_like(concave))


class FoundLaw(NamedTuple):
    """A law that a search found, and whether nothing better is left."""

    law: SegmentedPolynomial
    converged: bool


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the law of least cost along the curve of a run.

    Attributes:
        path: The path, with its limits.
        run: A run of the path.
        cost: The cost that is minimised.
        time_weight: The cost of a second.
        parts: Whether (parts, segments) a segment belongs to a part, whose duration as a whole is asked.
        durations: The asked durations (parts,), s.
        knots: Pieces of the law.
        steps: Newton steps of each round, at most.
    """

    path: JointPath
    run: Run
    cost: Cost
    time_weight: float
    parts: np.ndarray
    durations: FloatArray
    knots: int
    steps: int

    def improved(self, law: PiecewisePolynomial, margin: float) -> FoundLaw | None:
        """Find a better law than a first one; None: the durations cannot be met.

        Args:
            law: A law s(t), with a breakpoint where the curve has one.
            margin: Factor by which all limits are narrower.
        """
        limits = limits_on(self.path, self.run, knows_torques=self.cost.objective != "jerk")
        for gap in ROUNDS:
            even = np.ceil(self.knots * law.lengths / law.lengths.sum()).astype(int)
            most = limits.used(law)[0]
            law = law.split(np.maximum(even, np.where(most > COARSE, 4, np.where(most > 1.0, 2, 1))))
            asked, within = self._asked(limits.on_segments(law)), limits.along(law).narrowed(margin)
            found = best_retiming(law.lengths, within, self._aim(limits, law), asked, gap, self.steps)
            missed = asked.missed(QuadraticSpline(law.lengths).states(found.unknowns)[0])
            if (np.abs(missed) > NEARLY * asked.durations).any():
                return None
            law = retimed(law, _on_time(law, found.unknowns, asked))
        return FoundLaw(limits.on_segments(law), found.converged)

    def _aim(self, limits: LimitsOnCurve, law: PiecewisePolynomial) -> Aim:
        """Return the cost of retiming a law."""
        torque, power, jerk = self.cost.units
        s, ds, dds, _, first, second, third = limits.rates(law)
        by_work = self.cost.objective == "mechanical_work"
        duration = Duration.of_intervals(law.lengths)
        costs: list[RetimingCost] = []

        def add(rows: tuple[FloatArray, ...], exponent: float, absolute: bool) -> None:
            by_b, by_a, by_c, offset = (row.reshape(s.size, -1).T for row in rows)
            weight = 0.0 if costs else self.time_weight
            costs.append(RetimingCost(by_b, by_a, by_c, offset, exponent, absolute, duration, weight))

        if self.cost.objective != "jerk":
            unit, exponent = (first / power, 0.0) if by_work else (1.0 / torque, -0.5)
            at = limits.points(limits.pieces(law), s[..., 0])
            torques = limits.sampled.values_at(TORQUE, at, ds, dds)
            by_b, by_a, gravity = (row * unit for row in torques)
            add((by_b, by_a, np.zeros_like(by_b), gravity), exponent, by_work)
        if self.cost.objective == "jerk" or self.cost.adds_jerk:
            add((third / jerk, 3.0 * second / jerk, first / jerk, np.zeros_like(first)), 0.5, False)
        return costs[0] if len(costs) == 1 else CostWithJerk(*costs)

    def _asked(self, law: SegmentedPolynomial) -> AskedDurations:
        """Return the asked durations by the gridpoints of a law."""
        own = self.parts[:, np.searchsorted(self.run.segments, law.segments)]
        return AskedDurations.of_parts(law.lengths, own, self.durations)


def _on_time(law: PiecewisePolynomial, unknowns: FloatArray, asked: AskedDurations) -> FloatArray:
    """Correct the unknowns as little as possible, until the asked durations are met to rounding."""
    spline = QuadraticSpline(law.lengths)
    parts = asked.weights[:, : len(law.lengths)] > 0.0
    for _ in range(CORRECTIONS):
        missed = parts @ retimed_lengths(law, unknowns) - asked.durations
        if (np.abs(missed) <= STILL_MISSED * asked.durations).all():
            break
        slopes = np.array([spline.force(slope) for slope in asked.slopes(spline.states(unknowns)[0])])
        unknowns = unknowns - np.linalg.lstsq(slopes, missed)[0]
    return unknowns
