"""The convex pieces of what stands still, and cheap lower bounds of the distances to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.scene.point_cloud import Cluster, PointCloud
from planner.shapes import Capsule, HalfSpace, Sphere
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.scene.scene import SceneObject
    from planner.shapes import Shape
    from planner.spatial import FloatArray, Pose


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
        sphere_radii: (pieces,), m: of spheres about the boxes.
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
        self.sphere_radii = (np.linalg.norm(self.halves, axis=1) + self.radii) * (1.0 + ROUNDING)
        planes = [_plane(piece) for piece in self.half_spaces]
        self.normals = np.array([normal for normal, _ in planes]).reshape(-1, 3)
        self.offsets = np.array([offset for _, offset in planes])

    def sphere_distances(self, centers: FloatArray) -> FloatArray:
        """Bound the distances of points (..., 3) from the pieces by spheres about them: (..., pieces), m."""
        scale = np.abs(centers).max(initial=0.0) + np.abs(self.centers).max(initial=0.0)
        squares = (centers**2).sum(axis=-1)[..., None] + (self.centers**2).sum(axis=-1)
        squares -= 2.0 * centers @ self.centers.T
        squares -= ROUNDING * scale**2
        distances: FloatArray = np.sqrt(np.maximum(squares, 0.0)) - self.sphere_radii
        return distances

    def box_distances(self, centers: FloatArray, rows: np.ndarray) -> FloatArray:
        """Compute the distances of points (n, spheres, 3) from the boxes of pieces (n,): (n, spheres), m; 0 inside."""
        inside = (centers - self.centers[rows][:, None]) @ self.rotations[rows]
        np.abs(inside, out=inside)
        inside -= self.halves[rows][:, None]
        np.maximum(inside, 0.0, out=inside)
        distances: FloatArray = np.sqrt((inside**2).sum(axis=-1)) - self.radii[rows][:, None]
        return distances

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
