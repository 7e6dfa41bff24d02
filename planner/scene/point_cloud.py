"""Point clouds as balls in voxels, and the clusters of a k-d tree over them, which bound many balls at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.shapes.shape import MOST_SIZE, InvalidShape, checked_numbers, checked_size
from planner.spatial import FloatArray

MOST_IN_CLUSTER = 64
"""Number of balls in a leaf of the k-d tree.

With fewer there are more boxes; with more each box is looser and has more balls to check.
"""

BALL_ROUNDING = 1e-12
"""Relative amount by which balls are made larger than computed, for the rounding of their own computation."""


class Cluster(NamedTuple):
    """Balls that lie near each other.

    Attributes:
        centers: (N, 3), m.
        radii: (N,), m.
    """

    centers: FloatArray
    radii: FloatArray


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of a sensor, each the centre of a ball.

    Points in one voxel of a grid become one ball, which contains theirs.

    Attributes:
        points: (N, 3), m.
        radius: Radius of the balls, m: half the spacing of the points, or more.
        voxel: Side of a voxel, m; None: the radius.

    Examples:
        >>> import planner
        >>> cloud = planner.PointCloud([[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.5, 0.0, 0.0]], radius=0.01)
        >>> len(cloud.balls.radii)
        2
    """

    points: FloatArray
    radius: float
    voxel: float | None = None

    if TYPE_CHECKING:

        def __init__(self, points: ArrayLike, radius: float, voxel: float | None = None) -> None: ...

    def __post_init__(self) -> None:
        """Check the numbers."""
        points = checked_numbers("points", self.points, (-1, 3))
        if not len(points) or np.abs(points).max() > MOST_SIZE:
            raise InvalidShape("points", f"must not be empty, nor beyond {MOST_SIZE:g} m")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "radius", checked_size("radius", self.radius))
        if self.voxel is not None:
            object.__setattr__(self, "voxel", checked_size("voxel", self.voxel))

    @cached_property
    def balls(self) -> Cluster:
        """One ball a voxel, around the middle of its points."""
        cells = np.floor(self.points / (self.voxel or self.radius)).astype(np.int64)
        order = np.lexsort(cells.T)
        cells = cells[order]
        new = np.append(True, np.any(cells[1:] != cells[:-1], axis=1))
        first, of = np.flatnonzero(new), np.cumsum(new) - 1
        points = self.points[order]
        low, high = (bound.reduceat(points, first, axis=0) for bound in (np.minimum, np.maximum))
        centers = (low + high) / 2.0
        spread = np.maximum.reduceat(np.linalg.norm(points - centers[of], axis=1), first)
        return Cluster(centers, (spread + self.radius) * (1.0 + BALL_ROUNDING))

    @cached_property
    def clusters(self) -> tuple[Cluster, ...]:
        """The leaves of a k-d tree over the balls."""
        centers, radii = self.balls
        return tuple(Cluster(centers[rows], radii[rows]) for rows in k_d_leaves(centers, MOST_IN_CLUSTER))


def k_d_leaves(points: FloatArray, most: int) -> list[np.ndarray]:
    """Return the leaves of a k-d tree, which splits its nodes at the median of their longest side.

    All nodes of a level have the same number of points, and are split together. For this, some points are in two leaves
    until the end.

    Args:
        points: (N, 3), m.
        most: The most points in a leaf.

    Returns:
        The rows of the points in each leaf, every row in one of them.
    """
    count, columns = len(points), np.ascontiguousarray(points.T)
    levels = max(0, int(np.ceil(np.log2(max(count, 1) / most))))
    total = -(-count // 2**levels) * 2**levels
    rows = (np.arange(total) * count // max(total, 1))[None]
    for _ in range(levels):
        of_nodes = np.take(columns, rows, axis=1)
        longest = np.argmax(of_nodes.max(axis=2) - of_nodes.min(axis=2), axis=0)
        along = of_nodes[longest, np.arange(len(rows))]
        half = rows.shape[1] // 2
        rows = np.take_along_axis(rows, np.argpartition(along, half, axis=1), axis=1).reshape(-1, half)
    is_first = np.zeros(total, dtype=bool)
    is_first[np.unique(rows, return_index=True)[1]] = True
    leaves = (leaf[new] for leaf, new in zip(rows, is_first.reshape(rows.shape), strict=True))
    return [leaf for leaf in leaves if len(leaf)]
