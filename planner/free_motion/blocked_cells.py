"""Cells of the first joints' ranges in which every posture collides, whatever the other joints do."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.free_motion.inner_balls import distance_bounds, faces, inner_balls
from planner.scene import CONTACT_TOLERANCE
from planner.shapes import ConvexHull, Shape
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.scene.bodies import Postures
    from planner.spatial import FloatArray

FACES_OF_ONE = 8.0
"""The number of faces of a hull that take as long as a box does."""

AT_ONCE = 2048
"""The number of cells that are looked at together: some MiB."""

NO_OBJECT = -1
"""The number that stands for no object."""


class Looked(NamedTuple):
    """What is known of cells.

    Attributes:
        by: (N,): number of an object that all postures of a cell collide with; `NO_OBJECT`: none is known.
        may_have_more: (N,), bool: whether such an object may be found for a part of a cell that has none itself.
    """

    by: np.ndarray
    may_have_more: np.ndarray


class BlockedCells:
    """Looks at cells: a cell is blocked where a ball inside of a link is too near to an object all over it."""

    def __init__(self, robot: Robot, checker: CollisionChecker, count: int) -> None:
        """Prepare for what so many joints, the first ones, move and no other joint does."""
        bodies, obstacles = checker.bodies, checker.obstacles.all
        mine = (bodies.joints > 0) & ~bodies.is_moved[:, count:].any(axis=1)
        solid = np.array([isinstance(obstacle.shape, Shape) for obstacle in obstacles], dtype=bool)
        self._margins = np.where(mine[:, None] & solid, checker.margins, -np.inf)
        self._checker, self._bodies, self._dof, self._count = checker, bodies, robot.dof, count

    @property
    def cost(self) -> float:
        """How many boxes take as long to be looked at as the objects."""
        shapes = [self._checker.obstacles.all[k].shape for k in np.flatnonzero(np.isfinite(self._margins).any(axis=0))]
        return sum(len(faces(s)) / FACES_OF_ONE if isinstance(s, ConvexHull) else 1.0 for s in shapes)

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to be held against anything."""
        return not np.isfinite(self._margins).any()

    def look(self, middles: FloatArray, widths: FloatArray) -> Looked:
        """Find what cells are blocked by.

        Args:
            middles: Of the cells (N, joints), rad or m.
            widths: Of every cell (joints,).
        """
        parts = [self._look(middles[k : k + AT_ONCE], widths) for k in range(0, len(middles), AT_ONCE)]
        return Looked(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def names(self, numbers: np.ndarray) -> tuple[str, ...]:
        """Return the names of objects, in alphabetical order."""
        return tuple(sorted({self._checker.obstacles.all[number].name for number in numbers.tolist()}))

    def _look(self, middles: FloatArray, widths: FloatArray) -> Looked:
        positions = np.zeros((len(middles), self._dof))
        positions[:, : self._count] = middles
        excursions = np.zeros_like(positions)
        excursions[:, : self._count] = widths / 2.0
        postures = self._bodies.at(positions)
        near = self._checker.near_items(positions, excursions, self._margins, -np.inf)
        by, may_have_more = np.full(len(middles), NO_OBJECT), np.zeros(len(middles), dtype=bool)
        for pair in np.unique(near.pairs).tolist():
            body, number = divmod(pair - self._checker.own_pairs, self._margins.shape[1])
            rows = near.rows[near.pairs == pair]
            rows = rows[by[rows] == NO_OBJECT]
            overlaps, changes = self._overlaps(body, number, postures, rows, widths)
            by[rows[(overlaps > changes).any(axis=1)]] = number
            may_have_more[rows] |= (overlaps > -changes).any(axis=1)
        return Looked(by, may_have_more & (by == NO_OBJECT))

    def _overlaps(
        self, body: int, number: int, postures: Postures, rows: np.ndarray, widths: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bound by how much the balls of a body are too near to an object in the middles of cells, and all over them.

        Args:
            body: Number of the body.
            number: Number of the object.
            postures: The postures in the middles of cells.
            rows: (N,): which of these.
            widths: Of every cell (joints,), rad or m.

        Returns:
            Lower bounds of that (N, balls), m, infinite where nothing is known, and by how much it changes at most
            within a cell (N, balls), m.
        """
        piece, obstacle = self._bodies.pieces[body], self._checker.obstacles.all[number]
        if not isinstance(obstacle.shape, Shape):
            raise TypeError(f"{obstacle.name} is no convex shape")
        rotations, origins = postures.rotations[rows], postures.origins[rows]
        inner, radii = inner_balls(piece.shape)
        inner = inner @ piece.rotation.T + piece.translation
        centers = inner @ rotations[:, piece.joint].transpose(0, 2, 1) + origins[:, piece.joint, None]
        distances = distance_bounds(obstacle.shape, (centers - obstacle.translation) @ obstacle.rotation)
        overlaps = radii + self._margins[body, number] - distances - ROUNDING * 10.0 - CONTACT_TOLERANCE
        changes = np.zeros(overlaps.shape)
        for joint in np.flatnonzero(self._bodies.is_moved[body, : self._count]).tolist():
            if not self._bodies.is_angle[joint]:
                changes += widths[joint] / 2.0
                continue
            arms = centers - origins[:, joint + 1, None]
            along = np.einsum("nbx,nx->nb", arms, rotations[:, joint + 1, :, 2])
            from_axis = np.sqrt(np.maximum((arms**2).sum(axis=-1) - along**2, 0.0))
            changes += 2.0 * np.sin(min(widths[joint] / 2.0, np.pi) / 2.0) * from_axis
        return overlaps, changes
