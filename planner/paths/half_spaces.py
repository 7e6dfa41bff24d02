"""Half-spaces of joint positions, in which a search is to keep a motion that would collide without."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class HalfSpaces:
    """Half-spaces in which the joint positions q are to be at evenly spaced shares of each segment's time.

    There normal . q >= offset.

    Attributes:
        normals: (segments, shares, rows, joints), unit vectors; zero where there is no half-space.
        offsets: (segments, shares, rows), rad or m; -1 where there is none.
    """

    normals: FloatArray
    offsets: FloatArray

    @property
    def rows(self) -> int:
        """The largest number of half-spaces at one share."""
        return int(self.offsets.shape[2])

    def joined(self, other: HalfSpaces) -> HalfSpaces:
        """Return these and others of the same segments and shares."""
        normals = np.concatenate([self.normals, other.normals], axis=2)
        offsets = np.concatenate([self.offsets, other.offsets], axis=2)
        is_one = normals.any(axis=3)
        order = np.argsort(~is_one, axis=2, kind="stable")[:, :, : is_one.sum(axis=2).max()]
        return HalfSpaces(
            np.take_along_axis(normals, order[..., None], axis=2), np.take_along_axis(offsets, order, axis=2)
        )

    def at(self, segments: np.ndarray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the normals (n, rows, joints) and offsets (n, rows) nearest to shares (n,) of segments (n,)."""
        nearest = np.rint(shares * (self.offsets.shape[1] - 1)).astype(int)
        return self.normals[segments, nearest], self.offsets[segments, nearest]
