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
"""Of each interval, where its limits are looked at."""

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
        values: FloatArray = self.by_b * states[0] + self.by_a * states[1] + self.by_c * states[2]
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
    """The unknowns (intervals + 2,) of the fastest law within the limits; its points are ordered by place, then interval.

    A primal-dual interior-point method (Nocedal and Wright, Numerical Optimization, 2006, ch. 19) without slacks.

    Args:
        widths: (intervals,), of the old law's time.
        limits: At the points. They allow rest.
        tolerance: Gap between the duration and its lower bound, relative, that may be left.
    """
    spline = QuadraticSpline(widths)
    weights = (WEIGHTS[:, None] * widths).ravel()
    x = np.ones(len(widths) + 2)
    x *= FIRST_SHARE * limits.scale(spline.states(x))
    slacks, inverse_root = _slacks(limits, spline.states(x))
    duration = float(weights @ inverse_root)
    count, centring = slacks.size, FIRST_CENTRING
    duals = duration / count / slacks
    for step in range(MOST_STEPS):
        gap = float(np.vdot(duals, slacks))
        if gap < tolerance * duration:
            break
        barrier = centring * gap / count
        cube = inverse_root**3
        bend = 0.5 * limits.inverse * cube
        stiffness, push = duals / slacks, barrier / slacks
        system = spline.bands(_stiffness(limits, stiffness, bend, weights, duals, cube, inverse_root))
        change = _solve(system, spline.force(_force(limits, push, bend, weights, cube)))
        moved = spline.states(change)
        along_rows, along_b = limits.values(moved), bend * moved[0]
        slack_change = np.stack([-along_b - along_rows, along_rows - along_b])
        dual_change = push - duals - stiffness * slack_change
        length = min(1.0, TO_THE_WALL / max(float((-slack_change / slacks).max()), 1e-9))
        length = min(length, MOST_SHRINK / max(float((-change / x).max()), 1e-9))
        dual_length = min(1.0, TO_THE_WALL / max(float((-dual_change / duals).max()), 1e-9))
        if TRACE is not None: TRACE.append((gap/duration, length, dual_length, duration))
        centring = max(LEAST_CENTRING, (1.0 - min(length, dual_length)) ** 0.5)
        x = x + length * change
        duals = duals + dual_length * dual_change
        slacks, inverse_root = _slacks(limits, spline.states(x))
        duration = float(weights @ inverse_root)
    return x
TRACE=None


def _slacks(limits: LinearLimits, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What is left of the upper and of the lower limits (2, limits, points), and 1 / sqrt(b) (points,)."""
    inverse_root = 1.0 / np.sqrt(states[0])
    values, bound = limits.values(states) + limits.offset, limits.constant + limits.inverse * inverse_root
    return np.stack([bound - values, bound + values]), inverse_root


def _stiffness(limits, stiffness, bend, weights, duals, cube, inverse_root) -> FloatArray:
    """(3, 3, points): the Hessian of the barrier problem in (b, a, c)."""
    both, difference = stiffness[0] + stiffness[1], stiffness[0] - stiffness[1]
    rows = (limits.by_b, limits.by_a, limits.by_c)
    result = np.empty((3, 3, len(weights)))
    for i in range(3):
        weighted = both * rows[i]
        for k in range(i, 3):
            result[i, k] = result[k, i] = np.einsum("lp,lp->p", weighted, rows[k])
    pull = difference * bend
    for k in range(3):
        extra = np.einsum("lp,lp->p", pull, rows[k])
        result[0, k] += extra
        result[k, 0] += extra
    convex = weights - np.einsum("slp,lp->p", duals, limits.inverse)
    own = 0.75 * cube * inverse_root**2 * np.maximum(convex, LEAST_CURVATURE * weights)
    result[0, 0] += np.einsum("lp,lp->p", both * bend, bend) + own
    return result


def _force(limits, push, bend, weights, cube) -> FloatArray:
    """(3, points): the descent of the barrier problem in (b, a, c)."""
    both, difference = push[0] + push[1], push[1] - push[0]
    force = np.stack([np.einsum("lp,lp->p", difference, row) for row in (limits.by_b, limits.by_a, limits.by_c)])
    force[0] += 0.5 * weights * cube - np.einsum("lp,lp->p", both, bend)
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
