"""The choice of waits in the coordination diagram, so that robots on fixed paths end as early as possible.

In one step of the clock a robot moves through one cell of its axis, or it waits where it rests. For two robots the
search over both axes is complete: no other waits at rests end earlier on these cells. Of three and more, each robot in
an order of priority waits for those before it, and the best order counts. A meeting of two robots is a node of their
diagram through which the path passes. In an order of priority it has a time before which no robot goes on, which is
raised until all arrive by then.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from math import inf
from time import monotonic
from typing import NamedTuple

import numpy as np

from planner.cells.diagram import Axis, Diagram
from planner.cells.meetings import Meeting

UNREACHED = np.iinfo(np.int64).max // 2
"""The number of steps to an entry that no path reaches."""

MOST_RAISED_MEETINGS = 10
"""The largest number of times that the times of meetings are raised in one order of priority."""

Waits = tuple[np.ndarray, ...]
"""For each robot the number (rests,) of steps that it waits at each of its rests, besides the end of cells."""


class Blocked(NamedTuple):
    """The blocked moves of a diagram; index i of an axis stands between its cells i - 1 and i.

    Attributes:
        both: (rows, columns): both move.
        first: (rows, columns + 1): the first moves while the second waits at an index; true where it cannot wait.
        second: (rows + 1, columns): the second moves while the first waits.
    """

    both: np.ndarray
    first: np.ndarray
    second: np.ndarray


def moves_of(diagram: Diagram, first: Axis, second: Axis, widening: int) -> Blocked:
    """Return the blocked moves of two robots, whose skew is at most a number of cells."""
    rows, columns = diagram.cells.shape
    alone = np.ones((rows, columns + 1), dtype=bool)
    alone[:, second.nodes] = _widened(diagram.second_rests, widening, 0)
    other = np.ones((rows + 1, columns), dtype=bool)
    other[first.nodes] = _widened(diagram.first_rests, widening, 1)
    both = _widened(diagram.cells, widening, 0) | _widened(diagram.cells, widening, 1)
    return Blocked(both, alone, other)


def through(moves: Blocked, node: tuple[int, int]) -> Blocked:
    """Return the blocked moves where paths pass through a node (row, column)."""
    rows, columns = (np.arange(count) for count in moves.both.shape)
    row_ends, column_ends = np.arange(len(rows) + 1)[:, None], np.arange(len(columns) + 1)
    beyond, right = (rows >= node[0])[:, None], columns >= node[1]
    alone = np.where(beyond, column_ends < node[1], column_ends > node[1])
    other = np.where(right, row_ends < node[0], row_ends > node[0])
    return Blocked(moves.both | (beyond != right), moves.first | alone, moves.second | other)


def _widened(blocked: np.ndarray, cells: int, axis: int) -> np.ndarray:
    """Return entries with their neighbours along an axis, up to a number of cells away."""
    result, along = blocked.copy(), np.moveaxis(blocked, axis, 0)
    out = np.moveaxis(result, axis, 0)
    for k in range(1, min(cells, len(along)) + 1):
        out[k:] |= along[:-k]
        out[:-k] |= along[k:]
    return result


def shortest_waits(moves: Blocked) -> tuple[np.ndarray, np.ndarray] | None:
    """Find the path of fewest steps from the start of both robots to the end of both.

    Returns:
        Index of each robot after each step, from 0 on, both (steps + 1,); None: no path exists.
    """
    rows, columns = moves.both.shape
    steps = np.full((rows + 1, columns + 1), UNREACHED)
    steps[0, 0] = 0
    for i in range(rows + 1):
        if i:
            reached = np.where(moves.both[i - 1], UNREACHED, steps[i - 1, :-1] + 1)
            steps[i, 1:] = np.minimum(steps[i, 1:], reached)
            steps[i] = np.minimum(steps[i], np.where(moves.first[i - 1], UNREACHED, steps[i - 1] + 1))
        if not moves.second[i].all():
            for j in np.flatnonzero(~moves.second[i]).tolist():
                steps[i, j + 1] = min(steps[i, j + 1], steps[i, j] + 1)
    if steps[rows, columns] >= UNREACHED:
        return None
    i, j, path = rows, columns, [(rows, columns)]
    while i or j:
        before = steps[i, j] - 1
        if i and j and not moves.both[i - 1, j - 1] and steps[i - 1, j - 1] == before:
            i, j = i - 1, j - 1
        elif i and not moves.first[i - 1, j] and steps[i - 1, j] == before:
            i -= 1
        else:
            j -= 1
        path.append((i, j))
    first, second = np.array(path[::-1]).T
    return first, second


def coordinated(
    axes: tuple[Axis, ...],
    diagrams: Mapping[tuple[int, int], Diagram],
    widening: int,
    meetings: Sequence[Meeting] = (),
    end: float = inf,
) -> Waits | None:
    """Find waits with which robots end as early as possible; None: the search finds none.

    Args:
        axes: The axis of each robot.
        diagrams: The diagram of each pair of robots, the lower number first.
        widening: The largest skew, in cells.
        meetings: The meetings in the order of time, with numbers of rests.
        end: The end on the monotonic clock, s, after which no other order of priority is tried.
    """
    if len(axes) == 2:
        moves = moves_of(diagrams[0, 1], *axes, widening)
        for meeting in meetings:
            moves = through(moves, (int(axes[0].nodes[meeting.stops[0]]), int(axes[1].nodes[meeting.stops[1]])))
        path = shortest_waits(moves)
        return None if path is None else tuple(_waits(axis, own) for axis, own in zip(axes, path, strict=True))
    best: dict[int, np.ndarray] | None = None
    for order in permutations(range(len(axes))):
        if monotonic() > end:
            break
        found = _meeting(axes, diagrams, widening, order, meetings)
        if found is not None and (best is None or len(found[order[0]]) < len(best[order[0]])):
            best = found
    return None if best is None else tuple(_waits(axis, best[k]) for k, axis in enumerate(axes))


def _meeting(
    axes: tuple[Axis, ...],
    diagrams: Mapping[tuple[int, int], Diagram],
    widening: int,
    order: tuple[int, ...],
    meetings: Sequence[Meeting],
) -> dict[int, np.ndarray] | None:
    """Return the index of each robot after each step, in an order of priority, where robots meet."""
    nodes = [{k: int(axes[k].nodes[stop]) for k, stop in meeting.stops.items()} for meeting in meetings]
    times = [0] * len(nodes)
    for _ in range(MOST_RAISED_MEETINGS):
        gates = [[(at[k], time) for at, time in zip(nodes, times, strict=True) if k in at] for k in range(len(axes))]
        paths = _by_priority(axes, diagrams, widening, order, gates)
        if paths is None:
            return None
        arrivals = [max(int(np.searchsorted(paths[k], node)) for k, node in at.items()) for at in nodes]
        if all(arrival <= time for arrival, time in zip(arrivals, times, strict=True)):
            return paths
        times = [max(pair) for pair in zip(arrivals, times, strict=True)]
    return None


def _by_priority(
    axes: tuple[Axis, ...],
    diagrams: Mapping[tuple[int, int], Diagram],
    widening: int,
    order: tuple[int, ...],
    gates: Sequence[Sequence[tuple[int, int]]],
) -> dict[int, np.ndarray] | None:
    """Return the index of each robot after each step, where each waits for those before it in an order.

    Each robot has gates: an index, and the step before which it does not go on from there.
    """
    paths = {order[0]: _unhindered(len(axes[order[0]].cells), gates[order[0]])}
    latest = max((step for own in gates for _, step in own), default=0)
    paths[order[0]] = _padded(paths[order[0]], latest + 1 - len(paths[order[0]]))
    for robot in order[1:]:
        clock = len(paths[order[0]]) - 1
        columns = len(axes[robot].cells)
        both, alone = np.zeros((clock, columns), dtype=bool), np.ones((clock, columns + 1), dtype=bool)
        after = np.zeros(columns, dtype=bool)
        alone[:, axes[robot].nodes] = False
        for earlier, path in paths.items():
            pair = (earlier, robot) if earlier < robot else (robot, earlier)
            diagram = diagrams[pair] if earlier < robot else diagrams[pair].transposed()
            moves = moves_of(diagram, axes[earlier], axes[robot], widening)
            for step, (begin, end) in enumerate(zip(path[:-1].tolist(), path[1:].tolist(), strict=True)):
                if end > begin:
                    both[step] |= moves.both[begin]
                    alone[step] |= moves.first[begin]
                else:
                    both[step] |= moves.second[begin]
                    rest = int(np.searchsorted(axes[earlier].nodes, begin))
                    alone[step, axes[robot].nodes] |= diagram.both_rest[rest]
            after |= moves.second[len(axes[earlier].cells)]
        for node, step in gates[robot]:
            both[:step, node:] = True
            alone[:step, node + 1 :] = True
        last = np.ones((clock + 1, columns), dtype=bool)
        last[clock] = after
        path_of = shortest_waits(Blocked(both, alone, last))
        if path_of is None:
            return None
        longer = len(path_of[0]) - 1 - clock
        paths = {k: _padded(path, longer) for k, path in paths.items()}
        paths[robot] = path_of[1]
    return paths


def _unhindered(cells: int, gates: Sequence[tuple[int, int]]) -> np.ndarray:
    """Return the index after each step of a robot that waits at its gates alone."""
    path = np.arange(cells + 1)
    for node, step in gates:
        at = int(np.searchsorted(path, node))
        path = np.insert(path, at, np.full(max(0, step - at), node))
    return path


def _padded(path: np.ndarray, steps: int) -> np.ndarray:
    """Return a path (steps + 1,) that stays at its end for a number of steps, if it is positive."""
    return np.concatenate([path, np.full(max(0, steps), path[-1])])


def _waits(axis: Axis, path: np.ndarray) -> np.ndarray:
    """Count the steps (rests,) of a path (steps + 1,) in which a robot waits, except at its end."""
    stays = path[:-1][np.diff(path) == 0]
    waits = np.array([(stays == node).sum() for node in axis.nodes])
    waits[-1] = 0
    return waits
