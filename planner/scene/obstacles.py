"""The convex pieces of what stands still, and cheap lower bounds of the distances to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.scene.point_cloud import Cluster, PointCloud, k_d_leaves
from planner.shapes import Capsule, HalfSpace, Sphere
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.scene.scene import SceneObject
    from planner.shapes import Shape
    from planner.spatial import FloatArray, Pose


MOST_IN_GROUP = 16
"""Number of pieces in a sphere that is looked at before they are: with fewer there are more of these spheres, with more
each of them is looser and has more pieces to look at."""

MOST_BALLS = 50_000
"""Number of balls of clusters that are looked at together: some MiB."""


class Obstacle(NamedTuple):
    """A piece that stands still, in the base frame.

    Attributes:
        name: Name of the object that it is a piece of.
        rotation: (3, 3).
        translation: (3,), m.
        shape: The piece in its own frame: a convex shape, or balls of a point cloud.
        margin: Least distance asked from it, m; None: none of its own.
    """

    name: str
    rotation: FloatArray
    translation: FloatArray
    shape: Shape | Cluster
    margin: float | None


class Obstacles:
    """The pieces of a scene that have an end, each in a box with rounded edges, and its half spaces.

    Attributes:
        pieces: Those with an end.
        half_spaces: Those without one.
        all: The pieces, and then the half spaces.
        centers: (pieces, 3), m: of the boxes.
        rotations: (pieces, 3, 3): of the boxes.
        halves: (pieces, 3), m: half sides of the boxes.
        radii: (pieces,), m: of their rounded edges.
        normals: (half spaces, 3).
        offsets: (half spaces,), m.
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
        self._sphere_radii = (np.linalg.norm(self.halves, axis=1) + self.radii) * (1.0 + ROUNDING)
        planes = [_plane(piece) for piece in self.half_spaces]
        self.normals = np.array([normal for normal, _ in planes]).reshape(-1, 3)
        self.offsets = np.array([offset for _, offset in planes])

        self._set_balls()
        leaves = k_d_leaves(self.centers, MOST_IN_GROUP)
        self._set_groups([*leaves, *(np.array([len(self.pieces) + k]) for k in range(len(self.half_spaces)))])

    def _set_balls(self) -> None:
        """Keep the balls of clusters, as many of each, the last one several times, about the middles of their boxes."""
        clusters = {row: _balls(piece) for row, piece in enumerate(self.pieces) if isinstance(piece.shape, Cluster)}
        self._balls = clusters
        self._cluster_numbers = np.full(len(self.pieces), -1)
        self._cluster_numbers[list(clusters)] = np.arange(len(clusters))
        counts = np.array([len(balls.radii) for balls in clusters.values()], dtype=int)
        most = int(counts.max(initial=0))
        first = np.cumsum(counts) - counts
        kept = first[:, None] + np.minimum(np.arange(most), counts[:, None] - 1)
        centers = np.concatenate([np.empty((0, 3)), *(balls.centers for balls in clusters.values())])
        self._ball_centers = centers[kept] - self.centers[list(clusters), None]
        self._ball_squares = (self._ball_centers**2).sum(axis=-1)
        self._ball_radii = np.concatenate([np.empty(0), *(balls.radii for balls in clusters.values())])[kept]
        self._ball_reach = float(np.abs(centers).max(initial=0.0))

    def _set_groups(self, members: Sequence[np.ndarray]) -> None:
        """Keep groups of obstacles by the numbers of their members, and spheres about those that are pieces."""
        self._members = np.concatenate([np.empty(0, dtype=int), *members])
        self._group_sizes = np.array([len(rows) for rows in members], dtype=int)
        self._first_members = np.cumsum(self._group_sizes) - self._group_sizes
        of_pieces = members[: len(members) - len(self.half_spaces)]
        radii = [self._sphere_radii[rows, None] for rows in of_pieces]
        low = [(self.centers[rows] - r).min(axis=0) for rows, r in zip(of_pieces, radii, strict=True)]
        high = [(self.centers[rows] + r).max(axis=0) for rows, r in zip(of_pieces, radii, strict=True)]
        self._group_centers = (np.array(low) + np.array(high)).reshape(-1, 3) / 2.0
        reach = [
            (np.linalg.norm(self.centers[rows] - center, axis=1) + self._sphere_radii[rows]).max()
            for rows, center in zip(of_pieces, self._group_centers, strict=True)
        ]
        self._group_radii = np.array(reach) * (1.0 + ROUNDING)

    def group_margins(self, margins: FloatArray) -> FloatArray:
        """Return the largest of the margins (bodies, obstacles) in each group: (bodies, groups), m."""
        largest: FloatArray = np.maximum.reduceat(margins[:, self._members], self._first_members, axis=1)
        return largest

    def group_distances(self, points: FloatArray) -> FloatArray:
        """Bound the distances of points (N, bodies, 3) from groups by spheres about them: (N, bodies, groups), m."""
        heights = points @ self.normals.T - self.offsets
        distances = _sphere_distances(points, self._group_centers, self._group_radii)
        return np.concatenate([distances, heights], axis=2)

    def in_groups(self, groups: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of the obstacles in groups (n,), and for each of them which of the n groups it is in."""
        of, rows = _ranges(self._first_members[groups], self._group_sizes[groups])
        return self._members[rows], of

    def sphere_distances(self, points: FloatArray, rows: np.ndarray) -> FloatArray:
        """Bound the distances of points (n, 3) from obstacles (n,), by spheres about those with an end: (n,), m."""
        distances = np.empty(len(rows))
        is_piece = rows < len(self.pieces)
        pieces, planes = rows[is_piece], rows[~is_piece] - len(self.pieces)
        apart = points[is_piece] - self.centers[pieces]
        distances[is_piece] = np.sqrt((apart**2).sum(axis=1)) - self._sphere_radii[pieces]
        distances[~is_piece] = self.plane_distances(points[~is_piece, None], planes)[:, 0]
        return distances

    def box_distances(self, centers: FloatArray, rows: np.ndarray) -> FloatArray:
        """Compute the distances of points (n, spheres, 3) from the boxes of pieces (n,): (n, spheres), m; 0 inside."""
        inside = (centers - self.centers[rows][:, None]) @ self.rotations[rows]
        np.abs(inside, out=inside)
        inside -= self.halves[rows][:, None]
        np.maximum(inside, 0.0, out=inside)
        distances: FloatArray = np.sqrt((inside**2).sum(axis=-1)) - self.radii[rows][:, None]
        return distances

    def balls(self, row: int) -> Cluster:
        """Return the balls of a piece that is a cluster, in the base frame."""
        return self._balls[row]

    def has_balls(self, rows: np.ndarray) -> np.ndarray:
        """Tell which pieces (n,) are clusters of balls."""
        return np.asarray(self._cluster_numbers[rows] >= 0)

    def ball_distances(self, starts: FloatArray, ends: FloatArray, rows: np.ndarray) -> FloatArray:
        """Compute the distances of line segments (n, 3) from the balls of clusters (n,): (n,), m; rounding included."""
        distances = np.empty(len(rows))
        at_once = max(1, MOST_BALLS // max(1, self._ball_radii.shape[1]))
        for first in range(0, len(rows), at_once):
            part = slice(first, first + at_once)
            distances[part] = self._ball_distances(starts[part], ends[part], rows[part])
        return distances

    def _ball_distances(self, starts: FloatArray, ends: FloatArray, rows: np.ndarray) -> FloatArray:
        """Compute |c - s - u w| - r at the share u of the way w where it is least, all about the cluster's middle."""
        clusters = self._cluster_numbers[rows]
        from_middle, way = starts - self.centers[rows], ends - starts
        products = self._ball_centers[clusters] @ np.stack([from_middle, way], axis=2)
        length = (way**2).sum(axis=1)[:, None]
        along = products[..., 1] - (from_middle * way).sum(axis=1)[:, None]
        shares = np.clip(along / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        squares = self._ball_squares[clusters] + (from_middle**2).sum(axis=1)[:, None]
        squares -= 2.0 * products[..., 0]
        squares -= shares * (2.0 * along - shares * length)
        scale = np.abs(from_middle).sum(axis=1) + np.abs(way).sum(axis=1) + self.halves[rows].sum(axis=1)
        squares -= (ROUNDING * scale**2)[:, None]
        distances = np.sqrt(np.maximum(squares, 0.0, out=squares)) - self._ball_radii[clusters]
        return np.asarray(distances.min(axis=1) - ROUNDING * (1.0 + np.abs(starts).max() + self._ball_reach))

    def plane_distances(self, points: FloatArray, rows: np.ndarray) -> FloatArray:
        """Compute the distances of points (n, spheres, 3) from half spaces (n,): (n, spheres), m, negative inside."""
        heights: FloatArray = (points * self.normals[rows][:, None]).sum(axis=-1) - self.offsets[rows][:, None]
        return heights


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


def _sphere_distances(points: FloatArray, centers: FloatArray, radii: FloatArray) -> FloatArray:
    """Compute the distances of points (..., 3) from spheres (N, 3): (..., N), m; rounding included."""
    scale = np.abs(points).max(initial=0.0) + np.abs(centers).max(initial=0.0)
    squares = (points**2).sum(axis=-1)[..., None] + (centers**2).sum(axis=-1)
    squares -= 2.0 * points @ centers.T
    squares -= ROUNDING * scale**2
    distances: FloatArray = np.sqrt(np.maximum(squares, 0.0)) - radii
    return distances


def _ranges(first: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers from `first` on, `counts` of each (n,), one range after the other, and before them which."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, np.arange(len(of)) - (np.cumsum(counts) - counts)[of] + first[of]


def _rounded_box(shape: Shape | Cluster) -> tuple[FloatArray, FloatArray, float]:
    """Return the middle (3,), half sides (3,) and radius of a box with rounded edges around a shape, in its frame."""
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
