"""A tree of joint positions, each joined to its parent by a free motion."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray

ROOT = -1
"""The parent row of a root: none."""


class Tree:
    """Joint positions reachable from one of the roots, or that lead to one.

    Attributes:
        positions: (nodes, joints), rad or m: the roots, then the others in the order in which they were found.
        radii: (nodes,), rad or m: largest distance of a random position for growing from each node; infinite at first.
    """

    def __init__(self, roots: FloatArray, weights: FloatArray) -> None:
        """Begin with roots (roots, joints) and the weights (joints,) of a radian or metre of each joint."""
        self._rows, self._radii, self._weights = np.array(roots, dtype=np.float64), np.full(len(roots), np.inf), weights
        self._origins = [ROOT] * len(roots)

    def __len__(self) -> int:
        return len(self._origins)

    @property
    def positions(self) -> FloatArray:
        """The joint positions."""
        return self._rows[: len(self)]

    @property
    def radii(self) -> FloatArray:
        """The radii, which may be changed."""
        return self._radii[: len(self)]

    def nearest(self, positions: FloatArray) -> np.ndarray:
        """Return the rows (N,) of the positions that are nearest to others (N, joints)."""
        from scipy.spatial.distance import cdist  # here only: most processes never need it

        return np.asarray(cdist(positions, self.positions, "sqeuclidean", w=self._weights**2).argmin(axis=1))

    def add(self, position: FloatArray, origin: int) -> int:
        """Add a joint position (joints,) joined to a given row by a free motion; return its row."""
        row = len(self)
        if row == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
            self._radii = np.concatenate([self._radii, np.empty_like(self._radii)])
        self._rows[row], self._radii[row] = position, np.inf
        self._origins.append(origin)
        return row

    def cut(self, row: int) -> None:
        """Remove a position and its descendants; the rows of other positions may change."""
        keep = np.ones(len(self), dtype=bool)
        keep[row] = False
        for later in range(row + 1, len(self)):  # each was added after the one that it was reached from
            keep[later] = self._origins[later] == ROOT or keep[self._origins[later]]
        rows = np.cumsum(keep) - 1
        self._rows, self._radii = self.positions[keep], self.radii[keep]
        kept = [origin for origin, stays in zip(self._origins, keep, strict=True) if stays]
        self._origins = [ROOT if origin == ROOT else int(rows[origin]) for origin in kept]

    def branch(self, row: int) -> list[int]:
        """Return the rows from a position back to its root."""
        rows = [row]
        while self._origins[rows[-1]] != ROOT:
            rows.append(self._origins[rows[-1]])
        return rows
