"""Ways that may be better than the one that was found: other ones by new searches, and changes of the best so far."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

import numpy as np

from planner.free_motion.detours import EndsOfDetour
from planner.free_motion.edges import FreeEdges
from planner.free_motion.free_path import ROOM, sought_within
from planner.free_motion.objectives import Estimate
from planner.free_motion.refining import refined
from planner.free_motion.rrt_connect import Trees
from planner.free_motion.shortcuts import shortened
from planner.robots import Robot
from planner.scene import is_free
from planner.spatial import FloatArray

CHECKS_OF_A_PLAN = 100
"""The motions that a path which is timed and certified counts as: that takes about as long."""

CHECKS_OF_A_ROUND = 25
"""The motions that each attempt counts as besides: changes are thought of before they are looked at."""

CHECKS_OF_A_SEARCH = 1000
"""The most motions that one new search looks at."""

TRIES = (40, 120, 360)
"""The numbers of changes tried on a path before timing it.

Estimated and timed costs differ, and few changes may be better than many.
"""

WORTH_TIMING = 1.15
"""Largest estimated cost, relative to the best path, at which a path from a new search is timed."""


class CandidateDetours:
    """Proposes paths, each proved free, until the budget is spent.

    Attributes:
        edges: Looks at motions and proves them, within the budget.
    """

    def __init__(
        self, robot: Robot, ends: EndsOfDetour, first: FloatArray, cost: Estimate, edges: FreeEdges, seed: int
    ) -> None:
        """Begin with a path proved free.

        Args:
            robot: The arm, whose position limits all paths keep.
            ends: The start and the goals of the paths; the goals may be in collision.
            first: (positions, joints), rad or m, a path to one of these goals.
            cost: The estimated cost of a path.
            edges: Looks at motions, without any room yet, within the budget.
            seed: Of the random numbers; equal seeds give equal paths.
        """
        self.edges, self._cost, self._seed = edges, cost, seed
        goals = np.vstack([first[-1:], ends.goals[(ends.goals != first[-1]).any(axis=1)]])
        self._goals = goals[is_free(ends.checker, goals)]
        self._start = first[0]
        self._within = sought_within(robot, np.vstack([first[:1], self._goals]))
        edges.keep_room(ROOM, edges.most)
        if not all(edges.seems_free(*first[k : k + 2]) for k in range(len(first) - 1)):
            edges.keep_room(0.0, edges.most)
        self.best = first

    def at_once(self) -> FloatArray | None:
        """Return the best path with the most changes that are tried at once; None: none is better and proved free."""
        return self._changed(self.best, np.random.default_rng(self._seed), max(TRIES))

    def __iter__(self) -> Iterator[FloatArray]:
        """Yield paths; each new one starts from the current `best`."""
        for number in count():
            if not self.edges.has_budget:
                return
            self.edges.checked += CHECKS_OF_A_ROUND
            rng = np.random.default_rng([self._seed, number])
            path = self._new(rng) if number % 2 else self._changed(self.best, rng, int(rng.choice(TRIES)))
            if path is not None and self.edges.has_budget:
                self.edges.checked += CHECKS_OF_A_PLAN
                yield path

    def _changed(self, path: FloatArray, rng: np.random.Generator, tries: int) -> FloatArray | None:
        """Return a proved path that costs less than the known one; None: none was found."""
        changed = refined(self.edges, path, self._cost, self._within, rng, tries)
        return None if changed is path or self.edges.first_unproved(changed) is not None else changed

    def _new(self, rng: np.random.Generator) -> FloatArray | None:
        """Return another path, to one of the goals; None: none was found soon that could be better."""
        goal = self._goals[int(rng.integers(len(self._goals)))]
        least = self._cost(self.best)
        if self._cost(np.stack([self._start, goal])) > least:
            return None
        if self.edges.is_free(self._start, goal):
            return np.stack([self._start, goal])
        low, high = np.minimum(self._start, goal), np.maximum(self._start, goal)
        beyond = np.maximum(0.0, self._cost.farthest(least) - (high - low)) / 2.0
        within = np.maximum(self._within[0], low - beyond), np.minimum(self._within[1], high + beyond)
        most = self.edges.most
        self.edges.most = min(most, self.edges.checked + CHECKS_OF_A_SEARCH)
        met = Trees(self.edges, self._start, goal[None], within).find_meeting(rng)
        self.edges.most = most
        if met is None:
            return None
        found = shortened(self.edges, met.positions, rng)
        changed = self._changed(found, rng, max(TRIES))
        path = found if changed is None else changed
        return path if self._cost(path) < WORTH_TIMING * least else None
