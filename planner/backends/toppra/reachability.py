"""The fastest law along curves, by reachability analysis.

With x = s'^2 and u = s'' every limit is linear at a place, |a u + b x + c| <= 1, and where u is constant over an
interval of length d, x grows by 2 d u. A backward pass finds the largest x at each breakpoint from which the rest can
be braked in time, a forward pass then accelerates as much as limits and that allow: Pham and Pham, "A New Approach to
Time-Optimal Path Parameterization Based on Reachability Analysis", IEEE Transactions on Robotics 34 (3), 2018.

Standing still keeps every limit, so what can be braked is all from 0 up to that x. Then both passes are chains of steps
y -> min_k (r_k + p_k y): a limit bounds what is reached at one end of an interval by a line in what there is at the
other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

PARALLEL = 1e-10
"""A limit whose coefficient of u is smaller than the largest on its interval by this factor does not limit u."""

ROUNDING, MOST_STEPS = 1e-12, 60
"""Relative excess over a line that is none; steps of Newton's method, which takes a few."""


def fastest_law(
    lengths: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray], most: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """The largest squares of the speed, x = s'^2, at the breakpoints, and the constant u = s'' between them.

    Args:
        lengths: (intervals,).
        limits: a, b and c, each (intervals, limits): |a u + b x + c| <= 1 with x at an interval's start; |c| < 1.
        most: (intervals + 1,), of x.
        rests: (intervals + 1,): where x is 0; both ends at least.

    Returns:
        x (intervals + 1,) and u (intervals,).
    """
    slopes, b, c = limits
    sign = np.where(slopes < 0.0, -1.0, 1.0)
    a, b, c = np.abs(slopes), sign * b, sign * c
    limits_u = a > PARALLEL * a.max(axis=1, keepdims=True)
    divisor = np.where(limits_u, a, 1.0)
    # u is between -reach - shift - tilt x and reach - shift - tilt x.
    reach = np.where(limits_u, 1.0 / divisor, np.inf)
    shift, tilt = np.where(limits_u, c / divisor, 0.0), np.where(limits_u, b / divisor, 0.0)
    with np.errstate(divide="ignore", over="ignore"):
        without_u = np.where(limits_u, np.inf, (1.0 - np.sign(b) * c) / np.abs(b)).min(axis=1)
    double = 2.0 * lengths[:, None]
    widest = np.where(rests, 0.0, most)
    widest[:-1] = _widest(np.minimum(widest[:-1], without_u), 1.0 / double, reach, shift, tilt)
    per_x = 1.0 - double * tilt
    brakes = per_x > 0.0
    per_next = 1.0 / np.where(brakes, per_x, 1.0)
    from_rest = np.where(brakes, double * (reach + shift) * per_next, np.inf)
    best = _chain(from_rest[::-1], per_next[::-1], widest[::-1])[::-1]
    x = _chain(double * (reach - shift), per_x, best)
    return x, np.diff(x) / double[:, 0]


def _widest(
    most: FloatArray, stopping: FloatArray, reach: FloatArray, shift: FloatArray, tilt: FloatArray
) -> FloatArray:
    """(intervals,): the largest x, at most `most`, at which some u keeps all limits and x positive (u >= -stopping x).

    What is between the bounds on u is concave in x and positive at 0: Newton's method from above ends at its root.
    """
    x = most.copy()
    rows = np.arange(len(x))
    for _ in range(MOST_STEPS):
        middle = shift[rows] + tilt[rows] * x[rows, None]
        highest, lowest = reach[rows] - middle, -reach[rows] - middle
        above, below = highest.argmin(axis=1), lowest.argmax(axis=1)
        each = np.arange(len(rows))
        high, low = highest[each, above], lowest[each, below]
        falls = tilt[rows, above]
        to_rest = -stopping[rows, 0] * x[rows]
        rises = np.where(low > to_rest, -tilt[rows, below], -stopping[rows, 0])
        gap = high - np.maximum(low, to_rest)
        narrow = gap < -ROUNDING * (reach[rows, above] + np.abs(high) + np.abs(low))
        if not narrow.any():
            break
        x[rows[narrow]] = np.maximum(x[rows] + gap / np.where(narrow, falls + rises, 1.0), 0.0)[narrow]
        rows = rows[narrow]
    return x


def _chain(start: FloatArray, slope: FloatArray, most: FloatArray) -> FloatArray:
    """The largest y (steps + 1,), at most `most`, with y[i + 1] <= start[i] + slope[i] y[i] for lines (steps, lines).

    By Howard's policy iteration: where the result breaks a line, the step goes by the lowest one there instead, and
    what comes after it follows, as far as that changes it. What is right stays right, and usually a few rounds do.
    """
    result, steps = most.copy(), np.arange(len(start))
    bounds, chain = most.tolist(), most.tolist()
    while True:
        values = start + slope * result[:-1, None]
        lowest = values.argmin(axis=1)
        broken = result[1:] > np.maximum(values[steps, lowest], 0.0) * (1.0 + ROUNDING)
        if not broken.any():
            return result
        starts, slopes = start[steps, lowest].tolist(), slope[steps, lowest].tolist()
        done = 0
        for step in np.flatnonzero(broken).tolist():
            if step < done:
                continue
            y = chain[step]
            for done in range(step + 1, len(chain)):
                y = starts[done - 1] + slopes[done - 1] * y
                if y > bounds[done]:
                    y = bounds[done]
                elif y < 0.0:
                    y = 0.0
                if y == chain[done]:
                    break
                chain[done] = y
        result = np.array(chain)
