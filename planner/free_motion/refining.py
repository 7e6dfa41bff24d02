"""Paths of lower cost, found by random changes of a given path."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.constraints.kept_poses import KeptPoses
from planner.free_motion.edges import FreeEdges
from planner.free_motion.shortcuts import lengths
from planner.spatial import FloatArray

LEAST_CHANGE_GAIN = 1e-3
"""The smallest relative gain of a change that is worth a check."""

MOVED = 0.5
"""The share of changes that move a corner."""

LEFT_OUT = 0.1
"""The share of changes that omit a corner."""

CUT = 0.2
"""The share of changes that cut a corner; the other changes cut a part of the path."""

LEAST_SHIFT = 0.01
"""Smallest standard deviation of the shift of a corner along a joint, rad or m."""

LARGEST_SHIFT = 0.6
"""Largest standard deviation of it, rad or m; small and large ones are equally likely."""

FEW_JOINTS = 0.3
"""The share of joints that move in a shift along some joints only."""

SOME_JOINTS_SHARE = 0.5
"""The share of shifts that move a corner along some joints only."""


class Change(NamedTuple):
    """A changed path.

    Attributes:
        positions: (positions, joints), rad or m: all of it.
        first: Index of the position where the change begins.
        last: The position at which it ends.
    """

    positions: FloatArray
    first: int
    last: int


def refined(
    edges: FreeEdges,
    positions: FloatArray,
    cost: Callable[[FloatArray], float],
    within: tuple[FloatArray, FloatArray],
    rng: np.random.Generator,
    tries: int,
) -> FloatArray:
    """Change a path while its cost falls and it seems free; its ends stay.

    Args:
        edges: Looks at the motions; nothing is tried once its budget is spent.
        positions: (positions, joints), rad or m.
        cost: The cost of a path.
        within: The lowest and the highest positions (joints,) of corners.
        rng: Source of the changes.
        tries: The number of changes that are tried.
    """
    least = cost(positions)
    for _ in range(tries):
        if len(positions) < 3 or not edges.has_budget:
            break
        change = _changed(positions, within, rng)
        if change is not None and edges.kept is not None:
            change = _projected(change, edges.kept)
        if change is None or (costs := cost(change.positions)) > (1.0 - LEAST_CHANGE_GAIN) * least:
            continue
        new = change.positions[change.first : change.last + 1]
        if all(edges.seems_free(*new[k : k + 2]) for k in range(len(new) - 1)):
            positions, least = change.positions, costs
    return positions


def _changed(positions: FloatArray, within: tuple[FloatArray, FloatArray], rng: np.random.Generator) -> Change | None:
    """Move, omit or cut a corner, or join two points of the path; None: they are on one leg."""
    corner, kind = int(rng.integers(1, len(positions) - 1)), rng.random()
    if kind < MOVED:
        return Change(_moved(positions, corner, within, rng), corner - 1, corner + 1)
    if kind < MOVED + LEFT_OUT:
        return Change(np.concatenate([positions[:corner], positions[corner + 1 :]]), corner - 1, corner)
    if kind < MOVED + LEFT_OUT + CUT:
        shares = rng.random((2, 1))
        ends = positions[corner] + shares * (positions[[corner - 1, corner + 1]] - positions[corner])
        return Change(np.concatenate([positions[:corner], ends, positions[corner + 1 :]]), corner, corner + 1)
    legs = lengths(positions)
    passed = np.append(0.0, np.cumsum(legs))
    where = np.sort(rng.uniform(size=2)) * passed[-1]
    i, j = np.clip(np.searchsorted(passed, where, side="right") - 1, 0, len(legs) - 1).tolist()
    if i == j:
        return None
    shares = ((where - passed[[i, j]]) / legs[[i, j]])[:, None]
    ends = positions[[i, j]] + shares * (positions[[i + 1, j + 1]] - positions[[i, j]])
    return Change(np.concatenate([positions[: i + 1], ends, positions[j + 1 :]]), i + 1, i + 2)


def _projected(change: Change, kept: KeptPoses) -> Change | None:
    """Move the inner positions of a change to the constraints on the tool; None: one does not arrive."""
    positions = change.positions.copy()
    for k in range(change.first + 1, change.last):
        projected = kept.projected(positions[k])
        if projected is None or not kept.is_within_limits(projected):
            return None
        positions[k] = projected
    return change._replace(positions=positions)


def _moved(
    positions: FloatArray, corner: int, within: tuple[FloatArray, FloatArray], rng: np.random.Generator
) -> FloatArray:
    """Move a corner along all joints or along some."""
    dof = positions.shape[1]
    size = LEAST_SHIFT * (LARGEST_SHIFT / LEAST_SHIFT) ** rng.random()
    step = size * rng.normal(size=dof)
    if rng.random() < SOME_JOINTS_SHARE:
        step[rng.random(dof) > FEW_JOINTS] = 0.0
    moved = positions.copy()
    moved[corner] = np.minimum(np.maximum(moved[corner] + step, within[0]), within[1])
    return moved
