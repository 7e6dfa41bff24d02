"""Shorter paths, proved free."""

from __future__ import annotations

import numpy as np

from planner.free_motion.edges import FreeEdges
from planner.spatial import FloatArray

MOST_CUTS = 100
"""The most cuts that are tried on a path."""

FRUITLESS_CUTS = 20
"""The number of cuts in a row without a gain after which a path counts as short."""

LEAST_CUT_GAIN = 0.01
"""The smallest relative gain of a cut that is worth a proof."""

LEAST_LEG = 0.05
"""The length of a leg, rad or m, below which a waypoint is omitted if the path without it is free.

Two turns within so short a leg cost time.
"""


ATTEMPTS = 3
"""Number of attempts to shorten a path, each with a finer check, before the path stays unchanged."""


def lengths(positions: FloatArray) -> FloatArray:
    """Compute the lengths (legs,) between joint positions (legs + 1, joints); a metre counts as a radian."""
    found: FloatArray = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return found


def shortened(edges: FreeEdges, positions: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Shorten a path between fixed ends.

    Args:
        edges: Proves the motions; nothing is tried once its budget is spent.
        positions: (positions, joints), rad or m, proved free between neighbours.
        rng: Source of the random points.

    Returns:
        (fewer or more positions, joints), proved free between neighbours.
    """
    for _ in range(ATTEMPTS):
        shorter = cut_short(edges, positions, rng, FRUITLESS_CUTS)
        if edges.first_unproved(shorter) is None:
            return shorter
    return positions


def cut_short(edges: FreeEdges, positions: FloatArray, rng: np.random.Generator, most_fruitless: int) -> FloatArray:
    """Go from corner to corner first, then between random points of a path, where that seems free; nothing is proved.

    Args:
        edges: Checks the motions.
        positions: (positions, joints), rad or m.
        rng: Source of the random points.
        most_fruitless: The number of cuts in a row without a gain after which the path counts as short.
    """
    positions = _without_detours(edges, positions)
    fruitless = 0
    for _ in range(MOST_CUTS):
        if len(positions) < 3 or fruitless == most_fruitless or not edges.has_budget:
            break
        cut = _cut(edges, positions, *np.sort(rng.uniform(size=2)).tolist())
        fruitless = fruitless + 1 if cut is None else 0
        positions = positions if cut is None else cut
    return _without_short_legs(edges, positions)


def _without_detours(edges: FreeEdges, positions: FloatArray) -> FloatArray:
    """Go from each corner to the last one that a free motion leads to."""
    kept, k = [0], 0
    while k < len(positions) - 1:
        ahead = range(len(positions) - 1, k + 1, -1)
        k = next((j for j in ahead if edges.has_budget and edges.seems_free(positions[k], positions[j])), k + 1)
        kept.append(k)
    return positions[kept]


def _cut(edges: FreeEdges, positions: FloatArray, first: float, second: float) -> FloatArray | None:
    """Join two points of a path, given as fractions of its length; None: no gain, or not free."""
    legs = lengths(positions)
    passed = np.append(0.0, np.cumsum(legs))
    where = np.array([first, second]) * passed[-1]
    i, j = np.clip(np.searchsorted(passed, where, side="right") - 1, 0, len(legs) - 1).tolist()
    if i == j:
        return None
    shares = (where - passed[[i, j]]) / legs[[i, j]]
    start, end = positions[[i, j]] + (positions[[i + 1, j + 1]] - positions[[i, j]]) * shares[:, None]
    path = edges.path_between(start, end, (1.0 - LEAST_CUT_GAIN) * (where[1] - where[0]))
    return None if path is None else np.concatenate([positions[: i + 1], path, positions[j + 1 :]])


def _without_short_legs(edges: FreeEdges, positions: FloatArray) -> FloatArray:
    """Remove corners that almost equal their neighbours."""
    kept, k = positions, 1
    while k < len(kept) - 1:
        is_short = (
            np.linalg.norm(kept[k] - kept[k - 1]) < LEAST_LEG or np.linalg.norm(kept[k + 1] - kept[k]) < LEAST_LEG
        )
        if is_short and edges.seems_free(kept[k - 1], kept[k + 1]):
            kept = np.delete(kept, k, axis=0)
        else:
            k += 1
    return kept
