"""The fastest speed along a curve within limits on its first three derivatives by time.

Unknown is b(s) = s'^2. With a = b' / 2 = s'' and c = b'' / 2, so that s''' = c sqrt(b), what a joint (or a torque)
does at a place s is linear in (b, a, c), but for the jerk, which is linear times sqrt(b):

    velocity^2       q'^2 b
    acceleration     q'' b + q' a
    jerk             (q''' b + 3 q'' a + q' c) sqrt(b)

A jerk limit J therefore reads |linear| <= J / sqrt(b). The right-hand side is convex: its tangents lie below it, so
that a step that keeps the linearised limit keeps the limit (Debrouwere et al., Time-optimal path following for robots
with convex-concave constraints using sequential convex programming, IEEE T-RO 29, 2013). The time, the integral of
1 / sqrt(b), is convex. So an interior-point method that starts within the limits remains within them.

b is a piecewise quadratic in s with a continuous slope. Each interval of the grid has one unknown, the middle Bezier
point of its parabola; the value at a node lies on the line between those of the two intervals that meet there. From
rest, s' grows like s^(2/3): in the first and in the last interval b = k s^(4/3), the law of constant jerk.
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
"""Simpson's, of the same places."""

GHOST = 1.5
"""The end intervals act on their neighbours like a parabola's of this many times their width, with unknown 0."""

FIRST_SHARE = 0.5
"""Of what the limits allow: b of the first guess."""

MOST_STEPS, CENTRING, GAP = 80, 0.15, 2e-4
"""Newton steps; decrease of the barrier in each; gap between time and its lower bound, relative, that is left."""

TO_THE_WALL, MOST_SHRINK = 0.98, 0.9
"""Of the way to the nearest limit, what a step goes; of an unknown, what a step may take away."""

LEAST_CURVATURE = 0.05
"""Of the time's own curvature, what is kept where the jerk limits make the problem concave."""


@dataclass(frozen=True, eq=False)
class Limits3:
    """Limits lower <= D (b, a, c) <= upper, where both sides may grow with 1 / sqrt(b).

    Attributes:
        rows: (intervals, places, limits, 3): D.
        constant: (intervals, places, limits): the magnitude of the bound that does not depend on b.
        inverse: (intervals, places, limits): what of the bound goes with 1 / sqrt(b).
        offset: (intervals, places, limits): added to D (b, a, c).
    """

    rows: FloatArray
    constant: FloatArray
    inverse: FloatArray
    offset: FloatArray


class Grid:
    """Intervals of s, and how b, a and c at their places hang on the unknowns.

    Attributes:
        widths: (intervals,).
        maps: (intervals, places, 3, 3): (b, a, c) of the unknowns of the interval before, the own and the next.
        times: (intervals, places): the time is the sum of times / sqrt(b).
    """

    def __init__(self, widths: FloatArray) -> None:
        self.widths = widths
        acting = np.concatenate([[0.0], widths, [0.0]])
        joint = acting[:-1] + acting[1:]
        value = np.column_stack([acting[1:], acting[:-1]]) / joint[:, None]
        slope = np.array([-1.0, 1.0]) / joint[:, None]
        count = len(widths)
        start, end = np.zeros((count, 3)), np.zeros((count, 3))
        start[:, :2], end[:, 1:] = value[:-1], value[1:]
        start_slope, end_slope = np.zeros((count, 3)), np.zeros((count, 3))
        start_slope[:, :2], end_slope[:, 1:] = slope[:-1], slope[1:]
        middle = np.array([0.0, 1.0, 0.0])
        curvature = (start - 2.0 * middle + end) / widths[:, None] ** 2
        self.maps = np.empty((count, len(PLACES), 3, 3))
        for k, u in enumerate(PLACES):
            self.maps[:, k, 0] = (1 - u) ** 2 * start + 2 * u * (1 - u) * middle + u * u * end
            self.maps[:, k, 1] = (1 - u) * start_slope + u * end_slope
            self.maps[:, k, 2] = curvature
        self.times = WEIGHTS * widths[:, None]

    def states(self, unknowns: FloatArray) -> FloatArray:
        """(intervals, places, 3): b, a, c with unknowns (intervals - 2,)."""
        windows = np.lib.stride_tricks.sliding_window_view(unknowns, 3)
        states: FloatArray = np.einsum("npyx,nx->npy", self.maps, windows)
        return states

    def gather(self, forces: FloatArray) -> FloatArray:
        """What forces (intervals, places, 3) on (b, a, c) are on the unknowns (intervals - 2,)."""
        own = np.einsum("npyx,npy->nx", self.maps, forces)
        total = np.zeros(len(own) + 2)
        for k in range(3):
            total[k : k + len(own)] += own[:, k]
        return total

    def gather_bands(self, stiffness: FloatArray) -> FloatArray:
        """(3, intervals - 2): main and upper diagonals of what stiffness (intervals, places, 3, 3) is on the unknowns."""
        own = np.einsum("npyx,npyz->nxz", self.maps, stiffness @ self.maps)
        bands = np.zeros((3, len(own) + 2))
        for k in range(3):
            for m in range(k, 3):
                bands[m - k, k : k + len(own)] += own[:, k, m]
        return bands


def fastest(grid: Grid, limits: Limits3, guess: FloatArray) -> tuple[FloatArray, int]:
    """The unknowns (intervals - 2,) of the fastest speed within the limits.

    A primal-dual interior-point method (Nocedal and Wright, Numerical Optimization, 2006, ch. 19) without slacks.

    Args:
        grid: Of s.
        limits: At the places of the grid; they allow rest.
        guess: (intervals - 2,), positive; its scale does not matter.
    """
    x = guess * FIRST_SHARE * _scale(grid.states(guess), limits)
    rows = np.concatenate([limits.rows, -limits.rows], axis=2)
    inverse = np.concatenate([limits.inverse, limits.inverse], axis=2)
    constant = np.concatenate([limits.constant - limits.offset, limits.constant + limits.offset], axis=2)
    states = grid.states(x)
    root = 1.0 / np.sqrt(states[..., 0])
    slack = constant + inverse * root[..., None] - (rows @ states[..., None])[..., 0]
    count = slack.size
    time = float((grid.times * root).sum())
    duals = time / count / slack
    for step in range(MOST_STEPS):
        gap = float((duals * slack).sum())
        if gap < GAP * time:
            break
        barrier = CENTRING * gap / count
        cube = root**3
        normals = -rows
        normals[..., 0] -= 0.5 * inverse * cube[..., None]
        stiffness = normals.swapaxes(-1, -2) @ (normals * (duals / slack)[..., None])
        share = grid.times - (duals * inverse).sum(axis=2)
        stiffness[..., 0, 0] += 0.75 * cube * root**2 * np.maximum(share, LEAST_CURVATURE * grid.times)
        force = (normals * (barrier / slack)[..., None]).sum(axis=2)
        force[..., 0] += 0.5 * grid.times * cube
        change = _solve_bands(grid.gather_bands(stiffness), grid.gather(force))
        moved = grid.states(change)
        slack_change = (normals @ moved[..., None])[..., 0]
        dual_change = (barrier - duals * slack_change) / slack - duals
        along = min(1.0, TO_THE_WALL / max(float((-slack_change / slack).max()), 1e-9))
        along = min(along, MOST_SHRINK / max(float((-change / x).max()), 1e-9))
        x = x + along * change
        duals = duals + min(1.0, TO_THE_WALL / max(float((-dual_change / duals).max()), 1e-9)) * dual_change
        states = grid.states(x)
        root = 1.0 / np.sqrt(states[..., 0])
        slack = constant + inverse * root[..., None] - (rows @ states[..., None])[..., 0]
        time = float((grid.times * root).sum())
    return x, step


def _scale(states: FloatArray, limits: Limits3) -> float:
    """The largest factor on b with which the limits are kept."""
    values = (limits.rows @ states[..., None])[..., 0]
    room = limits.constant - np.sign(values) * limits.offset
    bound = limits.inverse / np.sqrt(states[..., :1])
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = np.where(limits.inverse > 0.0, np.inf, room / np.abs(values))
        jerk = np.where(limits.inverse > 0.0, (bound / np.abs(values)) ** (2.0 / 3.0), np.inf)
    return float(min(np.nanmin(plain), np.nanmin(jerk)))


def _solve_bands(bands: FloatArray, right: FloatArray) -> FloatArray:
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
