"""The pairs of bodies of two machines or objects that move in one world."""

from __future__ import annotations

import numpy as np

from planner.scene.bodies import Bodies
from planner.scene.checker import CollisionChecker
from planner.scene.obstacles import Obstacles
from planner.scene.scene import Scene
from planner.spatial import FloatArray


class CheckerBetween(CollisionChecker):
    """Pairs of a body of one machine and a body of another.

    The joints of both machines are the joints of one tree, so that the proofs of one robot hold for both.
    """

    def __init__(self, first: Bodies, second: Bodies, margins: FloatArray) -> None:
        """Prepare the checks.

        Args:
            first: The bodies of one machine, in the world.
            second: The bodies of the other machine.
            margins: (first, second), the least distance of each pair, m; negative infinity: the pair may touch.
        """
        self.scene, self.bodies = Scene(), first.beside(second)
        self.base, self.moving = None, ()
        self.dof = len(self.bodies.tree.parents)
        self.obstacles = Obstacles((), None)
        count = len(first.pieces)
        pairs = np.argwhere(margins > -np.inf).T
        self.first, self.second = pairs[0], pairs[1] + count
        self.margins = np.empty((len(self.bodies.pieces), 0))
        self._may_be_near = np.zeros(self.margins.shape, dtype=bool)
        self.own_margins, self.requested = margins[pairs[0], pairs[1]], {}
        self.displacements = np.zeros(len(self.bodies.pieces))
        self._uncertainties = np.zeros(len(self.bodies.pieces))
