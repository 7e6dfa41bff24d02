"""Cheap lower bounds of the distances of pairs, by numpy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.robots import Robot
from planner.scene import CollisionChecker, Scene
from planner.scene.bodies import SPHERES, Placements
from planner.scene.obstacles import Obstacles
from planner.scene.point_cloud import Cluster
from planner.shapes import Shape
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

MOST_BALLS = 50_000
"""Number of balls of clusters that are evaluated together: some MiB."""

UNKNOWN = -1e9
"""The lower bound of unknown distances, m."""

MOST_LOOKED_AT = 64
"""Number of groups of obstacles, and then of obstacles in them, in the search for the nearest."""


class Items(NamedTuple):
    """Pairs of pieces at joint positions, one per row."""

    rows: np.ndarray
    pairs: np.ndarray


class ReferenceObstacles(Obstacles):
    """Obstacles with bounds of distances by numpy."""

    def prepare(self) -> None:
        """Prepare the arrays of the bounds."""
        self._sphere_radii = self.sphere_radii
        self._members, self._group_sizes = self.members, np.diff(self.group_ends, prepend=0)
        self._first_members = self.group_ends - self._group_sizes
        balls = self.group_balls()[: len(self.group_ends) - len(self.half_spaces)]
        self._group_centers, self._group_radii = balls[:, :3], balls[:, 3]
        self._set_balls()

    def _set_balls(self) -> None:
        """Store the balls of clusters about their boxes' middles, repeating the last ball up to a common number."""
        clusters = self._balls
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

    def group_distances(self, points: FloatArray) -> FloatArray:
        """Bound the distances of points (N, bodies, 3) from groups by spheres about them: (N, bodies, groups), m."""
        heights = points @ self.normals.T - self.offsets
        distances = _sphere_distances(points, self._group_centers, self._group_radii)
        return np.concatenate([distances, heights], axis=2)

    def in_groups(self, groups: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of the obstacles in groups (n,), and for each the index of its group."""
        of, rows = _ranges(self._first_members[groups], self._group_sizes[groups])
        return self._members[rows], of

    def sphere_distances(self, points: FloatArray, rows: np.ndarray) -> FloatArray:
        """Bound the distances of points (n, 3) from obstacles (n,), by spheres about bounded ones: (n,), m."""
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
        """Compute |c - s - u w| - r at the nearest share u of the way w, about the cluster's middle."""
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


class ReferenceChecker(CollisionChecker):
    """A checker with bounds of distances by numpy."""

    obstacles: ReferenceObstacles

    def __init__(self, robot: Robot, scene: Scene | None = None, *, self_collision: bool | None = None) -> None:
        super().__init__(robot, scene, self_collision=self_collision)
        self.obstacles.__class__ = ReferenceObstacles
        self.obstacles.prepare()
        self._joints = np.append(self.bodies.joints, np.zeros(len(self.obstacles.all), dtype=int))
        moved = self.bodies.is_moved
        self._by_second = moved[self.second] & ~moved[self.first]
        self._by_first = moved[self.first] & ~moved[self.second]

    def all_pairs(self) -> np.ndarray:
        """Return the numbers (n,) of all checked pairs."""
        among = np.flatnonzero(np.isfinite(self.margins))
        return np.concatenate([np.arange(self.own_pairs), self.own_pairs + among])

    def own_items(self, count: int) -> Items:
        """Return all pairs of moving pieces, at a number of joint positions."""
        rows, pairs = np.divmod(np.arange(count * self.own_pairs), max(self.own_pairs, 1))
        return Items(rows, pairs)

    def nearest_item(self, placements: Placements, wanted: FloatArray) -> tuple[int, int]:
        """Return row and number of the pair with an obstacle whose bound is the least."""
        centers, radii = self._spheres(placements)
        low = self.obstacles.group_distances(centers) - radii[..., None]
        low[:, ~np.isfinite(self.obstacles.group_margins(wanted))] = np.inf
        nearest = _least(low.ravel(), MOST_LOOKED_AT)
        rows, bodies, groups = np.unravel_index(nearest[np.isfinite(low.ravel()[nearest])], low.shape)
        obstacles, of = self.obstacles.in_groups(groups)
        requested = np.isfinite(wanted[bodies[of], obstacles])
        rows, bodies, obstacles = rows[of[requested]], bodies[of[requested]], obstacles[requested]
        low = self.obstacles.sphere_distances(centers[rows, bodies], obstacles) - radii[rows, bodies]
        nearest = _least(low, MOST_LOOKED_AT)
        pairs = self.own_pairs + bodies * len(self.obstacles.all) + obstacles
        items = Items(rows[nearest], pairs[nearest])
        best = np.argmin(self._scene_bounds(placements, items, np.full(len(nearest), np.inf)))
        return int(items.rows[best]), int(items.pairs[best])

    def numpy_near_items(self, placements: Placements, moved: FloatArray, wanted: FloatArray) -> tuple[Items, float]:
        """Find the pairs with obstacles that spheres about groups, and then about obstacles, leave too near."""
        centers, radii = self._spheres(placements)
        reach = radii + moved
        low = self.obstacles.group_distances(centers) - reach[..., None]
        wanted_of_groups = self.obstacles.group_margins(wanted)
        left = low < wanted_of_groups
        least = low[~left & np.isfinite(wanted_of_groups)].min(initial=np.inf)
        rows, bodies, groups = np.nonzero(left)
        obstacles, of = self.obstacles.in_groups(groups)
        rows, bodies = rows[of], bodies[of]
        low = self.obstacles.sphere_distances(centers[rows, bodies], obstacles) - reach[rows, bodies]
        requested = wanted[bodies, obstacles]
        left = low < requested
        least = low[~left & np.isfinite(requested)].min(initial=least)
        pairs = self.own_pairs + bodies[left] * len(self.obstacles.all) + obstacles[left]
        return Items(rows[left], pairs), float(least)

    def _spheres(self, placements: Placements) -> tuple[FloatArray, FloatArray]:
        """Return the centers (N, bodies, 3) and radii (N, bodies) of spheres about the bodies, m."""
        ends = placements.spheres[:, :, [0, -1]]
        centers = ends.sum(axis=2) / 2.0
        return centers, np.linalg.norm(ends[:, :, 1] - centers, axis=-1) + self.bodies.radii

    def bounds(self, placements: Placements, items: Items, enough: FloatArray) -> FloatArray:
        """Bound the signed distances of pairs from below."""
        low = np.empty(len(items.rows))
        own = items.pairs < self.own_pairs
        if own.any():
            low[own] = self._own_bounds(placements, Items(items.rows[own], items.pairs[own]))
        if not own.all():
            low[~own] = self._scene_bounds(placements, Items(items.rows[~own], items.pairs[~own]), enough[~own])
        return low

    def _scene_bounds(self, placements: Placements, items: Items, enough: FloatArray) -> FloatArray:
        """Bound the distances of pairs with obstacles: by boxes first, then by the balls of undecided clusters."""
        bodies, obstacles = np.divmod(items.pairs - self.own_pairs, len(self.obstacles.all))
        spheres = covering_spheres(placements)[items.rows, bodies]
        low = np.empty(len(items.rows))
        boxed = obstacles < len(self.obstacles.pieces)
        near = self.obstacles.box_distances(spheres[boxed], obstacles[boxed]).min(axis=1)
        half_steps = np.linalg.norm(spheres[boxed, -1] - spheres[boxed, 0], axis=1) / (SPHERES - 1) / 2.0
        near -= np.hypot(self.bodies.radii[bodies[boxed]], half_steps) * (1.0 + ROUNDING)
        low[boxed] = np.where(near >= 0.0, near, UNKNOWN)  # boxes that are met say nothing of how deep pieces overlap
        planes = obstacles[~boxed] - len(self.obstacles.pieces)
        heights = self.obstacles.plane_distances(spheres[~boxed], planes).min(axis=1)
        low[~boxed] = heights - self.bodies.radii[bodies[~boxed]]
        left = np.flatnonzero(boxed & (low < enough))
        left = left[self.obstacles.has_balls(obstacles[left])]
        balls = self.obstacles.ball_distances(spheres[left, 0], spheres[left, -1], obstacles[left])
        low[left] = np.maximum(low[left], balls - self.bodies.radii[bodies[left]])
        return low

    def _own_bounds(self, placements: Placements, items: Items) -> FloatArray:
        first, second = self.first[items.pairs], self.second[items.pairs]
        ends = (placements.spheres[items.rows, body][:, k] for body in (first, second) for k in (0, -1))
        radii: FloatArray = self.bodies.radii[first] + self.bodies.radii[second]
        return segment_distances(*ends) - radii

    def motions(self, displacements: FloatArray, items: Items) -> FloatArray:
        """Bound the decrease of the distances of pairs by displacements (N, bodies, joints): (n,), m."""
        moved = np.empty(len(items.rows))
        own = items.pairs < self.own_pairs
        rows, pairs = items.rows[own], items.pairs[own]
        of_second = (displacements[rows, self.second[pairs]] * self._by_second[pairs]).sum(axis=1)
        of_first = (displacements[rows, self.first[pairs]] * self._by_first[pairs]).sum(axis=1)
        moved[own] = of_first + of_second
        bodies = (items.pairs[~own] - self.own_pairs) // max(len(self.obstacles.all), 1)
        moved[~own] = displacements.sum(axis=2)[items.rows[~own], bodies]
        return moved

    def joints_of(self, pairs: np.ndarray) -> np.ndarray:
        """Return the numbers of the joints (n, 2) that move the two pieces of pairs; 0: an obstacle's."""
        joints: np.ndarray = self._joints[self.numbers_of(pairs)]
        return joints

    def placed_shape(self, number: int) -> tuple[int, FloatArray, FloatArray, Shape | Cluster]:
        """Return the joint, and in its frame the rotation (3, 3), translation (3,) and shape of a body or obstacle."""
        if number < len(self.bodies.pieces):
            piece = self.bodies.pieces[number]
            return piece.joint, piece.rotation, piece.translation, piece.shape
        obstacle = self.obstacles.all[number - len(self.bodies.pieces)]
        return 0, obstacle.rotation, obstacle.translation, obstacle.shape


def covering_spheres(placements: Placements) -> FloatArray:
    """Return the centers (N, bodies, SPHERES, 3) of spheres along the axes of the bodies' capsules."""
    starts, ends = placements.spheres[:, :, 0], placements.spheres[:, :, -1]
    shares = np.linspace(0.0, 1.0, SPHERES)[:, None]
    return np.asarray(starts[:, :, None] + shares * (ends - starts)[:, :, None])


def _sphere_distances(points: FloatArray, centers: FloatArray, radii: FloatArray) -> FloatArray:
    """Compute the distances of points (..., 3) from spheres (N, 3): (..., N), m; rounding included."""
    scale = np.abs(points).max(initial=0.0) + np.abs(centers).max(initial=0.0)
    squares = (points**2).sum(axis=-1)[..., None] + (centers**2).sum(axis=-1)
    squares -= 2.0 * points @ centers.T
    squares -= ROUNDING * scale**2
    distances: FloatArray = np.sqrt(np.maximum(squares, 0.0)) - radii
    return distances


def _ranges(first: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers from `first`, `counts` of each (n,), range after range, and the range of each number."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, np.arange(len(of)) - (np.cumsum(counts) - counts)[of] + first[of]


def _least(numbers: FloatArray, most: int) -> np.ndarray:
    """Return the rows of the `most` least numbers (n,), in ascending order of rows."""
    return np.sort(np.argpartition(numbers, most)[:most]) if len(numbers) > most else np.arange(len(numbers))


PARALLEL = 1e-12
"""Squared sine of the angle between two segments below which they count as parallel."""


def segment_distances(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Bound the distances of segments a to b from segments c to d, exactly unless they nearly meet.

    The nearest points (Ericson, Real-Time Collision Detection, 5.1.9) suggest a direction. The segments leave each
    other along it by no more than their distance, however well the points were found.
    """
    u, v, r = b - a, d - c, a - c
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    ur, vr = _dot(u, r), _dot(v, r)
    area = uu * vv - uv * uv
    skew = area > PARALLEL * uu * vv
    s = np.where(skew, np.clip((uv * vr - ur * vv) / np.where(skew, area, 1.0), 0.0, 1.0), 0.0)
    has_u, has_v = uu > 0.0, vv > 0.0
    t = np.where(has_v, np.clip((uv * s + vr) / np.where(has_v, vv, 1.0), 0.0, 1.0), 0.0)
    s = np.where(has_u, np.clip((uv * t - ur) / np.where(has_u, uu, 1.0), 0.0, 1.0), 0.0)
    way = r + s[:, None] * u - t[:, None] * v
    length = np.sqrt(_dot(way, way))
    normal = way / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    nearest = np.minimum(_dot(normal, a), _dot(normal, b))
    return nearest - np.maximum(_dot(normal, c), _dot(normal, d))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    products: FloatArray = np.einsum("ij,ij->i", a, b)
    return products
