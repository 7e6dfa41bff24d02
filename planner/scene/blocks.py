"""Intervals of two motions that are proved free together: entries of a table, decided in blocks.

A block is cut in four where it is neither proved free nor proved blocked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from time import monotonic

import numpy as np

from planner.kernels.clearance import BLOCKED_BLOCK, FREE_BLOCK
from planner.scene.between import CheckerBetween
from planner.scene.phases import Phase
from planner.spatial import FloatArray

BLOCKS_AT_ONCE = 512
"""The number of blocks that are decided together: enough for array operations."""

LEAST_BLOCKED = 4
"""The least number of rows and columns of a block that is tried to be proved blocked: smaller ones are cut sooner."""

BLOCKED_SHARE = -1.0
"""The share of a block that is free for no share of its excursions."""


def not_free(
    checker: CheckerBetween,
    first: Phase,
    second: Phase,
    rows: FloatArray,
    columns: FloatArray,
    whole: tuple[int, int, int, int],
    end: float = inf,
    *,
    shares: Sequence[float] = (),
) -> Iterator[tuple[slice, slice, float]]:
    """Yield the blocks of entries that are not proved free: ranges of rows and of columns, and a share.

    The share of an entry is the largest share of the excursions from the middles of its intervals for which both
    motions are free. It is `BLOCKED_SHARE` of other blocks.

    Args:
        checker: The pairs of both motions.
        first: The bodies and the motion of the rows.
        second: The bodies and the motion of the columns.
        rows: (N, 2), the intervals of the first motion, s.
        columns: (M, 2), the intervals of the second motion, s.
        whole: The range of rows and the range of columns that are decided, from and to.
        end: The end on the monotonic clock, s, after which no entry is proved free.
        shares: The shares that are tried, descending, below 1; 0: both motions in the middles of their intervals.
    """
    waiting = [whole]
    while waiting:
        if monotonic() > end:
            yield from ((slice(a, b), slice(c, d), BLOCKED_SHARE) for a, b, c, d in waiting)
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
        found = np.full(len(now), BLOCKED_SHARE)
        single = (np.diff(ranges)[:, ::2] == 1).all(axis=1) & (decisions != FREE_BLOCK)
        for share in shares:
            left = np.flatnonzero(single & (found == BLOCKED_SHARE))
            near = np.hstack(middles)[left], share * np.hstack(reach)[left]
            found[left[checker.distances.decide(*near, is_large[left]) == FREE_BLOCK]] = share
        for k in np.flatnonzero(decisions != FREE_BLOCK).tolist():
            a, b, c, d = now[k]
            if decisions[k] == BLOCKED_BLOCK or (b - a == 1 and d - c == 1):
                yield slice(a, b), slice(c, d), float(found[k])
                continue
            halves = [(a, (a + b) // 2), ((a + b) // 2, b)] if b - a > 1 else [(a, b)]
            others = [(c, (c + d) // 2), ((c + d) // 2, d)] if d - c > 1 else [(c, d)]
            waiting += [(*half, *other) for half in halves for other in others]
