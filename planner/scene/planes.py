"""Planes that were found between two pieces at one posture, and what they prove of the pair at others.

The plane that GJK suggests between two pieces separates them at postures nearby, too, when it moves with one of them.
How far the pieces leave each other along its normal is proved by their supports alone, for many pairs at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.scene.bodies import Postures
    from planner.scene.checker import CollisionChecker, Items
    from planner.shapes import Shape
    from planner.spatial import FloatArray


def normals_at(checker: CollisionChecker, postures: Postures, items: Items, normals: FloatArray) -> FloatArray:
    """Return the normals (n, 3) of planes between n pairs in the frames of both of their joints: (n, 2, 3)."""
    joints = checker.joints_of(items.pairs)
    turned: FloatArray = (normals[:, None, None] @ postures.rotations[items.rows[:, None], joints])[:, :, 0]
    return turned


def plane_bounds(checker: CollisionChecker, postures: Postures, items: Items, normals: FloatArray) -> FloatArray:
    """Bound the distances of pairs at postures from below by planes that were found at other ones.

    Args:
        checker: The robot and what is around it.
        postures: N postures.
        items: n pairs at postures.
        normals: (n, 2, 3), see `normals_at`; zero where no plane is known.

    Returns:
        (n,), m; -inf where no plane is known.
    """
    joints = checker.joints_of(items.pairs)
    rotations = postures.rotations[items.rows[:, None], joints]
    in_base = (rotations @ normals[..., None])[..., 0]
    shapes = checker.numbers_of(items.pairs)
    count = len(items.rows)
    reach, scale = np.zeros((count, 2)), np.ones(count)
    for number in np.unique(shapes).tolist():
        side = np.argwhere(shapes == number)
        rows, ends = side[:, 0], side[:, 1]
        joint, rotation, translation, shape = checker.placed_shape(number)
        turn = postures.rotations[items.rows[rows], joint] @ rotation
        origin = postures.rotations[items.rows[rows], joint] @ translation + postures.origins[items.rows[rows], joint]
        towards = in_base[rows] * np.where(ends == 0, 1.0, -1.0)[:, None, None]
        reach[rows] += _supports(shape, (towards @ turn).reshape(-1, 3)).reshape(-1, 2)
        reach[rows] += (towards @ origin[..., None])[..., 0]
        scale[rows] += np.abs(origin).max(axis=1)
    found = np.where((normals != 0.0).any(axis=2), -reach, -np.inf).max(axis=1)
    return np.asarray(found - 2.0 * ROUNDING * scale, dtype=np.float64)


def _supports(shape: Shape | Cluster, directions: FloatArray) -> FloatArray:
    """Compute the supports of a shape; infinite for what no plane that was found elsewhere separates."""
    if isinstance(shape, Cluster | HalfSpace):
        return np.full(len(directions), np.inf)
    return shape.support(directions)
