"""A proof that there is no way: what the first joints alone move cannot pass between the objects.

The ranges of the first joints are cut into cells. A cell is blocked where a ball inside of a link is too near to an
object at its middle by more than these joints can move the center of the ball within the cell: then every posture in it
collides, whatever the other joints do. Cells that are blocked in part are cut again. If what is left does not lead from
the start to a goal, no motion does (an approximate cell decomposition, Latombe, Robot Motion Planning, 1991, chapter 6,
of fewer joints than there are).
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.free_motion.blocked_cells import NO_OBJECT, BlockedCells

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.spatial import FloatArray

ATTEMPTS = ((1, 8), (2, 3))
"""How many joints are looked at, one after the other, and how often their cells are halved: a link that grazes an
object as the first joint turns is held up by it within a few mrad. A third joint would take minutes."""

WIDTH = 0.1
"""How wide the cells are to begin with, rad or m."""

FEW = 20.0
"""Number of objects up to which as many cells are looked at as may be; among more of them fewer are, since each takes
longer: so a search that fails in a full scene ends in as much time as one in an empty one."""

MOST_CELLS = 2**22
"""The most cells that there may be in the end, some twenty bytes each: a robot that goes many metres has more."""

ROUNDED = 1e-6
"""The share of a cell that may be beyond the last one: what it moves is less than what counts as contact."""

TURN = 2.0 * np.pi
"""A full turn, rad, after which everything is as it was."""


class Enclosure(NamedTuple):
    """What keeps a robot from its goals.

    Attributes:
        joints: The number of joints, the first ones, that cannot get there whatever the others do.
        objects: The names of the objects that are in their way.
    """

    joints: int
    objects: tuple[str, ...]


def find_enclosure(
    robot: Robot,
    checker: CollisionChecker,
    start: FloatArray,
    goals: FloatArray,
    most_cells: int,
    *,
    most_joints: int = len(ATTEMPTS),
) -> Enclosure | None:
    """Prove that no motion leads from a start to any goal, if a few joints are enough for it.

    Args:
        robot: The arm, whose position limits its motions keep.
        checker: The arm and what is around it; point clouds, and the arm against itself, are left out.
        start: (joints,), free, rad or m.
        goals: (goals, joints), free.
        most_cells: The most cells that are looked at in each of a few attempts, among few objects.
        most_joints: The most joints that are looked at together.

    Returns:
        What is in the way; None: nothing is proved.
    """
    for count, halvings in ATTEMPTS:
        if count > min(most_joints, robot.dof):
            break
        cells, blocked = _Cells.of(robot, count, halvings), BlockedCells(robot, checker, count)
        if cells is None or blocked.is_empty:
            continue
        most = int(most_cells * FEW / max(FEW, blocked.cost))
        numbers = _enclosing(cells, blocked, start[None, :count], goals[:, :count], most)
        if numbers is not None:
            return Enclosure(count, blocked.names(numbers))
    return None


class _Cells(NamedTuple):
    """The ranges of the first joints in cells, as small as they get.

    Attributes:
        lower: (joints,): where the ranges begin, rad or m.
        widths: (joints,): of a cell.
        counts: (joints,): number of cells along each joint.
        different: (joints,): number of them until all is as it was, a turn further; as many as there are, or fewer.
        turns: (joints,), bool: whether the last cell of a joint is beside its first.
        coarsest: The number of cells along each joint that are looked at as one at first.
    """

    lower: FloatArray
    widths: FloatArray
    counts: np.ndarray
    different: np.ndarray
    turns: np.ndarray
    coarsest: int

    @classmethod
    def of(cls, robot: Robot, count: int, halvings: int) -> _Cells | None:
        """Cut the ranges of so many joints, and so often; None: one slides without end, or cells would be too many."""
        lower, upper = robot.limit("lower")[:count], robot.limit("upper")[:count]
        is_angle, turns = robot.is_angle[:count], ~np.isfinite(upper - lower)
        if (turns & ~is_angle).any():
            return None
        lower, upper = np.where(turns, -np.pi, lower), np.where(turns, np.pi, upper)
        repeats = is_angle & (upper - lower >= TURN)
        ranges = np.where(repeats, TURN, upper - lower)
        coarsest = 2**halvings
        coarse = np.maximum(1.0, np.ceil(ranges / WIDTH))
        widths = np.where(ranges > 0.0, ranges, 1.0) / coarse / coarsest
        counts = np.maximum(coarse * coarsest, np.where(turns, 0.0, np.ceil((upper - lower) / widths - ROUNDED)))
        if counts.prod() > MOST_CELLS:
            return None
        return cls(lower, widths, counts.astype(int), (coarse * coarsest).astype(int), turns, coarsest)

    def containing(self, positions: FloatArray) -> tuple[np.ndarray, ...]:
        """Return the cells that positions (N, joints) are in, as indices of each joint (N,)."""
        since = np.where(self.turns, np.mod(positions - self.lower, TURN), positions - self.lower)
        cells = np.clip(np.floor(since / self.widths).astype(int), 0, self.counts - 1)
        return tuple(cells.T)

    def unrolled(self, by: np.ndarray) -> np.ndarray:
        """Return what is known of the different cells for all cells."""
        numbers = [np.arange(count) % own for count, own in zip(self.counts, self.different, strict=True)]
        return np.asarray(by[np.ix_(*numbers)])

    def with_edges(self, cells: np.ndarray, beyond: int) -> np.ndarray:
        """Return cells with one more around them: those of the other end of joints that turn, and else a value."""
        for axis, turns in enumerate(self.turns.tolist()):
            sides = [(int(k == axis), int(k == axis)) for k in range(cells.ndim)]
            cells = np.pad(cells, sides, mode="wrap") if turns else np.pad(cells, sides, constant_values=beyond)
        return cells


def _enclosing(
    cells: _Cells, blocked: BlockedCells, start: FloatArray, goals: FloatArray, most: int
) -> np.ndarray | None:
    """Look at cells until those that are blocked keep a start (1, joints) from the goals (goals, joints).

    Returns:
        The numbers of the objects that do; None: as many cells as may be, or all, have been looked at.
    """
    joints, size, looked_at = len(cells.counts), cells.coarsest, 0
    by = np.full(cells.different, NO_OBJECT, dtype=np.int32)
    left = np.stack(np.meshgrid(*(np.arange(0, n, size) for n in cells.different), indexing="ij"), axis=-1)
    left = left.reshape(-1, joints)
    while len(left) and looked_at + len(left) <= most:
        looked_at += len(left)
        found = blocked.look(cells.lower + (left + size / 2.0) * cells.widths, cells.widths * size)
        proved = found.by != NO_OBJECT
        by[tuple(_parts(left[proved], range(size)).T)] = found.by[proved].repeat(size**joints)
        numbers = _surrounding(cells, cells.unrolled(by), start, goals)
        if numbers is not None or size == 1:
            return numbers
        size //= 2
        left = _parts(left[found.may_have_more], (0, size))
    return None


def _parts(cells: np.ndarray, beyond: Iterable[int]) -> np.ndarray:
    """Return parts (N * parts, joints) of cells (N, joints), which begin so many of the smallest ones further."""
    offsets = np.array(list(product(beyond, repeat=cells.shape[1])))
    return np.asarray((cells[:, None] + offsets).reshape(-1, cells.shape[1]))


def _surrounding(cells: _Cells, by: np.ndarray, start: FloatArray, goals: FloatArray) -> np.ndarray | None:
    """Return the numbers of the objects around the cells that lead from a start, or to the goals if these are fewer.

    Args:
        cells: The cells.
        by: Of each cell the number of the object that blocks it.
        start: (1, joints), rad or m.
        goals: (goals, joints).

    Returns:
        The numbers; None: one of the goals can be reached through cells that are not blocked.
    """
    from scipy import ndimage  # here only: most processes never need it
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = [cells.containing(positions) for positions in (start, goals)]
    for end in ends:
        by[end] = NO_OBJECT  # an end is free, on the edge of a cell, too
    beside, inner = np.ones((3,) * by.ndim), (slice(1, -1),) * by.ndim
    edged = cells.with_edges(by == NO_OBJECT, False)
    labels, count = ndimage.label(edged, structure=beside)
    same = cells.with_edges(labels[inner], 0)
    turned = (
        labels != same
    )  # on the edges, where a cell of the other end has its own label and one of its neighbors here
    graph = coo_array((np.ones(turned.sum()), (labels[turned], same[turned])), shape=(count + 1, count + 1))
    regions = connected_components(graph, directed=False)[1][labels]
    from_start, to_goals = (np.isin(regions, regions[inner][end]) for end in ends)
    if (from_start & to_goals).any():
        return None
    enclosed = from_start if from_start.sum() < to_goals.sum() else to_goals
    around = cells.with_edges(by, NO_OBJECT)[ndimage.binary_dilation(enclosed, structure=beside)]
    return np.unique(around[around != NO_OBJECT])
