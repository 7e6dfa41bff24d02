"""Straight joint motions that are proved free of collisions, not sampled; and how many have been looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.free_motion.quick_check import QuickCheck
from planner.scene import Budget, is_edge_free

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.spatial import FloatArray

EDGE_BUDGET = Budget(postures=400, distances=400)
"""What is looked at of one motion before it counts as not free: ten times what most take, some 20 ms. One that passes
so near an object that it takes more is no way to go."""

LOOK_EVERY = 0.1
"""The distance of the postures, rad or m, at which a motion is looked at before it is proved: few that collide are left
for the proof, and all of them take a tenth of its time."""


class FreeEdges:
    """Proves straight joint motions and counts them.

    Attributes:
        checker: The robot and what is around it.
        checked: How many motions have been looked at.
        most: How many may be.
    """

    def __init__(self, robot: Robot, checker: CollisionChecker, most: int) -> None:
        self.checker = checker
        self._quick = QuickCheck(robot, checker)
        self.checked = 0
        self.most = most

    @property
    def has_budget(self) -> bool:
        """Whether more may be looked at."""
        return self.checked < self.most

    def is_free(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether it is proved that the straight motion between two joint positions (joints,) keeps all margins."""
        self.checked += 1
        if self._quick.sees_collision(start + _shares(float(np.linalg.norm(end - start)))[:, None] * (end - start)):
            return False
        return is_edge_free(self.checker, start, end, EDGE_BUDGET)


def _shares(length: float) -> FloatArray:
    """Return shares (n,) of a motion at which it is looked at: its end first, then those far from all before."""
    count = max(1, int(np.ceil(length / LOOK_EVERY)))
    bits = count.bit_length()
    order = sorted(range(1, count + 1), key=lambda k: (k != count, int(format(k, f"0{bits}b")[::-1], 2)))
    return np.array(order, dtype=np.float64) / count
