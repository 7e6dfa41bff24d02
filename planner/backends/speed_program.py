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

FIRST_SHARE = 0.8
"""Of what the limits allow: b at the start."""

MOST_STEPS, LEAST_CENTRING, FIRST_CENTRING = 80, 0.15, 0.2
"""Newton steps; and what is left of the barrier in one that could be made in full, and in the first."""

TO_THE_WALL, MOST_SHRINK = 0.98, 0.9
"""Of the way to the nearest limit, what a step goes; of an unknown, what a step may take away."""

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
        values = self.by_b * b
        values += self.by_a * a
        values += self.by_c * c
        return values

    def slacks(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(limits, points), twice: what is left below the upper and above the lower bounds."""
        values = self.values(states)
        values += self.offset
        bound = self.inverse * states[0] ** -0.5
        bound += self.constant
        return bound - values, bound + values

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
    states = spline.states(x)
    over, under = limits.slacks(states)
    duration = float(weights @ (1.0 / np.sqrt(states[0])))
    count, centring = 2 * over.size, FIRST_CENTRING
    dual_over, dual_under = MU0 * duration / count / over, MU0 * duration / count / under
    for step in range(MOST_STEPS):
        gap = float(np.einsum("lp,lp->", dual_over, over) + np.einsum("lp,lp->", dual_under, under))
        if TRACE is not None: TRACE.append((gap/duration, duration))
        if gap < tolerance * duration:
            break
        barrier = centring * gap / count
        push_over, push_under = barrier / over, barrier / under
        stiff_over, stiff_under = dual_over / over, dual_under / under
        bend = 0.5 * limits.inverse * states[0] ** -1.5
        system = spline.bands(_stiffness(limits, states[0], weights, bend, (stiff_over, stiff_under), dual_over + dual_under))
        change = _solve(system, spline.force(_force(limits, states[0], weights, bend, (push_over, push_under))))
        moved = spline.states(change)
        rows, bend = limits.values(moved), bend * moved[0]
        slack_over, slack_under = -bend - rows, rows - bend
        push_over -= dual_over + stiff_over * slack_over
        push_under -= dual_under + stiff_under * slack_under
        length = min(_longest((over, slack_over), (under, slack_under)), _longest((x, change)))
        dual_length = _longest((dual_over, push_over), (dual_under, push_under))
        centring = max(LEAST_CENTRING, (1.0 - min(length, dual_length)) ** 0.5)
        x = x + length * change
        dual_over += dual_length * push_over
        dual_under += dual_length * push_under
        states = spline.states(x)
        over, under = limits.slacks(states)
        duration = float(weights @ (1.0 / np.sqrt(states[0])))
    return x
TRACE=None
MU0=1.0


def _longest(*pairs: tuple[FloatArray, FloatArray]) -> float:
    """At most 1, and short of where a positive quantity would vanish, for pairs of a quantity and its change."""
    fastest = max(-float((change / value).min()) for value, change in pairs)
    return 1.0 if fastest <= TO_THE_WALL else TO_THE_WALL / fastest


def _stiffness(limits, b, weights, bend, stiff, duals) -> FloatArray:
    """(3, 3, points): the Hessian of the barrier problem in (b, a, c)."""
    both, difference = stiff[0] + stiff[1], stiff[0] - stiff[1]
    rows = (limits.by_b, limits.by_a, limits.by_c)
    result = np.zeros((3, 3, len(b)))
    for i in range(3):
        weighted = both * rows[i]
        for k in range(i, 3):
            result[i, k] = np.einsum("lp,lp->p", weighted, rows[k])
            result[k, i] = result[i, k]
    difference *= bend
    for k in range(3):
        extra = np.einsum("lp,lp->p", difference, rows[k])
        result[0, k] += extra
        result[k, 0] += extra
    both *= bend
    convex = weights.copy()
    convex -= np.einsum("lp,lp->p", duals, limits.inverse)
    result[0, 0] += 0.75 * b**-2.5 * np.maximum(convex, LEAST_CURVATURE * weights)
    result[0, 0] += np.einsum("lp,lp->p", both, bend)
    return result


def _force(limits, b, weights, bend, push) -> FloatArray:
    """(3, points): the descent of the barrier problem in (b, a, c)."""
    difference = push[1] - push[0]
    force = np.zeros((3, len(b)))
    for k, row in enumerate((limits.by_b, limits.by_a, limits.by_c)):
        force[k] = np.einsum("lp,lp->p", difference, row)
    force[0] += 0.5 * weights * b**-1.5
    force[0] -= np.einsum("lp,lp->p", push[0] + push[1], bend)
    return force


def _solve(bands: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a positive definite system with two diagonals on either side: L D L^T, number by number."""
    main, first, second = bands.tolist()
    z = right.tolist()
    count = len(z)
    l1, l2 = [0.0] * count, [0.0] * count
    for i in range(count):
        pivot = main[i]
        if i + 1 < count:
            m1 = first[i] / pivot
            l1[i] = m1
            main[i + 1] -= m1 * first[i]
            z[i + 1] -= m1 * z[i]
            if i + 2 < count:
                m2 = second[i] / pivot
                l2[i] = m2
                first[i + 1] -= m1 * second[i]
                main[i + 2] -= m2 * second[i]
                z[i + 2] -= m2 * z[i]
    x1 = x2 = 0.0
    for i in range(count - 1, -1, -1):
        value = z[i] / main[i] - l1[i] * x1 - l2[i] * x2
        z[i] = value
        x1, x2 = value, x1
    return np.array(z)
