"""L-BFGS: Nocedal and Wright, Numerical Optimization (2006), ch. 7.2."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.kinematics.poses import FloatArray

MEMORY, LEAST_GAIN = 8, 1e-4
"""Pairs of steps and changes of slope remembered; relative gain of a step at which the search ends."""

SHORTENINGS, SHORTER, SUFFICIENT = 6, 0.3, 1e-4
"""Trials of one step, by what each is shorter, and the share of the gain that the slope promises that is enough."""

LONGEST_STEP, FIRST_STEP = 1.0, 0.3
"""Of any variable."""


def lbfgs(cost: Callable[[FloatArray], tuple[float, FloatArray]], x: FloatArray, steps: int) -> FloatArray:
    """A point of low cost.

    Args:
        cost: And its slopes, of the shape of x; infinite where x is not allowed.
        x: To begin at.
        steps: The most there are.
    """
    value, slope = cost(x)
    pairs: list[tuple[FloatArray, FloatArray]] = []
    for _ in range(steps):
        step = -_times_inverse_hessian(pairs, slope)
        if not (slope * step).sum() < 0.0:
            break
        step /= max(LONGEST_STEP, np.abs(step).max())
        for shortening in range(SHORTENINGS):
            part = SHORTER**shortening
            there, slope_there = cost(x + part * step)
            if there <= value + SUFFICIENT * part * (slope * step).sum():
                break
        else:
            if not pairs:
                break
            pairs.clear()
            continue
        moved, bent = part * step, slope_there - slope
        if (moved * bent).sum() > 1e-12:
            pairs = [*pairs, (moved, bent)][-MEMORY:]
        gain = value - there
        x, value, slope = x + moved, there, slope_there
        if gain <= LEAST_GAIN * value:
            break
    return x


def _times_inverse_hessian(pairs: list[tuple[FloatArray, FloatArray]], slope: FloatArray) -> FloatArray:
    """The two loops of L-BFGS; without any pairs a short step."""
    if not pairs:
        short: FloatArray = FIRST_STEP * slope / max(np.abs(slope).max(), 1e-300)
        return short
    result, shares = slope.copy(), []
    for moved, bent in reversed(pairs):
        share = (moved * result).sum() / (moved * bent).sum()
        shares.append(share)
        result -= share * bent
    moved, bent = pairs[-1]
    result *= (moved * bent).sum() / (bent * bent).sum()
    for (moved, bent), share in zip(pairs, reversed(shares), strict=True):
        result += moved * (share - (bent * result).sum() / (moved * bent).sum())
    return result
