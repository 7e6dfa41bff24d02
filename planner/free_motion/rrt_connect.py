"""Two trees that grow towards each other (Kuffner and LaValle, RRT-Connect, ICRA 2000) until a path is proved free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.free_motion.edges import FreeEdges
from planner.free_motion.tree import Tree
from planner.spatial import FloatArray

LONGEST_EDGE = 0.75
"""The longest edge, rad (a metre counts as a radian): about the free space around a joint position in the open."""

MOST_KEPT_STEPS = 20
"""The largest number of steps towards a random position where the tool keeps constraints."""

FIRST_RADIUS = 4.0 * LONGEST_EDGE
"""Largest distance of random positions from a node, rad or m, after a motion from the node was blocked."""

LEAST_RADIUS = LONGEST_EDGE
"""Smallest such distance."""

CHANGE = 0.1
"""The relative decrease of this distance after each blocked motion, and its increase after each free one."""

DRAWN = 64
"""Number of random positions drawn to find one within such a radius; if there is none, the first is used."""

LEVER_SAMPLES = 64
"""The number of random joint positions for measuring the effect of each joint on the robot."""

LEAST_WEIGHT = 0.05
"""Smallest weight of a joint, relative to the largest.

A tree then approaches a position with each step, even if only a joint with little effect has to turn.
"""


class Meeting(NamedTuple):
    """A path that joins two trees which have met.

    Attributes:
        positions: (positions, joints), rad or m, from the start to a goal, proved free between any two neighbours.
        goal: Number of that goal.
    """

    positions: FloatArray
    goal: int


class Trees:
    """Two trees: positions reachable from the start, and positions that lead to one of the goals.

    Distances measure the movement of the robot. The weight of a joint, per radian, is its mean lever over random joint
    positions: the largest distance of its moved bodies from its axis. A metre of a prismatic joint weighs 1 m. With
    equal weights, mostly the wrist decides where a tree grows. An arm inside a narrow place would then hit the same
    object again and again.

    Attributes:
        from_start: The tree whose root is the start.
        from_goals: The tree whose roots are the goals.
    """

    def __init__(
        self, edges: FreeEdges, start: FloatArray, goals: FloatArray, within: tuple[FloatArray, FloatArray]
    ) -> None:
        """Begin with free joint positions.

        Args:
            edges: Proves the motions.
            start: (joints,), rad or m.
            goals: (goals, joints), rad or m.
            within: The lowest and the highest (joints,) of random positions, rad or m.
        """
        self.edges, self._within = edges, within
        samples = np.random.default_rng(0).uniform(*within, (LEVER_SAMPLES, len(start)))
        levers = edges.levers(samples).mean(axis=0)
        weights = np.maximum(levers, LEAST_WEIGHT * levers.max())
        self.from_start, self.from_goals = Tree(start[None], weights), Tree(goals, weights)

    def find_meeting(self, rng: np.random.Generator) -> Meeting | None:
        """Grow the trees until they meet on a proved path; cut unproved motions from their tree.

        Args:
            rng: Source of the random positions.

        Returns:
            The joined path; None: the budget of the edges is spent.
        """
        while True:
            rows = self._grow_until_met(rng)
            if rows is None:
                return None
            before, after = self.from_start.branch(rows[0])[::-1], self.from_goals.branch(rows[1])
            ends = self.from_goals.positions[after[1:]]
            positions = np.concatenate([self.from_start.positions[before], ends])
            failed = self.edges.first_unproved(positions)
            if failed is None:
                return Meeting(positions, after[-1])
            if failed < len(before) - 1:
                self.from_start.cut(before[failed + 1])
            else:
                self.from_goals.cut(after[failed - (len(before) - 1)])

    def _grow_until_met(self, rng: np.random.Generator) -> tuple[int, int] | None:
        """Grow the smaller tree towards a random position, and the other one towards the new node, until they meet.

        Returns:
            The rows of the position at which they met, in both trees; None: the budget of the edges is spent.
        """
        while self.edges.has_budget:
            is_forward = len(self.from_start) <= len(self.from_goals)
            growing, other = (self.from_start, self.from_goals) if is_forward else (self.from_goals, self.from_start)
            origin, target = self._drawn(growing, rng)
            new = self._extend(growing, origin, target)
            if new is None:
                growing.radii[origin] = np.clip((1.0 - CHANGE) * growing.radii[origin], LEAST_RADIUS, FIRST_RADIUS)
                continue
            growing.radii[origin] *= 1.0 + CHANGE
            if self.edges.kept is not None:
                new = self._extend_far(growing, new, target)
            target = growing.positions[new].copy()
            reached = self._connect(other, target)
            if reached is not None:
                return (new, reached) if is_forward else (reached, new)
        return None

    def _drawn(self, tree: Tree, rng: np.random.Generator) -> tuple[int, FloatArray]:
        """Draw a random position (joints,), and the row from which a tree goes towards it.

        It is the first random position within the radius of its nearest node. So a blocked tree is not sent in the same
        direction forever. See Jaillet, Yershova, LaValle and Simeon, Adaptive tuning of the sampling domain for
        dynamic-domain RRTs, IROS 2005.
        """
        targets = rng.uniform(*self._within, (DRAWN, len(self._within[0])))
        origins = tree.nearest(targets)
        is_in_domain = np.linalg.norm(targets - tree.positions[origins], axis=1) <= tree.radii[origins]
        chosen = int(is_in_domain.argmax())
        return int(origins[chosen]), targets[chosen]

    def gap(self) -> tuple[float, int]:
        """Return the smallest distance between the trees, and the row of that position in the first tree.

        All joints weigh the same in it, rad or m.
        """
        ends = self.from_goals.positions
        distances = [float(np.linalg.norm(ends - position, axis=1).min()) for position in self.from_start.positions]
        row = int(np.argmin(distances))
        return distances[row], row

    def _extend(self, tree: Tree, origin: int, target: FloatArray) -> int | None:
        """Go one step from the position of a row of a tree towards a target (joints,)."""
        end = self.edges.step(tree.positions[origin], target, LONGEST_EDGE)
        return None if end is None else tree.add(end, origin)

    def _extend_far(self, tree: Tree, row: int, target: FloatArray) -> int:
        """Go on from a row of a tree towards a target (joints,) along the constraints; return the last row."""
        for _ in range(MOST_KEPT_STEPS - 1):
            new = self._extend(tree, row, target) if self.edges.has_budget else None
            if new is None:
                break
            row = new
        return row

    def _connect(self, tree: Tree, target: FloatArray) -> int | None:
        """Extend a tree step by step until it reaches a target (joints,); None: an obstacle blocks it."""
        new = self._extend(tree, int(tree.nearest(target[None])[0]), target)
        while new is not None and self.edges.has_budget and (tree.positions[new] != target).any():
            new = self._extend(tree, new, target)
        return new if new is not None and (tree.positions[new] == target).all() else None
