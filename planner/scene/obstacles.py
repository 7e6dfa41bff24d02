"""The convex pieces of static objects, and cheap lower bounds of the distances to them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planner.scene.point_cloud import Cluster, PointCloud, k_d_leaves
from planner.scene.scene import SceneObject
from planner.shapes import Capsule, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose
from planner.tolerances import ROUNDING

MOST_IN_GROUP = 16
"""Number of pieces in a sphere of the hierarchy.

With fewer there are more spheres; with more each sphere is looser and has more pieces to check.
"""


class Obstacle(NamedTuple):
    """A static piece, in the base frame.

    Attributes:
        name: Name of the object that it is a piece of.
        rotation: (3, 3).
        translation: (3,), m.
        shape: The piece in its own frame: a convex shape, or balls of a point cloud.
        margin: Its margin, m; None: none of its own.
    """

    name: str
    rotation: FloatArray
    translation: FloatArray
    shape: Shape | Cluster
    margin: float | None


class Obstacles:
    """The bounded pieces of a scene, each in a box with rounded edges, and its half spaces.

    Attributes:
        pieces: The bounded pieces.
        half_spaces: The half spaces.
        all: The pieces, and then the half spaces.
        centers: (pieces, 3), m: of the boxes.
        rotations: (pieces, 3, 3): of the boxes.
        halves: (pieces, 3), m: half sides of the boxes.
        radii: (pieces,), m: of their rounded edges.
        sphere_radii: (pieces,), m: of spheres about the boxes.
        normals: (half spaces, 3).
        offsets: (half spaces,), m.
        members: (obstacles,): numbers of the obstacles of all groups, one group after the other: pieces that are near
            each other, then each half space alone.
        group_ends: (groups,): where the members of each group end.
    """

    def __init__(self, objects: Sequence[SceneObject], base: Pose | None) -> None:
        found = [piece for thing in objects for piece in _pieces_of(thing, base)]
        self.pieces = tuple(piece for piece in found if not isinstance(piece.shape, HalfSpace))
        self.half_spaces = tuple(piece for piece in found if isinstance(piece.shape, HalfSpace))
        self.all = (*self.pieces, *self.half_spaces)
        boxes = [_rounded_box(piece.shape) for piece in self.pieces]
        self.rotations = np.array([piece.rotation for piece in self.pieces]).reshape(-1, 3, 3)
        translations = np.array([piece.translation for piece in self.pieces]).reshape(-1, 3)
        middles, self.halves = (np.array([box[k] for box in boxes]).reshape(-1, 3) for k in (0, 1))
        self.centers = translations + (self.rotations @ middles[..., None])[..., 0]
        self.radii = np.array([box[2] for box in boxes])
        self.sphere_radii = (np.linalg.norm(self.halves, axis=1) + self.radii) * (1.0 + ROUNDING)
        planes = [_plane(piece) for piece in self.half_spaces]
        self.normals = np.array([normal for normal, _ in planes]).reshape(-1, 3)
        self.offsets = np.array([offset for _, offset in planes])
        self._balls = {row: _balls(piece) for row, piece in enumerate(self.pieces) if isinstance(piece.shape, Cluster)}
        leaves = k_d_leaves(self.centers, MOST_IN_GROUP)
        groups = [*leaves, *(np.array([len(self.pieces) + k]) for k in range(len(self.half_spaces)))]
        self.members = np.concatenate([np.empty(0, dtype=int), *groups])
        self.group_ends = np.cumsum([len(rows) for rows in groups], dtype=int)
        self._leaves = leaves

    def group_margins(self, margins: FloatArray) -> FloatArray:
        """Return the largest of the margins (bodies, obstacles) in each group: (bodies, groups), m."""
        if not len(self.members):
            return np.empty((len(margins), 0))
        first = np.append(0, self.group_ends[:-1])
        return np.maximum.reduceat(margins[:, self.members], first, axis=1)

    def group_balls(self) -> FloatArray:
        """Return center and radius of a ball about each group of pieces, and none about half spaces: (groups, 4), m."""
        balls = np.zeros((len(self.group_ends), 4))
        for ball, rows in zip(balls, self._leaves, strict=False):
            radii = self.sphere_radii[rows, None]
            ball[:3] = ((self.centers[rows] - radii).min(axis=0) + (self.centers[rows] + radii).max(axis=0)) / 2.0
            reach = np.linalg.norm(self.centers[rows] - ball[:3], axis=1) + self.sphere_radii[rows]
            ball[3] = reach.max() * (1.0 + ROUNDING)
        return balls

    def boxes(self) -> FloatArray:
        """Return the boxes as the kernels read them, each with the range of its balls in `all_balls`."""
        counts = np.array([len(self._balls[k].radii) if k in self._balls else 0 for k in range(len(self.pieces))])
        first = np.cumsum(counts) - counts
        rotations = self.rotations.reshape(-1, 9)
        return np.column_stack([rotations, self.centers, self.halves, self.radii, self.sphere_radii, first, counts])

    def all_balls(self) -> FloatArray:
        """Return center and radius of the balls of all clusters, in the base frame: (balls, 4), m."""
        found = [np.column_stack([balls.centers, balls.radii]) for balls in self._balls.values()]
        return np.concatenate([np.empty((0, 4)), *found])

    def balls(self, row: int) -> Cluster:
        """Return the balls of a piece that is a cluster, in the base frame."""
        return self._balls[row]


def _pieces_of(thing: SceneObject, base: Pose | None) -> Iterator[Obstacle]:
    """Yield the pieces of an object in the base frame, which stands in the world as a pose says."""
    pose = thing.pose if base is None else thing.pose.to_frame(base)
    rotation = pose.rotation
    if rotation is None:
        rotation = np.eye(3) if base is None or base.rotation is None else base.rotation.T
    for shape in thing.shapes:
        for part in shape.clusters if isinstance(shape, PointCloud) else (shape,):
            yield Obstacle(thing.id, rotation, pose.position, part, thing.margin)


def _balls(piece: Obstacle) -> Cluster:
    """Return the balls of a cluster in the base frame."""
    if not isinstance(piece.shape, Cluster):
        raise TypeError(f"{piece.name} is no cluster")
    return Cluster(piece.shape.centers @ piece.rotation.T + piece.translation, piece.shape.radii)


def _rounded_box(shape: Shape | Cluster) -> tuple[FloatArray, FloatArray, float]:
    """Return middle (3,), half sides (3,) and radius of a rounded box around a shape, in its frame."""
    if isinstance(shape, Cluster):
        low, high = shape.centers.min(axis=0), shape.centers.max(axis=0)
        return (low + high) / 2.0, (high - low) / 2.0 * (1.0 + ROUNDING), float(shape.radii.max())
    if isinstance(shape, Sphere | Capsule):
        half = np.array([0.0, 0.0, shape.length / 2.0 if isinstance(shape, Capsule) else 0.0])
        return np.zeros(3), half, shape.radius
    reach = shape.support(np.concatenate([np.eye(3), -np.eye(3)]))
    low, high = -reach[3:], reach[:3]
    return (low + high) / 2.0, (high - low) / 2.0 * (1.0 + ROUNDING), 0.0


def _plane(piece: Obstacle) -> tuple[FloatArray, float]:
    """Return the normal (3,) and the offset, m, of a half space in the base frame."""
    if not isinstance(piece.shape, HalfSpace):
        raise TypeError(f"{piece.name} is no half space")
    normal = piece.rotation @ piece.shape.normal
    return normal, float(piece.shape.offset + normal @ piece.translation)
