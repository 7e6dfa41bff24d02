"""The coordination diagram of two robots on fixed paths: the intervals of both that are proved free together.

Each robot has an axis: the nominal time of its trajectory, cut where it rests, and then into cells of one length. Its
rests are intervals of no length. An entry of the diagram is an interval of one robot and an interval of the other. It
is free where every pair of bodies keeps its margin at all joint positions of both intervals. Entries are decided in
blocks, which are cut in four where they are neither proved free nor proved blocked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import inf
from time import monotonic

import numpy as np

from planner.cells.movers import Mover, Phase
from planner.kernels.clearance import BLOCKED_BLOCK, FREE_BLOCK
from planner.scene.between import CheckerBetween
from planner.spatial import FloatArray

BLOCKS_AT_ONCE = 512
"""The number of blocks that are decided together: enough for array operations."""

LEAST_BLOCKED = 4
"""The least number of rows and columns of a block that is tried to be proved blocked: smaller ones are cut sooner."""

ROUNDED_CELL = 1e-6
"""The share of a cell by which a motion may be longer than a whole number of cells."""


@dataclass(frozen=True, eq=False)
class Axis:
    """The nominal time of a robot in cells, from rest to rest.

    Attributes:
        mover: The robot on its trajectory without waits.
        step: Length of the cells, s; the last one before a rest may be shorter.
        rests: (rests,), s, ascending: when the robot rests, from the start to the end.
    """

    mover: Mover
    step: float
    rests: FloatArray

    @cached_property
    def counts(self) -> np.ndarray:
        """The number (rests - 1,) of cells from each rest to the next one."""
        cells = np.ceil(np.diff(self.rests) / self.step - ROUNDED_CELL)
        return np.asarray(np.maximum(cells, 1), dtype=int)

    @cached_property
    def nodes(self) -> np.ndarray:
        """The number (rests,) of cells before each rest."""
        return np.concatenate([[0], np.cumsum(self.counts)])

    @cached_property
    def cells(self) -> FloatArray:
        """The cells (cells, 2), s."""
        starts = [rest + self.step * np.arange(n) for rest, n in zip(self.rests, self.counts, strict=False)]
        begin = np.concatenate(starts) if starts else np.empty(0)
        ends = np.minimum(begin + self.step, np.repeat(self.rests[1:], self.counts))
        ends[self.nodes[1:] - 1] = self.rests[1:]
        return np.column_stack([begin, ends])

    @property
    def points(self) -> FloatArray:
        """The rests as intervals (rests, 2), s."""
        return np.column_stack([self.rests, self.rests])


@dataclass(frozen=True, eq=False)
class Diagram:
    """The blocked entries of two robots.

    Attributes:
        cells: (cells, cells): whether a cell of the first robot and a cell of the second are not proved free together.
        first_rests: (rests, cells): the same where the first robot rests.
        second_rests: (cells, rests): the same where the second robot rests.
        both_rest: (rests, rests): the same where both rest.
    """

    cells: np.ndarray
    first_rests: np.ndarray
    second_rests: np.ndarray
    both_rest: np.ndarray

    @classmethod
    def of(cls, first: Axis, second: Axis, margin: float, end: float = inf) -> Diagram:
        """Decide the entries of two robots.

        Args:
            first: The axis of one robot.
            second: The axis of the other robot.
            margin: The least distance of both, m.
            end: The end on the monotonic clock, s, after which no entry is proved free.
        """
        both = first.cells, first.points, first.cells, first.points
        other = second.cells, second.cells, second.points, second.points
        pairs = zip(both, other, strict=True)
        return cls(*(_blocked(first.mover, second.mover, margin, end, *intervals) for intervals in pairs))

    def transposed(self) -> Diagram:
        """Return the diagram with the robots exchanged."""
        return Diagram(self.cells.T, self.second_rests.T, self.first_rests.T, self.both_rest.T)


def _blocked(
    first: Mover, second: Mover, margin: float, end: float, rows: FloatArray, columns: FloatArray
) -> np.ndarray:
    """Return which intervals (N, 2) and (M, 2) of two movers are not proved free together: (N, M)."""
    blocked = np.zeros((len(rows), len(columns)), dtype=bool)
    for one in first.phases:
        for other in second.phases:
            meets = [
                np.flatnonzero((intervals[:, 1] >= phase.begin) & (intervals[:, 0] <= phase.end))
                for phase, intervals in ((one, rows), (other, columns))
            ]
            if not all(len(those) for those in meets):
                continue
            margins = margin + one.displacements[:, None] + other.displacements
            checker = CheckerBetween(one.bodies, other.bodies, margins)
            block = [(int(those[0]), int(those[-1]) + 1) for those in meets]
            for a, b in _not_free(checker, one, other, rows, columns, (*block[0], *block[1]), end):
                blocked[a, b] = True
    return blocked


def _not_free(
    checker: CheckerBetween,
    first: Phase,
    second: Phase,
    rows: FloatArray,
    columns: FloatArray,
    whole: tuple[int, int, int, int],
    end: float,
) -> Iterator[tuple[slice, slice]]:
    """Yield blocks of entries that are not proved free until an end; ranges of rows and of columns."""
    waiting = [whole]
    while waiting:
        if monotonic() > end:
            yield from ((slice(a, b), slice(c, d)) for a, b, c, d in waiting)
            return
        now, waiting = waiting[:BLOCKS_AT_ONCE], waiting[BLOCKS_AT_ONCE:]
        ranges = np.array(now)
        middles, reach = zip(
            *(
                phase.within(intervals[ranges[:, k], 0], intervals[ranges[:, k + 1] - 1, 1])
                for phase, intervals, k in ((first, rows, 0), (second, columns, 2))
            ),
            strict=True,
        )
        is_large = np.minimum(ranges[:, 1] - ranges[:, 0], ranges[:, 3] - ranges[:, 2]) >= LEAST_BLOCKED
        decisions = checker.distances.decide(np.hstack(middles), np.hstack(reach), is_large)
        for k in np.flatnonzero(decisions != FREE_BLOCK).tolist():
            a, b, c, d = now[k]
            if decisions[k] == BLOCKED_BLOCK or (b - a == 1 and d - c == 1):
                yield slice(a, b), slice(c, d)
                continue
            halves = [(a, (a + b) // 2), ((a + b) // 2, b)] if b - a > 1 else [(a, b)]
            others = [(c, (c + d) // 2), ((c + d) // 2, d)] if d - c > 1 else [(c, d)]
            waiting += [(*half, *other) for half in halves for other in others]
