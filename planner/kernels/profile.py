"""The fastest profile of the path velocity within linear limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kernels.library import call, doubles, indices

if TYPE_CHECKING:
    from planner.spatial import FloatArray

PARALLEL = 1e-10
"""Ratio to the largest coefficient of u on its interval below which a coefficient does not limit u."""


def fastest_profile(
    lengths: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, bounds: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Compute the fastest profile by a backward and a forward pass over limits a u + b x + c <= 0.

    x = s'^2 holds at the start of an interval, u = s'' is its mean there. The formulas are in `profile.hpp`.

    Args:
        lengths: (intervals,).
        a: (intervals, rows).
        b: (intervals, rows).
        c: (intervals, rows), negative: standing still keeps every limit.
        bounds: (intervals + 1,), the largest x at each gridpoint.
        rests: (intervals + 1,), where x is 0; both ends at least.

    Returns:
        The largest x (intervals + 1,) from which the rest can be braked in time, and the profile (intervals + 1,).
    """
    intervals, rows = a.shape
    given = doubles(lengths, intervals), *(doubles(part, intervals, rows) for part in (a, b, c))
    ends = doubles(bounds, intervals + 1), indices(rests, 2, intervals + 1)
    controllable, x = np.empty((2, intervals + 1))
    call("profile", intervals, rows, *given, *ends, PARALLEL, controllable, x)
    return controllable, x
