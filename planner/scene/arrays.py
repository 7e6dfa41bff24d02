"""A robot and a scene as arrays of the kernels: each shape is the hull of points that a disc and a ball roll over."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from planner.kernels.clearance import PIECE_NUMBERS, PieceArrays
from planner.scene.bodies import SPHERES, Bodies
from planner.scene.obstacles import Obstacles
from planner.scene.point_cloud import Cluster
from planner.shapes import BoundingCapsule, Box, Capsule, ConvexHull, Cylinder, Shape, Sphere
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
"""The corners of a cube with sides of 1 m."""

POINTS_AT_ONCE = 4
"""Number of points that the kernels look at together: pieces repeat their last one."""


class Core(NamedTuple):
    """A shape as points (N, 3), m, and the radii, m, of a disc across z and of a ball that roll over their hull."""

    points: FloatArray
    disc: float = 0.0
    ball: float = 0.0


def core_of(shape: Shape) -> Core:
    """Return the core of a bounded shape."""
    match shape:
        case Sphere():
            return Core(np.zeros((1, 3)), ball=shape.radius)
        case Box():
            return Core(CORNERS * shape.size)
        case Capsule():
            return Core(_on_z(shape.length), ball=shape.radius)
        case Cylinder():
            return Core(_on_z(shape.length), disc=shape.radius)
        case ConvexHull():
            return Core(shape.vertices)
    raise TypeError(f"{type(shape).__name__} is no bounded shape")


def _on_z(length: float) -> FloatArray:
    return np.array([[0.0, 0.0, -length / 2.0], [0.0, 0.0, length / 2.0]])


class _Pieces:
    """Rows of pieces and their points, one after the other."""

    def __init__(self) -> None:
        self.rows: list[FloatArray] = []
        self.points: list[FloatArray] = []
        self._count = 0

    def add(self, joint: int, rotation: FloatArray, translation: FloatArray, shape: Shape) -> None:
        """Add a shape in a joint's frame."""
        core, capsule = core_of(shape), shape.bounding_capsule
        if capsule is None:
            raise TypeError("a shape without a bounding capsule is not bounded")
        points = core.points @ rotation.T + translation
        start, end = (rotation @ point + translation for point in capsule[:2])
        numbers = [joint, self._count, -(-len(points) // POINTS_AT_ONCE) * POINTS_AT_ONCE, core.ball, core.disc]
        extent = np.abs(points).max() + core.ball + core.disc
        bounds = [capsule.radius, cover_radius(capsule), extent, isinstance(shape, Sphere | Capsule)]
        self.rows.append(np.concatenate([numbers, rotation[:, 2], start, end, bounds]))
        padding = np.repeat(points[-1:], -len(points) % POINTS_AT_ONCE, axis=0)
        self.points += [points, padding]
        self._count += len(points) + len(padding)


def cover_radius(capsule: BoundingCapsule) -> float:
    """Return the radius, m, of `SPHERES` spheres along the axis of a capsule that cover it."""
    half_step = float(np.linalg.norm(capsule.end - capsule.start)) / (SPHERES - 1) / 2.0
    return float(np.hypot(capsule.radius, half_step)) * (1.0 + ROUNDING)


def piece_arrays(
    bodies: Bodies,
    obstacles: Obstacles,
    own: np.ndarray,
    own_margins: FloatArray,
    margins: FloatArray,
    kinds: np.ndarray,
) -> PieceArrays:
    """Write a robot and a scene as arrays.

    Args:
        bodies: The pieces that move.
        obstacles: The pieces that stand still.
        own: (2, own pairs), of bodies.
        own_margins: (own pairs,), m.
        margins: (bodies, obstacles), m.
        kinds: (bodies, obstacles), 1 or 2.
    """
    pieces = _Pieces()
    for body in bodies.pieces:
        pieces.add(body.joint, body.rotation, body.translation, body.shape)
    for obstacle in obstacles.pieces:
        if isinstance(obstacle.shape, Cluster):
            pieces.rows.append(np.zeros(PIECE_NUMBERS))
        else:
            pieces.add(0, obstacle.rotation, obstacle.translation, obstacle.shape)
    of_kinds = (obstacles.group_margins(np.where(kinds == kind, margins, -np.inf)) for kind in (1, 2))
    return PieceArrays(
        bodies.joint_rows(),
        np.array(pieces.rows).reshape(-1, PIECE_NUMBERS),
        np.concatenate([np.empty((0, 3)), *pieces.points]).T,
        obstacles.boxes(),
        np.column_stack([obstacles.normals, obstacles.offsets]),
        obstacles.all_balls(),
        own,
        bodies.is_moved,
        own_margins,
        margins,
        kinds,
        obstacles.members,
        obstacles.group_ends,
        obstacles.group_balls(),
        np.array(list(of_kinds)),
    )
