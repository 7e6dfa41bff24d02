"""The fastest retiming of a motion within limits on speed, acceleration, jerk and torque.

A retiming multiplies the speed of a motion at its time x by sqrt(b(x)). With a = b' / 2 and c = b'' / 2, all limited
quantities are linear in (b, a, c), except the jerk, which is linear times sqrt(b). For a joint q(x):

    - velocity^2       q'^2 b
    - acceleration     q'' b + q' a
    - jerk             (q''' b + 3 q'' a + q' c) sqrt(b)
    - torque           m(q, q') a + h(q, q', q'') b + gravity(q)

A jerk limit J reads |linear| <= J / sqrt(b). The right-hand side is convex: its tangents lie below it, so that a step
within the linearised limit is within the limit. See Debrouwere et al., Time-optimal path following for robots with
convex-concave constraints using sequential convex programming, IEEE Transactions on Robotics 29, 2013. The new
duration, the integral of 1 / sqrt(b), is convex. So an interior-point method that starts within the limits remains
there, and its result always keeps them. The same holds for other convex objectives, such as the integral of the squared
torques. It also holds for requested durations: they are convex, too, and Newton's steps approach them from the slow
side.

b is a quadratic spline. Each interval has one unknown, the middle Bezier point of its parabola. The value at a node
lies on the line between the points of its two intervals.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.retiming import Objective, best_unknowns, smooth_start
from planner.spatial import FloatArray
from planner.time_scaling.linear_limits import WEIGHTS, LinearLimits, QuadraticSpline

FIRST_SHARE = 0.9
"""Share of the largest constant b within the limits that the search begins with: it has to begin inside of them."""

START_WINDOWS = (0.01, 0.02, 0.05)
"""Fractions of all intervals over which a start of the search is smoothed on either side, tried in turn.

A start that follows the limits saves a quarter of the steps where the limits differ along the path.
"""

LARGEST_START = 1e6
"""Largest b of such a start, as a multiple of the least: near rest there is hardly a limit."""

WORTH_A_START = 0.8
"""Duration of such a start, relative to that of the best before it, that makes it worth to begin with it."""

MOST_RETIMING_STEPS = 80
"""Newton steps in one search; 15 to 25 are common."""


def of_duration(widths: FloatArray) -> Objective:
    """Return the duration, s, of intervals of some widths (intervals,), s, as the objective."""
    return Objective((WEIGHTS[:, None] * widths).ravel())


class RequestedDurations(NamedTuple):
    """Requested durations of parts of a motion.

    Attributes:
        weights: Weights (parts, points), s, in the sums of 1 / sqrt(b) that stand for the durations.
        durations: The requested durations (parts,), s.
    """

    weights: FloatArray
    durations: FloatArray

    @classmethod
    def of_parts(cls, widths: FloatArray, parts: np.ndarray, durations: FloatArray) -> RequestedDurations:
        """Return requested durations of parts of a motion, with a mask (parts, intervals) of their intervals."""
        weights = (WEIGHTS[:, None] * widths * parts[:, None]).reshape(len(parts), len(WEIGHTS) * len(widths))
        return cls(weights, durations)

    def missed(self, b: FloatArray) -> FloatArray:
        """Return the excess (parts,), s, over the requested durations."""
        return self.weights @ b**-0.5 - self.durations

    def slopes(self, b: FloatArray) -> FloatArray:
        """Return the derivatives (parts, 3, points) of the durations by b, a and c."""
        slopes = np.zeros((len(self.weights), 3, len(b)))
        slopes[:, 0] = -0.5 * self.weights * b**-1.5
        return slopes


class Retiming(NamedTuple):
    """The result of a search for the best retiming.

    Attributes:
        unknowns: The unknowns (intervals + 2,) of the spline b.
        converged: Whether nothing better is left, within the tolerance, and durations are met as closely.
    """

    unknowns: FloatArray
    converged: bool


def fastest_retiming(
    widths: FloatArray, limits: LinearLimits, tolerance: float, requested: RequestedDurations | None = None
) -> FloatArray:
    """Find the unknowns (intervals + 2,) of the fastest retiming within limits; see `best_retiming`."""
    reaches = np.maximum(1, (np.array(START_WINDOWS) * len(widths)).astype(int))
    maps, weights = QuadraticSpline(widths).maps, of_duration(widths).weights
    start = smooth_start(maps, limits.arrays, weights, reaches, LARGEST_START, WORTH_A_START)
    return best_retiming(widths, limits, of_duration(widths), requested, tolerance, start=start).unknowns


def best_retiming(
    widths: FloatArray,
    limits: LinearLimits,
    objective: Objective,
    requested: RequestedDurations | None,
    tolerance: float,
    steps: int = MOST_RETIMING_STEPS,
    start: FloatArray | None = None,
    *,
    begins_evenly: bool = False,
) -> Retiming:
    """Find the best retiming within limits.

    The method is a primal-dual interior-point method (Nocedal and Wright, Numerical Optimization, 2006, ch. 19)
    without slack variables.

    Args:
        widths: Lengths (intervals,), s, of the intervals of the old time.
        limits: Limits at the first gridpoints of all intervals, then at the second ones, and so on. They allow rest.
        objective: The objective, at the same gridpoints.
        requested: Requested durations; None: none.
        tolerance: Gap between the objective and its lower bound, relative, that may be left.
        steps: Newton steps, at most.
        start: Unknowns (intervals + 2,) that the search begins with, up to a factor; None: b is constant.
        begins_evenly: Whether a is 0 at the start, so that the acceleration there is the old one times b.
    """
    spline = QuadraticSpline(widths, begins_evenly=begins_evenly)
    requested = requested or RequestedDurations.of_parts(widths, np.empty((0, len(widths)), dtype=bool), np.empty(0))
    x = np.ones(len(widths) + 2) if start is None else start
    x = x * FIRST_SHARE * limits.scale(spline.states(x))
    # The search begins on the slow side of the requested durations.
    share = (1.0 + requested.missed(spline.states(x)[0]) / requested.durations).min(initial=1.0)
    x *= share**2
    x, converged = best_unknowns(spline.maps, limits.arrays, objective, requested, tolerance, steps, x)
    if begins_evenly:
        x[0] = x[1]
    return Retiming(x, converged)
