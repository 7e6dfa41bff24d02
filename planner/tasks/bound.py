"""A lower bound on the duration of tasks in any order, from spanning trees (Held and Karp 1970)."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray
from planner.tasks.costs import Costs

ROUNDS = 200
"""The number of spanning trees, with other weights of the tasks each time."""

PATIENCE = 15
"""The number of trees without a better bound after which the steps of the weights are halved."""


def least_duration(costs: Costs, total: float) -> float:
    """Return a lower bound, s, on the estimated durations of all orders and states.

    An order is a spanning tree of the tasks in which start and end have one neighbour, and every other task two. A tree
    of least weight is no longer, whatever weights the tasks have beside their distances. The bound neglects rules, and
    that a task begins and ends in one state.

    Args:
        costs: The durations, and the states; the first task is the start, the last the end.
        total: The estimated duration of a known order, s, which sets the size of steps.
    """
    states = costs.states
    inner = slice(1, costs.end + 1)
    own = sum(float(costs.durations[there].min()) for there in states.of_tasks[inner])
    own += float(costs.least_arrivals[inner].sum())
    distances = costs.least_between
    degrees = np.full(len(distances), 2.0)
    degrees[[0, -1]] = 1.0
    weights, best, size, in_vain = np.zeros(len(distances)), 0.0, 2.0, 0
    for _ in range(ROUNDS):
        length, neighbours = _spanning_tree(distances + weights[:, None] + weights)
        bound = length - float(weights @ degrees)
        in_vain = 0 if bound > best else in_vain + 1
        best = max(best, bound)
        away = neighbours - degrees
        if not away.any():
            break  # the tree is an order
        if in_vain >= PATIENCE:
            size, in_vain = size / 2.0, 0
        weights = weights + size * max(total - own - bound, 0.0) / float(away @ away) * away
    return own + best


def _spanning_tree(distances: FloatArray) -> tuple[float, FloatArray]:
    """Return the length of a shortest spanning tree, and the number of neighbours (nodes,) of each node (Prim 1957)."""
    count = len(distances)
    neighbours = np.zeros(count)
    nearest, origin = distances[0].copy(), np.zeros(count, dtype=int)
    nearest[0], outside, length = np.inf, np.full(count, 0.0), 0.0
    outside[0] = np.inf
    for _ in range(count - 1):
        node = int((nearest + outside).argmin())
        length += float(nearest[node])
        neighbours[[node, origin[node]]] += 1.0
        outside[node] = np.inf
        closer = distances[node] < nearest
        nearest[closer], origin[closer] = distances[node][closer], node
    return length, neighbours
