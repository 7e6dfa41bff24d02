"""The fastest change of a law of motion within limits on speed, acceleration, jerk and torque.

A law is retimed: where it was at time x, the new one is after b(x)^(-1/2) of the time. With a = b' / 2 and c = b'' / 2
all that is limited is linear in (b, a, c), but for the jerk, which is linear times sqrt(b). For a joint q(x):

    velocity^2       q'^2 b
    acceleration     q'' b + q' a
    jerk             (q''' b + 3 q'' a + q' c) sqrt(b)
    torque           m(q, q') a + h(q, q', q'') b + gravity(q)

A jerk limit J reads |linear| <= J / sqrt(b). The right-hand side is convex: its tangents lie below it, so that a step
that keeps the linearised limit keeps the limit (Debrouwere et al., Time-optimal path following for robots with
convex-concave constraints using sequential convex programming, IEEE Transactions on Robotics 29, 2013). The new
duration, the integral of 1 / sqrt(b), is convex. So an interior-point method that starts within the limits remains
there, and whenever it ends it leaves a law that keeps them. The same holds for other convex aims, like the integral of
the squared torques, and with durations that are to be met: as their times are convex, too, Newton's steps come to them
from the slow side.

b is a quadratic spline. Each interval has one unknown, the middle Bezier point of its parabola; the value at a node
lies on the line between those of the two intervals that meet there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.time_scaling.interior_point import InteriorPoint, next_centring
from planner.time_scaling.linear_limits import GRIDPOINTS, WEIGHTS, QuadraticSpline
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.spatial import FloatArray
    from planner.time_scaling.linear_limits import LinearLimits

FIRST_SHARE = 0.9
"""Share of the largest constant b within the limits that the search begins with: it has to begin inside of them."""

START_WINDOWS = (0.01, 0.02, 0.05)
"""Shares of all intervals over which a start of the search is smoothed on either side, tried in turn: one that follows
the limits saves a quarter of its steps where these differ along the way."""

LARGEST_START = 1e6
"""Largest b of such a start, as a multiple of the least: near rest there is hardly a limit."""

WORTH_A_START = 0.8
"""Duration of such a start, relative to that of the best before it, that makes it worth to begin with it."""

FACTORS_OF_A_LOGARITHM = 4
"""Number of limits whose slacks are multiplied before the logarithm is taken, which costs as much as ten products."""

MOST_STEPS = 80
"""Newton steps in one search; 15 to 25 are common."""

FIRST_CENTRING = 0.2
"""Share of the mean complementarity that is the barrier of the first Newton step."""

LEAST_CENTRING = 0.15
"""Share of the mean complementarity that is the next barrier after a Newton step made in full."""

BARRIER_KEPT = 0.1
"""Share of what a step promises to gain that the barrier is kept at: the limits are not to be met before all else."""

LEAST_STEP = 1e-6
"""Share of a Newton step below which the search ends: durations are asked that are not within the limits."""

MOST_HALVINGS = 20
"""Times that a step is halved until cost, barrier and missed durations together fall enough."""

ARMIJO = 1e-4
"""Share of the fall that its slope promises which a step has to make (Nocedal and Wright, 2006, eq. 3.4)."""

LEAST_CURVATURE = 0.05
"""Share of the duration's own curvature that is kept where the jerk limits make the problem concave."""


class Aim(ABC):
    """The objective that a retiming makes small: a function of b, a and c at the gridpoints."""

    @abstractmethod
    def value(self, states: FloatArray) -> float:
        """Return the value of the objective at states (3, points); it is positive."""

    @abstractmethod
    def slope(self, states: FloatArray) -> FloatArray:
        """Return the derivative (3, points) of the objective by b, a and c."""

    @abstractmethod
    def curvature(self, states: FloatArray, concave: FloatArray) -> FloatArray:
        """Return second derivative (3, 3, points) of the objective, less that of 1 / sqrt(b) times `concave` (points,).

        Where the difference is not positive semidefinite, a matrix near to it that is stands in for it.
        """


class Duration(Aim):
    """The duration, s, as the objective: a function of b alone.

    Attributes:
        weights: Weights (points,), s, in the sum of 1 / sqrt(b) that stands for the integral.
    """

    def __init__(self, weights: FloatArray) -> None:
        self.weights = weights

    @classmethod
    def of_intervals(cls, widths: FloatArray) -> Duration:
        """Return the duration of a law of intervals of some widths (intervals,), s."""
        return cls((WEIGHTS[:, None] * widths).ravel())

    def value(self, states: FloatArray) -> float:
        """Return the duration, s, at states (3, points)."""
        return float((self.weights * states[0] ** -0.5).sum())

    def slope(self, states: FloatArray) -> FloatArray:
        """Return the derivative (3, points) of the duration; only that by b is not 0."""
        slope = np.zeros_like(states)
        slope[0] = -0.5 * self.weights * states[0] ** -1.5
        return slope

    def curvature(self, states: FloatArray, concave: FloatArray) -> FloatArray:
        """Return the second derivative (3, 3, points) by b, of which at least `LEAST_CURVATURE` remains."""
        result = np.zeros((3, *states.shape))
        result[0, 0] = 0.75 * states[0] ** -2.5 * np.maximum(self.weights - concave, LEAST_CURVATURE * self.weights)
        return result


class AskedDurations(NamedTuple):
    """Durations of parts of a law that are to be met.

    Attributes:
        weights: Weights (parts, points), s, in the sums of 1 / sqrt(b) that stand for the durations.
        durations: The asked durations (parts,), s.
    """

    weights: FloatArray
    durations: FloatArray

    @classmethod
    def of_parts(cls, widths: FloatArray, parts: np.ndarray, durations: FloatArray) -> AskedDurations:
        """Return the durations asked of parts of a law, by whether (parts, intervals) an interval belongs to one."""
        weights = (WEIGHTS[:, None] * widths * parts[:, None]).reshape(len(parts), len(WEIGHTS) * len(widths))
        return cls(weights, durations)

    def missed(self, b: FloatArray) -> FloatArray:
        """Return the excess (parts,), s, of the durations over those that are asked."""
        missed: FloatArray = self.weights @ b**-0.5 - self.durations
        return missed

    def slopes(self, b: FloatArray) -> FloatArray:
        """Return the derivatives (parts, 3, points) of the durations by b, a and c."""
        slopes = np.zeros((len(self.weights), 3, len(b)))
        slopes[:, 0] = -0.5 * self.weights * b**-1.5
        return slopes


class Retiming(NamedTuple):
    """The result of a search for the best law.

    Attributes:
        unknowns: The unknowns (intervals + 2,) of the spline b.
        converged: Whether nothing better is left, within the tolerance, and durations are met as closely.
    """

    unknowns: FloatArray
    converged: bool


def fastest_retiming(
    widths: FloatArray, limits: LinearLimits, tolerance: float, asked: AskedDurations | None = None
) -> FloatArray:
    """Find the unknowns (intervals + 2,) of the fastest law within limits; see `best_retiming`."""
    aim, start = Duration.of_intervals(widths), _start(widths, limits)
    return best_retiming(widths, limits, aim, asked, tolerance, start=start).unknowns


def _start(widths: FloatArray, limits: LinearLimits) -> FloatArray:
    """Return a start (intervals + 2,) for a search for the fastest law, up to a factor: as smooth as it has to be.

    It is what the limits would allow at each gridpoint if b were constant, the least of it near each interval, smoothed
    by moving averages.
    """
    spline, duration = QuadraticSpline(widths), Duration.of_intervals(widths)
    best = np.ones(len(widths) + 2)
    states = spline.states(best)
    allowed = limits.scales(states).reshape(len(GRIDPOINTS), -1).min(axis=0)
    least = duration.value(allowed.min() * states)
    allowed = np.minimum(allowed, LARGEST_START * allowed.min())
    for share in START_WINDOWS:
        reach = max(1, int(share * len(widths)))
        near = np.lib.stride_tricks.sliding_window_view(np.pad(allowed, 2 * reach, mode="edge"), 4 * reach + 1).min(
            axis=1
        )
        window = np.full(2 * reach + 1, 1.0 / (2 * reach + 1))
        for _ in range(2):
            near = np.convolve(np.pad(near, reach, mode="edge"), window, mode="valid")
        smooth = np.pad(near, 1, mode="edge")
        states = spline.states(smooth)
        if (value := duration.value(limits.scale(states) * states)) < WORTH_A_START * least:
            best, least = smooth, value
    return best


def best_retiming(
    widths: FloatArray,
    limits: LinearLimits,
    aim: Aim,
    asked: AskedDurations | None,
    tolerance: float,
    steps: int = MOST_STEPS,
    start: FloatArray | None = None,
    *,
    begins_evenly: bool = False,
) -> Retiming:
    """Find the best law within limits.

    The method is a primal-dual interior-point method (Nocedal and Wright, Numerical Optimization, 2006, ch. 19)
    without slack variables.

    Args:
        widths: Lengths (intervals,), s, of the intervals of the old law's time.
        limits: Limits at the first gridpoints of all intervals, then at the second ones, and so on. They allow rest.
        aim: The objective, at the same gridpoints.
        asked: Durations to be met; None: none.
        tolerance: Gap between the objective and its lower bound, relative, that may be left.
        steps: Newton steps, at most.
        start: Unknowns (intervals + 2,) that the search begins with, up to a factor; None: b is constant.
        begins_evenly: Whether a is 0 at the start, so that the acceleration there is that of the old law times b.
    """
    spline = QuadraticSpline(widths, begins_evenly=begins_evenly)
    asked = asked or AskedDurations.of_parts(widths, np.empty((0, len(widths)), dtype=bool), np.empty(0))
    x = np.ones(len(widths) + 2) if start is None else start
    x = x * FIRST_SHARE * limits.scale(spline.states(x))
    # The search begins on the slow side of the asked durations.
    share = (1.0 + asked.missed(spline.states(x)[0]) / asked.durations).min(initial=1.0)
    x *= share**2
    states = spline.states(x)
    barrier, value, centring = _Barrier(limits, states), aim.value(states), FIRST_CENTRING
    count = barrier.slacks.size + x.size
    point = InteriorPoint.on_central_path(barrier.slacks, value / count)
    positive = InteriorPoint.on_central_path(x, value / count)  # and b with all unknowns
    multipliers, penalty, gain, converged = np.zeros(len(asked.durations)), 0.0, 0.0, False
    for _ in range(steps):
        gap = point.gap + positive.gap
        missed = asked.missed(states[0])
        if max(gap, gain) < tolerance * value and (np.abs(missed) <= tolerance * asked.durations).all():
            converged = True
            break
        mu = max(centring * gap, BARRIER_KEPT * min(gain, value)) / count
        terms, own = point.towards(mu), positive.towards(mu)
        concave = _over_limits(point.duals[0] + point.duals[1], limits.inverse) - multipliers @ asked.weights
        system = spline.bands(barrier.stiffness(terms.stiffness) + aim.curvature(states, concave))
        system[0] += own.stiffness
        downhill = force = spline.force(barrier.force(terms.push) - aim.slope(states)) + own.push
        step = _solve(system, force)
        if len(missed):
            slopes = np.array([spline.force(slope) for slope in asked.slopes(states[0])])
            yields = np.array([_solve(system, slope) for slope in slopes])
            multipliers = np.linalg.solve(slopes @ yields.T, slopes @ step + missed)
            step -= multipliers @ yields
            force = force - multipliers @ slopes
        gain = float(force @ step)
        made = point.step(terms, barrier.slack_changes(spline.states(step)))
        made_positive = positive.step(own, step)
        length = min(made.primal, made_positive.primal)
        if length < LEAST_STEP:
            break
        penalty = max(penalty, 2.0 * float(np.abs(multipliers).max(initial=0.0)))
        excess = penalty * float(np.abs(missed).sum())
        merit = value + mu * (barrier.height - float(np.log(x).sum())) + excess
        fall = float(downhill @ step) + excess
        begin = x
        for _ in range(MOST_HALVINGS):
            x = begin + length * step
            states = spline.states(x)
            barrier, value = _Barrier(limits, states), aim.value(states)
            excess = penalty * float(np.abs(asked.missed(states[0])).sum())
            height = barrier.height - float(np.log(x).sum())
            if value + mu * height + excess <= merit - ARMIJO * length * fall + ROUNDING * abs(merit):
                break
            length *= 0.5
        centring = next_centring(min(length, made.dual, made_positive.dual), LEAST_CENTRING)
        point, positive = point.moved(barrier.slacks, made), positive.moved(x, made_positive)
    if begins_evenly:
        x[0] = x[1]
    return Retiming(x, converged)


class _Barrier:
    """The barrier at some b: what is left of the limits, and its derivatives by (b, a, c) at each gridpoint.

    Attributes:
        slacks: What is left (2, limits, points) below the upper bounds and above the lower ones.
    """

    def __init__(self, limits: LinearLimits, states: FloatArray) -> None:
        self.limits = limits
        self.rows = (limits.by_b, limits.by_a, limits.by_c)
        values = limits.values(states) + limits.offset
        bound = limits.constant + limits.inverse * states[0] ** -0.5
        self.slacks = np.empty((2, *values.shape))
        np.subtract(bound, values, out=self.slacks[0])
        np.add(bound, values, out=self.slacks[1])
        self.narrowing = 0.5 * limits.inverse * states[0] ** -1.5  # of the bounds, by b

    def slack_changes(self, change: FloatArray) -> FloatArray:
        """Return the changes of the slacks (2, limits, points), to first order, when b, a and c change (3, points)."""
        values, narrowing = self.limits.values(change), self.narrowing * change[0]
        changes = np.empty_like(self.slacks)
        np.negative(np.add(values, narrowing, out=changes[0]), out=changes[0])
        np.subtract(values, narrowing, out=changes[1])
        return changes

    @cached_property
    def height(self) -> float:
        """The value of the barrier of strength 1, minus the sum of log(slacks); infinite where a limit is reached."""
        if self.slacks.min() <= 0.0:
            return np.inf
        of_each = self.slacks[0] * self.slacks[1]
        together = np.multiply.reduceat(of_each, np.arange(0, len(of_each), FACTORS_OF_A_LOGARITHM), axis=0)
        return -float(np.log(together).sum())

    def force(self, push: FloatArray) -> FloatArray:
        """Return force (3, points) away from the limits, by the barrier's `push` (2, limits, points) on each slack."""
        difference = push[1] - push[0]
        force = np.stack([_over_limits(difference, row) for row in self.rows])
        force[0] -= _over_limits(push[0] + push[1], self.narrowing)
        return force

    def stiffness(self, stiffness: FloatArray) -> FloatArray:
        """Return the Hessian (3, 3, points) by b, a and c, by the stiffness (2, limits, points) of each slack."""
        upper, lower = stiffness
        both, pull = upper + lower, (upper - lower) * self.narrowing
        result = np.empty((3, 3, upper.shape[1]))
        for i, row in enumerate(self.rows):
            weighted = both * row
            for k in range(i, 3):
                result[i, k] = result[k, i] = _over_limits(weighted, self.rows[k])
        for k, row in enumerate(self.rows):
            mixed = _over_limits(pull, row)
            result[0, k] += mixed
            result[k, 0] += mixed
        result[0, 0] += _over_limits(both * self.narrowing, self.narrowing)
        return result


def _over_limits(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the sums (points,) over the limits of products (limits, points)."""
    result: FloatArray = np.einsum("lp,lp->p", first, second)
    return result


def _solve(bands: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a symmetric system with two diagonals on either side, of which `bands` are the main and the upper ones.

    It is positive definite but for rounding; elimination with pivots does not ask for that.
    """
    from scipy.linalg import solve_banded  # loaded by the first law: importing the library stays quick

    diagonals = np.zeros((5, len(right)))
    for k in range(3):
        diagonals[2 - k, k:] = diagonals[2 + k, : len(right) - k] = bands[k, : len(right) - k]
    return np.asarray(solve_banded((2, 2), diagonals, right, check_finite=False), dtype=np.float64)
