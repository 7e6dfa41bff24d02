"""The coordination diagram of two robots on fixed paths: the intervals of both that are proved free together.

Each robot has an axis: the nominal time of its trajectory, cut where it rests, and then into cells of one length. Its
rests are intervals of no length. An entry of the diagram is an interval of one robot and an interval of the other. It
is free where every pair of bodies keeps its margin at all joint positions of both intervals. Entries are decided in
blocks, which are cut in four where they are neither proved free nor proved blocked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from planner.cells.movers import Mover, Rules
from planner.scene.between import CheckerBetween
from planner.scene.blocks import not_free
from planner.spatial import FloatArray

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
    def of(
        cls, first: Axis, second: Axis, rules: Rules, shares: Sequence[float] = (1.0,), end: float = inf
    ) -> list[Diagram]:
        """Decide the entries of two robots.

        Args:
            first: The axis of one robot.
            second: The axis of the other robot.
            rules: What both must keep; the skew is left out.
            shares: An entry is not blocked where it is free for this share of the excursions from its middle. Only for
                1 that is a proof. The first is 1, the others descend.
            end: The end on the monotonic clock, s, after which no entry is proved free.

        Returns:
            A diagram for each share.
        """
        both = first.cells, first.points, first.cells, first.points
        other = second.cells, second.cells, second.points, second.points
        tables = [
            _blocked(first.mover, second.mover, rules, shares, end, *intervals)
            for intervals in zip(both, other, strict=True)
        ]
        return [cls(*of_share) for of_share in zip(*tables, strict=True)]

    def transposed(self) -> Diagram:
        """Return the diagram with the robots exchanged."""
        return Diagram(self.cells.T, self.second_rests.T, self.first_rests.T, self.both_rest.T)


def _blocked(
    first: Mover,
    second: Mover,
    rules: Rules,
    shares: Sequence[float],
    end: float,
    rows: FloatArray,
    columns: FloatArray,
) -> list[np.ndarray]:
    """Return which intervals (N, 2) and (M, 2) of two movers are not free together: (N, M) for each share."""
    blocked = [np.zeros((len(rows), len(columns)), dtype=bool) for _ in shares]
    for one in first.phases:
        for other in second.phases:
            meets = [
                np.flatnonzero((intervals[:, 1] >= phase.begin) & (intervals[:, 0] <= phase.end))
                for phase, intervals in ((one, rows), (other, columns))
            ]
            if not all(len(those) for those in meets):
                continue
            checker = CheckerBetween(one.bodies, other.bodies, rules.margins((first, second), (one, other)))
            block = [(int(those[0]), int(those[-1]) + 1) for those in meets]
            whole = *block[0], *block[1]
            for a, b, free in not_free(checker, one, other, rows, columns, whole, end, shares=shares[1:]):
                for table, share in zip(blocked, shares, strict=True):
                    table[a, b] |= free < share
    return blocked
