"""The search for peaks of sampled functions: the samples of each round, and the resulting bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

SEARCH_NUMBERS = 13
"""Numbers that say how accurate a search is: the size of the structure `Accuracy` of the kernels."""


def search_peaks(
    use: Callable[[np.ndarray, FloatArray], FloatArray],
    parts: np.ndarray,
    quantities: np.ndarray,
    groups: np.ndarray,
    above: FloatArray,
    accuracy: FloatArray,
    more_columns: int,
) -> tuple[FloatArray, np.ndarray, FloatArray, np.ndarray]:
    """Find the largest magnitude of each quantity over the pieces of each group, from samples.

    Args:
        use: Functions of piece (N,) and unit time (N,), (N, columns + more columns).
        parts: (pieces,), that a piece has.
        quantities: (columns,), index of the quantity that each function belongs to, from 0 on without gaps.
        groups: (pieces,), index of the group of each piece, from 0 on without gaps.
        above: (groups,), peaks up to this do not matter.
        accuracy: (`SEARCH_NUMBERS`,).
        more_columns: Number of columns that bound the effect of bends between samples.

    Returns:
        Magnitude, piece, unit time and column of the peaks, each (groups, quantities).

    Raises:
        TooManySamples: The peaks would take more samples than the accuracy says.
    """
    pieces, columns, width = len(parts), len(quantities), len(quantities) + more_columns
    shape = int(groups.max()) + 1, int(quantities[-1]) + 1
    given = (
        indices(parts, np.iinfo(np.int64).max, pieces),
        indices(groups, shape[0], pieces),
        indices(quantities, shape[1], columns),
        doubles(above, shape[0]),
    )
    state = np.zeros(2, dtype=np.int64)
    try:
        call("start_search", pieces, columns, width, *shape, doubles(accuracy, SEARCH_NUMBERS), *given, state)
        while count := int(state[1]):
            at, units = np.empty(count, dtype=np.int64), np.empty(count)
            call("wanted_samples", state, at, units)
            call("take_samples", state, doubles(use(at, units), count, width))
        magnitudes, at_units = np.empty((2, *shape))
        at_pieces, at_columns = np.empty((2, *shape), dtype=np.int64)
        call("found_peaks", state, magnitudes, at_pieces, at_units, at_columns)
    finally:
        call("end_search", state)
    return magnitudes, at_pieces, at_units, at_columns
