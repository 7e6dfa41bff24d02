"""Single postures, and straight ways between two of them: what planners ask many times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.polynomials import PiecewisePolynomial
from planner.scene.checker import CONTACT_TOLERANCE, Items
from planner.scene.continuous import DEFAULT_BUDGET, clearances

if TYPE_CHECKING:
    from planner.scene.checker import CollisionChecker
    from planner.scene.continuous import Budget
    from planner.spatial import FloatArray


def is_free(checker: CollisionChecker, positions: FloatArray) -> np.ndarray:
    """Tell which postures are proved to keep every margin.

    Args:
        checker: The robot and what is around it.
        positions: (N, joints), rad or m.

    Returns:
        (N,), bool.
    """
    free = np.ones(len(positions), dtype=bool)
    postures = checker.bodies.at(positions)
    own = checker.own_items(len(positions))
    still = np.zeros((len(positions), len(checker.bodies.pieces)))
    near, _ = checker.near_items(postures, still, checker.margins - CONTACT_TOLERANCE)
    items = Items(np.concatenate([own.rows, near.rows]), np.concatenate([own.pairs, near.pairs]))
    wanted = checker.margins_of(items.pairs) - CONTACT_TOLERANCE
    low = checker.bounds(postures, items, wanted)
    for item in np.argsort(low, kind="stable").tolist():
        if low[item] >= wanted[item]:
            continue
        row = int(items.rows[item])
        if free[row]:
            free[row] = checker.separate(postures, row, int(items.pairs[item])).proved >= wanted[item]
    return free


def is_edge_free(
    checker: CollisionChecker, start: FloatArray, goal: FloatArray, budget: Budget = DEFAULT_BUDGET
) -> bool:
    """Tell whether the straight way between two joint positions (joints,) is proved to keep every margin."""
    return clearances(checker, edge(start, goal), budget=budget).is_proved


def edge(start: FloatArray, goal: FloatArray) -> PiecewisePolynomial:
    """Return the straight way between two joint positions (joints,), of length 1."""
    return PiecewisePolynomial(np.ones(1), np.stack([start, goal - start], axis=-1)[None])
