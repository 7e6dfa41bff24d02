"""Free paths over a roadmap: start and goals are joined to its nodes; the shortest path is shortened and proved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.free_motion.edges import FreeEdges
from planner.free_motion.shortcuts import cut_short, shortened
from planner.roadmap import Roadmap
from planner.spatial import FloatArray

MOST_NEAREST = 12
"""Largest number of nearest nodes to which the motion from an end of a path is checked."""

MOST_JOINED = 2
"""Number of free motions from an end of a path to nodes, after which no more are checked."""

MOST_JOINED_GOALS = 4
"""Number of goals that are joined to a roadmap, the nearest to the start first."""

FRUITLESS_CUTS_ON_ROADMAP = 3
"""Number of cuts in a row without a gain after which a path counts as short: most paths over a roadmap are short."""

MOST_PROOFS = 6
"""Largest number of paths that are proved, each without the unproved motions of those before."""


class PathOnRoadmap(NamedTuple):
    """A path over the nodes of a roadmap.

    Attributes:
        positions: (positions, joints), rad or m, proved free between neighbours.
        goal: Number of the goal that it leads to.
    """

    positions: FloatArray
    goal: int


def find_path_on_roadmap(
    edges: FreeEdges,
    roadmap: Roadmap,
    start: FloatArray,
    goals: Sequence[FloatArray],
    within: tuple[FloatArray, FloatArray],
    rng: np.random.Generator,
) -> PathOnRoadmap | None:
    """Find a path over a roadmap, whose edges need not be free: the whole path is proved.

    Args:
        edges: Checks and proves the motions.
        roadmap: The roadmap.
        start: (joints,), rad or m.
        goals: Goals (joints,), the nearest first.
        within: The lowest and the highest joint positions (joints,) of the path.
        rng: Source of the random points at which the path is cut short.

    Returns:
        The path; None: the roadmap has none.
    """
    lower, upper = within
    nodes = roadmap.positions
    is_allowed: np.ndarray = np.asarray(((nodes >= lower) & (nodes <= upper)).all(axis=1))
    joined = [(0, node) for node in _joined(edges, nodes, is_allowed, start)]
    if not joined:
        return None
    for number, goal in enumerate(goals):
        joined += [(number + 1, node) for node in _joined(edges, nodes, is_allowed, goal)]
        if len({end for end, _ in joined}) > MOST_JOINED_GOALS:
            break
    rows = np.vstack([start, *goals, nodes])
    offset = 1 + len(goals)
    own = np.array([(end, node + offset) for end, node in joined])
    pairs = np.concatenate([own, roadmap.edges[is_allowed[roadmap.edges].all(axis=1)] + offset])
    for _ in range(MOST_PROOFS):
        path = _shortest(rows, pairs, len(goals))
        if path is None:
            return None
        shorter = cut_short(edges, rows[path], rng, FRUITLESS_CUTS_ON_ROADMAP)
        if edges.first_unproved(shorter) is None:
            return PathOnRoadmap(shorter, path[-1] - 1)
        failed = edges.first_unproved(rows[path])
        if failed is None:
            return PathOnRoadmap(shortened(edges, rows[path], rng), path[-1] - 1)
        pairs = pairs[(np.sort(pairs, axis=1) != sorted(path[failed : failed + 2])).any(axis=1)]
    return None


def _joined(edges: FreeEdges, nodes: FloatArray, is_allowed: np.ndarray, end: FloatArray) -> list[int]:
    """Return the nearest nodes to which the motion from an end (joints,) seems free."""
    distances = np.where(is_allowed, np.linalg.norm(nodes - end, axis=1), np.inf)
    found: list[int] = []
    for node in np.argsort(distances, kind="stable")[:MOST_NEAREST].tolist():
        if len(found) == MOST_JOINED or not edges.has_budget or not is_allowed[node]:
            break
        if edges.seems_free(nodes[node], end):
            found.append(node)
    return found


def _shortest(rows: FloatArray, pairs: np.ndarray, goals: int) -> list[int] | None:
    """Return the rows of the shortest path from row 0 to a goal, one of the next rows."""
    from scipy.sparse import csr_array  # here only: most processes never need it
    from scipy.sparse.csgraph import dijkstra

    lengths = np.linalg.norm(rows[pairs[:, 1]] - rows[pairs[:, 0]], axis=1)
    graph = csr_array((lengths, (pairs[:, 0], pairs[:, 1])), shape=(len(rows), len(rows)))
    distances, before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
    goal = 1 + int(np.argmin(distances[1 : 1 + goals]))
    if not np.isfinite(distances[goal]):
        return None
    path = [goal]
    while path[-1] != 0:
        path.append(int(before[path[-1]]))
    return path[::-1]
