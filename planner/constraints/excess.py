"""The paces of a motion at which a quantity first exceeds its limit, where the quantity is a cubic of the pace."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray

FASTEST = 1e6
"""Multiple of the pace at which one term alone reaches the limit, up to which an excess is looked for."""

EXCESS_STEPS = 80
"""Steps of Newton's method and of bisection, at most; 8 are common."""

PACE_KNOWN_TO = 1e-13
"""Relative length of a step below which the pace is known."""


def first_excess(coefficients: FloatArray, limits: FloatArray) -> FloatArray:
    """Return the paces (...) up to which the magnitude of a cubic keeps its limit; infinite: at all of them.

    Between its extrema the cubic is monotone. So the first of these intervals with a larger value at its end has one
    solution, and Newton's method within a bracket finds it.

    Args:
        coefficients: (4, ...), ascending powers of the pace.
        limits: (...), not negative, infinite: none.
    """
    _, linear, square, cube = coefficients
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = np.min([(limits / np.abs(c)) ** (1.0 / k) for k, c in enumerate((linear, square, cube), 1)], axis=0)
        root = np.sqrt(np.maximum(square**2 - 3.0 * cube * linear, 0.0))
        away = -(square + np.copysign(root, square))
        extrema = np.stack([away / (3.0 * cube), linear / away])
        is_limited = np.isfinite(scale)
        last = np.where(is_limited, FASTEST * scale, 1.0)
        extrema = np.where((extrema > 0.0) & (extrema < last), extrema, last)
        ends = np.stack([np.zeros_like(last), *np.sort(extrema, axis=0), last])
        above = np.abs(_values(coefficients, ends)) > limits
    exceeds = is_limited & above.any(axis=0)
    at = np.maximum(above.argmax(axis=0), 1)
    low, high = (np.take_along_axis(ends, k[None], axis=0)[0] for k in (at - 1, at))
    level = np.copysign(np.where(exceeds, limits, 1.0), _values(coefficients, high))
    x = np.clip(np.where(is_limited, scale, 0.0), low, high)
    for _ in range(EXCESS_STEPS if exceeds.any() else 0):
        excess = _values(coefficients, x) - level
        is_above = excess * level > 0.0
        low, high = np.where(is_above, low, x), np.where(is_above, x, high)
        slope = linear + x * (2.0 * square + x * 3.0 * cube)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = x - excess / slope
        following = np.where((step > low) & (step < high), step, (low + high) / 2.0)
        done = np.abs(following - x) <= PACE_KNOWN_TO * x
        x = following
        if (done | ~exceeds).all():
            break
    return np.where(above[0], 0.0, np.where(exceeds, x, np.inf))


def _values(coefficients: FloatArray, x: FloatArray) -> FloatArray:
    """Return the values of cubics at x."""
    constant, linear, square, cube = coefficients
    values: FloatArray = constant + x * (linear + x * (square + x * cube))
    return values
