"""The search of proved intervals by numpy: the reference of the kernel behind `planner.scene.clearances`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from planner.scene.bodies import Placements, excursions
from planner.scene.checker import CONTACT_TOLERANCE
from planner.scene.continuous import DEFAULT_BUDGET, KINDS, LEAST_INTERVAL_SHARE, MOST_FIRST_INTERVALS, Budget, Nearest
from planner.scene.separations import Separation
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.scene.reference.bounds import Items, ReferenceChecker
from tests.planner.scene.reference.planes import Changes, approaches, normals_at, plane_bounds

ARC_OF_PART = 0.15
"""Travel of the fastest joint in one of the first intervals, rad or m."""

AT_ONCE = 512
"""Number of intervals that are evaluated together: enough for array operations, in some MiB."""

MOST_SPLITS = 6
"""Largest number of parts into which an interval is split at once."""

ENOUGH_PARTS = 4.0
"""Number of parts down to which a pair is split by its cheap bound or by a plane found elsewhere. It takes as long as
one proved distance."""


@dataclass
class Found:
    """The clearance of a motion, of each of the `KINDS` of pairs."""

    lower: FloatArray = field(default_factory=lambda: np.full(len(KINDS), np.inf))
    nearest: list[Nearest | None] = field(default_factory=lambda: [None] * len(KINDS))
    hit: Nearest | None = None
    undecided: Nearest | None = None
    positions: int = 0
    distances: int = 0

    @property
    def is_proved(self) -> bool:
        """Whether every pair keeps its margin at all times, up to `CONTACT_TOLERANCE`."""
        return self.hit is None and self.undecided is None

    @property
    def upper(self) -> FloatArray:
        """The nearest distances (3,) seen, m; infinite where none was measured."""
        return np.array([np.inf if near is None else near.distance for near in self.nearest])

    def see(self, kind: int, found: Nearest) -> None:
        """Take a distance into account."""
        near = self.nearest[kind]
        if near is None or found.distance < near.distance:
            self.nearest[kind] = found
        if found.missing > CONTACT_TOLERANCE and (self.hit is None or found.missing > self.hit.missing):
            self.hit = found


def numpy_clearances(
    checker: ReferenceChecker,
    motion: PiecewisePolynomial,
    *,
    tolerance: float | None = None,
    budget: Budget = DEFAULT_BUDGET,
) -> Found:
    """Prove that every pair keeps its margin along a motion, or find a pair that does not."""
    found = Found()
    if checker.is_empty:
        return found
    search = _Search(checker, motion, tolerance, found, budget)
    edges = np.linspace(0.0, float(motion.breakpoints[-1]), _parts(motion) + 1)
    search.start(edges[:-1], edges[1:])
    while search.waiting and found.hit is None and search.has_budget:
        search.step()
    search.finish()
    return found


def _parts(motion: PiecewisePolynomial) -> int:
    """Return the number of first intervals, by the travel of the joints between samples."""
    times = np.linspace(0.0, float(motion.breakpoints[-1]), MOST_FIRST_INTERVALS + 1)
    ways = np.abs(np.diff(motion.evaluate(times, [0])[0], axis=0)).sum(axis=0)
    return int(np.clip(np.ceil(ways.max(initial=0.0) / ARC_OF_PART), 1, MOST_FIRST_INTERVALS))


class _Batch(NamedTuple):
    """Unfinished intervals, and the unfinished pairs of each."""

    starts: FloatArray
    ends: FloatArray
    items: Items | None
    normals: FloatArray


class _Search:
    """The remaining intervals, in the order of their splits."""

    def __init__(
        self,
        checker: ReferenceChecker,
        motion: PiecewisePolynomial,
        tolerance: float | None,
        found: Found,
        budget: Budget,
    ) -> None:
        self.checker, self.motion, self.tolerance, self.found = checker, motion, tolerance, found
        self.budget = budget
        self.waiting: list[_Batch] = []
        self.least = LEAST_INTERVAL_SHARE * float(motion.breakpoints[-1])
        self.stuck: list[tuple[float, int, float]] = []

    @property
    def has_budget(self) -> bool:
        """Whether the budget allows another interval."""
        return self.found.positions < self.budget.positions and self.found.distances < self.budget.distances

    def start(self, starts: FloatArray, ends: FloatArray) -> None:
        """Begin with intervals on which all pairs are unfinished."""
        self.waiting.append(_Batch(starts, ends, None, np.zeros((0, 2, 3))))

    def wanted(self, kinds: np.ndarray, margins: FloatArray) -> FloatArray:
        """Return the distances (n,) above which pairs of some kinds and margins (n,) are finished, m."""
        wanted = margins - CONTACT_TOLERANCE
        if self.tolerance is not None:
            np.maximum(wanted, (self.found.upper - self.tolerance)[kinds], out=wanted)
        return wanted

    def step(self) -> None:
        """Evaluate the first remaining intervals, and split the ones with unfinished pairs."""
        starts, ends, items, normals = self.waiting.pop(0)
        middles = (starts + ends) / 2.0
        positions = self.motion.evaluate(middles, [0])[0]
        placements = self.checker.bodies.at(positions)
        reach = excursions(self.motion, starts, ends, positions)
        displacements = self.checker.bodies.displacements(placements, reach)
        self.found.positions += len(starts)
        if items is None:
            items = self._all_items(placements, displacements, middles)
            normals = np.zeros((len(items.rows), 2, 3))
        motions = self.checker.motions(displacements, items)
        kinds, margins = self.checker.kinds(items.pairs), self.checker.margins_of(items.pairs)
        wanted = self.wanted(kinds, margins)
        near = self.checker.bounds(placements, items, wanted + motions)
        seen = (near - motions < wanted) & normals.any(axis=(1, 2))
        if seen.any():
            bounds = plane_bounds(self.checker, placements, Items(items.rows[seen], items.pairs[seen]), normals[seen])
            near[seen] = np.maximum(near[seen], bounds)
        low = near - motions
        left = np.flatnonzero((low < wanted) & (near - wanted < motions / ENOUGH_PARTS))
        looked: list[int] = []
        planes: list[FloatArray] = []
        upper = self.found.upper
        for item in left[np.argsort(low[left], kind="stable")].tolist():
            if low[item] >= wanted[item] or motions[item] / ENOUGH_PARTS <= near[item] - wanted[item]:
                continue  # by now
            if not self.has_budget:
                break
            row, pair = int(items.rows[item]), int(items.pairs[item])
            apart = self._look(placements, row, pair, float(middles[row]), int(kinds[item]), float(margins[item]))
            near[item] = apart.proved
            low[item] = apart.proved - motions[item]
            looked.append(item)
            planes.append(apart.normal)
            if self.found.hit is not None and self.tolerance is None:
                break
            if self.tolerance is not None and (self.found.upper < upper).any():
                upper = self.found.upper
                wanted = self.wanted(kinds, margins)
        if looked:
            these = Items(items.rows[looked], items.pairs[looked])
            normals[looked] = normals_at(self.checker, placements, these, np.array(planes))
            slides = [k for k, item in enumerate(looked) if low[item] < wanted[item] <= near[item]]
            if slides:
                slow = np.array(looked)[slides]
                pairs = Items(items.rows[slow], items.pairs[slow])
                changes = self._changes(starts, ends, positions, reach)
                nearer = approaches(self.checker, placements, pairs, np.array(planes)[slides], changes)
                low[slow] = np.maximum(low[slow], near[slow] - nearer)
        self._split(_Batch(starts, ends, items, normals), near, low, wanted, kinds)

    def _changes(self, starts: FloatArray, ends: FloatArray, positions: FloatArray, reach: FloatArray) -> Changes:
        """Return the changes of the joints within intervals, from positions and bounds at the middles."""
        velocities = self.motion.evaluate((starts + ends) / 2.0, [1])[0]
        remainders = excursions(self.motion, starts, ends, positions, velocities)
        return Changes(velocities, (ends - starts) / 2.0, reach, remainders)

    def _look(self, placements: Placements, row: int, pair: int, time: float, kind: int, margin: float) -> Separation:
        apart = self.checker.separate(placements, row, pair)
        self.found.distances += 1
        self.found.see(kind, Nearest(apart.distance, time, pair, apart.point, margin))
        return apart

    def _all_items(self, placements: Placements, displacements: FloatArray, middles: FloatArray) -> Items:
        """Return the pairs that spheres about the pieces leave undecided."""
        found = [self.checker.own_items(len(middles))]
        for kind, requested in self.checker.requested.items():
            wanted = np.where(requested, self.checker.margins - CONTACT_TOLERANCE, -np.inf)
            if self.tolerance is not None:
                row, pair = self.checker.nearest_item(placements, wanted)
                margin = float(self.checker.margins_of(np.array([pair]))[0])
                self._look(placements, row, pair, float(middles[row]), kind, margin)
                least = self.found.upper[kind] - self.tolerance
                wanted = np.where(requested, np.maximum(wanted, least), -np.inf)
            near, least = self.checker.numpy_near_items(placements, displacements.sum(axis=2), wanted)
            self._done(kind, np.array([least]))
            found.append(near)
        return Items(*(np.concatenate(part) for part in zip(*found, strict=True)))

    def _done(self, kind: int, low: FloatArray) -> None:
        self.found.lower[kind] = min(self.found.lower[kind], low.min(initial=np.inf))

    def _split(self, batch: _Batch, near: FloatArray, low: FloatArray, wanted: FloatArray, kinds: np.ndarray) -> None:
        """Split the intervals with remaining pairs into an estimated number of parts."""
        starts, ends, items, normals = batch
        if items is None:
            raise ValueError("nothing was looked at")
        left = low < wanted
        for kind in KINDS:
            self._done(kind, low[~left & (kinds == kind)])
        rows, pairs, normals = items.rows[left], items.pairs[left], normals[left]
        if not len(rows):
            return
        room = np.maximum(near[left] - wanted[left], 1e-9)
        parts = np.ones(len(starts), dtype=int)
        need = np.ceil(np.clip((near[left] - low[left]) / room, 2, MOST_SPLITS)).astype(int)
        np.maximum.at(parts, rows, need)
        short = (ends - starts)[rows] < self.least
        middles = (starts + ends) / 2.0
        for kind in KINDS:
            self._done(kind, low[left][short & (kinds[left] == kind)])
        self.stuck += [
            (float(middles[row]), int(pair), float(distance))
            for row, pair, distance in zip(rows[short], pairs[short], near[left][short], strict=True)
        ]
        rows, pairs, normals = rows[~short], pairs[~short], normals[~short]
        chosen = np.unique(rows)
        for first in range(0, len(chosen), AT_ONCE // MOST_SPLITS):
            some = chosen[first : first + AT_ONCE // MOST_SPLITS]
            self.waiting.append(_split_into(starts[some], ends[some], parts[some], some, rows, pairs, normals))

    def finish(self) -> None:
        """Mark the pairs of the remaining intervals: their distances are unknown."""
        for starts, ends, items, _ in self.waiting:
            row, pairs = (0, self.checker.all_pairs()) if items is None else (int(items.rows[0]), items.pairs)
            for kind in np.unique(self.checker.kinds(pairs)).tolist():
                self.found.lower[kind] = -np.inf
            self.stuck.append((float((starts[row] + ends[row]) / 2.0), int(pairs[0]), -np.inf))
        if self.stuck and self.found.hit is None:
            time, pair, distance = min(self.stuck, key=lambda each: each[2])
            margin = float(self.checker.margins_of(np.array([pair]))[0])
            self.found.undecided = Nearest(distance, time, pair, np.full(3, np.nan), margin)


def _split_into(
    starts: FloatArray,
    ends: FloatArray,
    parts: np.ndarray,
    rows: np.ndarray,
    of: np.ndarray,
    pairs: np.ndarray,
    normals: FloatArray,
) -> _Batch:
    """Return intervals in so many parts each, with the pairs of the rows `of`, and their planes."""
    first = np.cumsum(parts) - parts
    new_of = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(new_of)) - first[new_of]
    edges = [starts[new_of] + (ends - starts)[new_of] * ((number + k) / parts[new_of]) for k in (0, 1)]
    edges[1] = np.where(number + 1 == parts[new_of], ends[new_of], edges[1])
    mine = np.isin(of, rows)
    position = np.searchsorted(rows, of[mine])
    count = parts[position]
    inner = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    items = Items(np.repeat(first[position], count) + inner, np.repeat(pairs[mine], count))
    return _Batch(edges[0], edges[1], items, np.repeat(normals[mine], count, axis=0))
