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
there, and whenever it ends it leaves a law that keeps them.

b is a quadratic spline. Each interval has one unknown, the middle Bezier point of its parabola; the value at a node
lies on the line between those of the two intervals that meet there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray

PLACES = np.array([0.0, 0.5, 1.0])
"""Of each interval, where its limits are looked at. Next to a place of rest the middle tells what the ends cannot."""

WEIGHTS = np.array([1.0, 4.0, 1.0]) / 6.0
"""Simpson's, for the same places."""

FIRST_SHARE = 0.9
"""Of what the limits allow: b at the start."""

MOST_STEPS, FIRST_CENTRING, LEAST_CENTRING = 80, 0.2, 0.15
"""Newton steps; what is left of the barrier in the first, and in one that could be made in full."""

TO_THE_WALL = 0.98
"""Of the way to where a limit is reached (or an unknown vanishes), what a step goes."""

LEAST_CURVATURE = 0.05
"""Of the duration's own curvature, what is kept where the jerk limits make the problem concave."""


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """|by_b b + by_a a + by_c c + offset| <= constant + inverse / sqrt(b).

    Attributes:
        by_b: (limits, points).
        by_a: (limits, points).
        by_c: (limits, points).
        offset: (limits, points).
        constant: (limits, points).
        inverse: (limits, points).
    """

    by_b: FloatArray
    by_a: FloatArray
    by_c: FloatArray
    offset: FloatArray
    constant: FloatArray
    inverse: FloatArray

    def values(self, states: FloatArray) -> FloatArray:
        """(limits, points): by_b b + by_a a + by_c c, for states (3, points)."""
        b, a, c = states
        values: FloatArray = self.by_b * b
        values += self.by_a * a
        values += self.by_c * c
        return values

    def scale(self, states: FloatArray) -> float:
        """The largest factor on b with which the limits are kept."""
        values = np.abs(self.values(states))
        with np.errstate(divide="ignore", invalid="ignore"):
            plain = ((self.constant - np.abs(self.offset)) / values)[self.inverse == 0.0]
            jerk = (self.inverse / np.sqrt(states[0]) / values)[self.inverse > 0.0]
        return float(min(np.nanmin(plain, initial=np.inf), np.nanmin(jerk, initial=np.inf) ** (2.0 / 3.0)))


class QuadraticSpline:
    """b, a and c at the points (all places of all intervals) by the unknowns.

    Attributes:
        maps: (3, 3, places, intervals): (b, a, c) of the unknowns of the interval before, the own and the next.
    """

    def __init__(self, widths: FloatArray) -> None:
        # Beyond both ends there is an interval of no width, whose unknown is the value at the end.
        padded = np.concatenate([[0.0], widths, [0.0]])
        both = padded[:-1] + padded[1:]
        value, slope = np.zeros((2, 3, len(both))), np.zeros((2, 3, len(both)))
        value[0, 0] = value[1, 1] = padded[1:] / both
        value[0, 1] = value[1, 2] = padded[:-1] / both
        slope[0, 0] = slope[1, 1] = -1.0 / both
        slope[0, 1] = slope[1, 2] = 1.0 / both
        start, end = value[0, :, :-1], value[1, :, 1:]
        middle = np.array([[0.0], [1.0], [0.0]])
        self.maps = np.empty((3, 3, len(PLACES), len(widths)))
        for k, u in enumerate(PLACES):
            self.maps[0, :, k] = (1.0 - u) ** 2 * start + 2.0 * u * (1.0 - u) * middle + u * u * end
            self.maps[1, :, k] = (1.0 - u) * slope[0, :, :-1] + u * slope[1, :, 1:]
            self.maps[2, :, k] = (start - 2.0 * middle + end) / widths**2
        self.count = len(widths)

    def states(self, x: FloatArray) -> FloatArray:
        """(3, points): b, a, c with unknowns (intervals + 2,)."""
        n = self.count
        states = self.maps[:, 0] * x[:n] + self.maps[:, 1] * x[1 : n + 1] + self.maps[:, 2] * x[2:]
        return states.reshape(3, -1)

    def force(self, forces: FloatArray) -> FloatArray:
        """What forces (3, points) on b, a and c are on the unknowns (intervals + 2,)."""
        n = self.count
        own = np.einsum("yxpn,ypn->xn", self.maps, forces.reshape(3, -1, n))
        total = np.zeros(n + 2)
        for k in range(3):
            total[k : k + n] += own[k]
        return total

    def bands(self, stiffness: FloatArray) -> FloatArray:
        """(3, intervals + 2): the main and two upper diagonals of what stiffness (3, 3, points) is on the unknowns."""
        n = self.count
        block = stiffness.reshape(3, 3, -1, n)
        bands = np.zeros((3, n + 2))
        pulled = np.einsum("yzpn,zxpn->yxpn", block, self.maps)
        for k in range(3):
            for m in range(k, 3):
                bands[m - k, k : k + n] += np.einsum("ypn,ypn->n", self.maps[:, k], pulled[:, m])
        return bands


def fastest_retiming(widths: FloatArray, limits: LinearLimits, tolerance: float) -> FloatArray:
    """The unknowns (intervals + 2,) of the fastest law within limits.

    A primal-dual interior-point method (Nocedal and Wright, Numerical Optimization, 2006, ch. 19) without slacks.

    Args:
        widths: (intervals,), of the old law's time.
        limits: At the first places of all intervals, then at the second ones, and so on. They allow rest.
        tolerance: Gap between the duration and its lower bound, relative, that may be left.
    """
    spline, weights = QuadraticSpline(widths), (WEIGHTS[:, None] * widths).ravel()
    x = np.ones(len(widths) + 2)
    x *= FIRST_SHARE * limits.scale(spline.states(x))
    point, centring = _Point(limits, weights, spline.states(x)), FIRST_CENTRING
    count = 2 * point.over.size
    dual_over, dual_under = point.duration / count / point.over, point.duration / count / point.under
    for _ in range(MOST_STEPS):
        gap = float(np.einsum("lp,lp->", dual_over, point.over) + np.einsum("lp,lp->", dual_under, point.under))
        if gap < tolerance * point.duration:
            break
        barrier = centring * gap / count
        push_over, push_under = barrier / point.over, barrier / point.under
        stiff_over, stiff_under = dual_over / point.over, dual_under / point.under
        system = spline.bands(point.stiffness(stiff_over, stiff_under, dual_over + dual_under))
        step = _solve(system, spline.force(point.force(push_over, push_under)))
        slack_over, slack_under = point.slack_changes(spline.states(step))
        step_over = push_over - dual_over - stiff_over * slack_over
        step_under = push_under - dual_under - stiff_under * slack_under
        length = _longest((x, step), (point.over, slack_over), (point.under, slack_under))
        dual_length = _longest((dual_over, step_over), (dual_under, step_under))
        centring = max(LEAST_CENTRING, (1.0 - min(length, dual_length)) ** 0.5)
        x = x + length * step
        dual_over += dual_length * step_over
        dual_under += dual_length * step_under
        point = _Point(limits, weights, spline.states(x))
    return x


def _longest(*pairs: tuple[FloatArray, FloatArray]) -> float:
    """At most 1, and short of where a positive quantity would vanish, for pairs of a quantity and its change."""
    fastest = max(-float((change / value).min()) for value, change in pairs)
    return 1.0 if fastest <= TO_THE_WALL else TO_THE_WALL / fastest


class _Point:
    """The barrier problem at some b: what is left of the limits, and its derivatives by (b, a, c) at each point.

    Attributes:
        over: (limits, points), what is left below the upper bounds.
        under: (limits, points), what is left above the lower ones.
        duration: Of the new law.
    """

    def __init__(self, limits: LinearLimits, weights: FloatArray, states: FloatArray) -> None:
        self.limits, self.weights, self.b = limits, weights, states[0]
        self.rows = (limits.by_b, limits.by_a, limits.by_c)
        values = limits.values(states) + limits.offset
        bound = limits.constant + limits.inverse * self.b**-0.5
        self.over, self.under = bound - values, bound + values
        self.narrowing = 0.5 * limits.inverse * self.b**-1.5  # of the bounds, by b
        self.duration = float((weights * self.b**-0.5).sum())

    def slack_changes(self, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of `over` and `under`, to first order, when b, a and c change (3, points)."""
        values, narrowing = self.limits.values(change), self.narrowing * change[0]
        return -narrowing - values, values - narrowing

    def force(self, push_over: FloatArray, push_under: FloatArray) -> FloatArray:
        """(3, points): the descent of duration and barrier; `push` is the barrier by the slack, (limits, points)."""
        difference = push_under - push_over
        force = np.stack([_over_limits(difference, row) for row in self.rows])
        force[0] += 0.5 * self.weights * self.b**-1.5 - _over_limits(push_over + push_under, self.narrowing)
        return force

    def stiffness(self, over: FloatArray, under: FloatArray, duals: FloatArray) -> FloatArray:
        """(3, 3, points): the Hessian; `over` and `under` are the duals by the slack, (limits, points)."""
        both, pull = over + under, (over - under) * self.narrowing
        result = np.empty((3, 3, len(self.b)))
        for i, row in enumerate(self.rows):
            weighted = both * row
            for k in range(i, 3):
                result[i, k] = result[k, i] = _over_limits(weighted, self.rows[k])
        for k, row in enumerate(self.rows):
            mixed = _over_limits(pull, row)
            result[0, k] += mixed
            result[k, 0] += mixed
        # The duration is convex in b, what jerk limits allow is, too: which pulls the other way.
        convex = self.weights - _over_limits(duals, self.limits.inverse)
        result[0, 0] += 0.75 * self.b**-2.5 * np.maximum(convex, LEAST_CURVATURE * self.weights)
        result[0, 0] += _over_limits(both * self.narrowing, self.narrowing)
        return result


def _over_limits(first: FloatArray, second: FloatArray) -> FloatArray:
    """(points,): the sums of products over the limits."""
    result: FloatArray = np.einsum("lp,lp->p", first, second)
    return result


def _solve(bands: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a positive definite system with two diagonals on either side: L D L^T, number by number."""
    main, first, second = (row.tolist() for row in np.pad(bands, ((0, 0), (0, 2))))
    z = [*right.tolist(), 0.0, 0.0]
    count = len(right)
    near, far = [0.0] * count, [0.0] * count
    for i in range(count):
        near[i], far[i] = m, n = first[i] / main[i], second[i] / main[i]
        main[i + 1] -= m * first[i]
        first[i + 1] -= m * second[i]
        main[i + 2] -= n * second[i]
        z[i + 1] -= m * z[i]
        z[i + 2] -= n * z[i]
    z[count:] = 0.0, 0.0
    for i in range(count - 1, -1, -1):
        z[i] = z[i] / main[i] - near[i] * z[i + 1] - far[i] * z[i + 2]
    return np.array(z[:count])
