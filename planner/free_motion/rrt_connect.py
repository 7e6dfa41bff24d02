"""Two trees that grow towards each other (Kuffner and LaValle, RRT-Connect, ICRA 2000) until a way is proved free."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.free_motion.tree import Tree

if TYPE_CHECKING:
    from planner.free_motion.edges import FreeEdges
    from planner.spatial import FloatArray

STEP = 0.75
"""The longest edge, rad (a metre counts as a radian): about what a posture in the open has of free space around it."""


class Meeting(NamedTuple):
    """A way that joins two trees which have met.

    Attributes:
        positions: (positions, joints), rad or m, from the start to a goal, proved free between any two neighbours.
        goal: Number of that goal.
    """

    positions: FloatArray
    goal: int


class Trees:
    """Two trees: what the start leads to, and what leads to one of the goals.

    Attributes:
        from_start: The tree whose root is the start.
        from_goals: The tree whose roots are the goals.
    """

    def __init__(self, edges: FreeEdges, start: FloatArray, goals: FloatArray) -> None:
        """Begin with free joint positions.

        Args:
            edges: Proves the motions.
            start: (joints,), rad or m.
            goals: (goals, joints), rad or m.
        """
        self.edges = edges
        self.from_start, self.from_goals = Tree(start[None]), Tree(goals)

    def find_way(self, lower: FloatArray, upper: FloatArray, rng: np.random.Generator) -> Meeting | None:
        """Grow the trees until they meet on a way that is proved free; a motion that is not is cut from its tree.

        Args:
            lower: (joints,), where random positions begin, rad or m.
            upper: (joints,), where they end.
            rng: Source of the positions.

        Returns:
            Where they met; None: the budget of the edges is spent.
        """
        while True:
            rows = self._grow_until_met(lower, upper, rng)
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

    def _grow_until_met(self, lower: FloatArray, upper: FloatArray, rng: np.random.Generator) -> tuple[int, int] | None:
        """Grow the smaller tree towards a random position, and the other one towards what came of it, until they meet.

        Returns:
            The rows of the position at which they met, in both trees; None: the budget of the edges is spent.
        """
        while self.edges.has_budget:
            is_forward = len(self.from_start) <= len(self.from_goals)
            growing, other = (self.from_start, self.from_goals) if is_forward else (self.from_goals, self.from_start)
            new = self._extend(growing, rng.uniform(lower, upper))
            if new is None:
                continue
            target = growing.positions[new].copy()
            reached = self._connect(other, target)
            if reached is not None:
                return (new, reached) if is_forward else (reached, new)
        return None

    def gap(self) -> tuple[float, int]:
        """Measure how near the trees have come to each other: the distance, and the row of the first one's position."""
        ends = self.from_goals.positions
        nearest = [ends[self.from_goals.nearest(position)] for position in self.from_start.positions]
        distances = np.linalg.norm(self.from_start.positions - np.array(nearest), axis=1)
        return float(distances.min()), int(distances.argmin())

    def _extend(self, tree: Tree, target: FloatArray) -> int | None:
        """Go one step from the nearest position of a tree towards a target (joints,)."""
        origin = tree.nearest(target)
        start = tree.positions[origin]
        distance = float(np.linalg.norm(target - start))
        end = target if distance <= STEP else start + (target - start) * (STEP / distance)
        return tree.add(end, origin) if self.edges.seems_free(start, end) else None

    def _connect(self, tree: Tree, target: FloatArray) -> int | None:
        """Go on step by step until a target (joints,) is reached; None: something is in the way."""
        new = self._extend(tree, target)
        while new is not None and self.edges.has_budget and (tree.positions[new] != target).any():
            new = self._extend(tree, target)
        return new if new is not None and (tree.positions[new] == target).all() else None
