"""Outlines of machines: convex shapes by their reach in fixed directions, as rulers around a link measure them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.shapes import ConvexHull
from planner.spatial import FloatArray

OUTLINE_UNCERTAINTY = 0.01
"""Largest distance of a machine's surface outside the outline of its maker's drawings, m: cables, covers, later
changes."""

DIRECTIONS_IN_A_PLANE = 16
"""Number of directions in each of the planes xy, yz and zx: a cylinder along an axis becomes 2 % wider at most."""


def outline_directions() -> FloatArray:
    """Return the unit vectors (42, 3) of an outline: in the planes xy, yz and zx, each direction once."""
    angles = 2.0 * np.pi * np.arange(DIRECTIONS_IN_A_PLANE) / DIRECTIONS_IN_A_PLANE
    c, s, zero = np.round(np.cos(angles), 12), np.round(np.sin(angles), 12), np.zeros(DIRECTIONS_IN_A_PLANE)
    directions = np.concatenate([np.column_stack(plane) for plane in ((c, s, zero), (zero, c, s), (s, zero, c))])
    first = np.unique(directions, axis=0, return_index=True)[1]
    return directions[np.sort(first)]


class Outline(NamedTuple):
    """A convex part of a machine.

    Attributes:
        reach: Largest n . x over the part, of each of the directions (42,), m; positive: the origin is inside.
    """

    reach: tuple[float, ...]

    def hull(self) -> ConvexHull:
        """Return the largest convex shape with this reach."""
        from scipy.spatial import ConvexHull as Qhull  # here: a process that needs no hull stays small

        # The corners are the polars of the faces of the polar hull.
        faces = Qhull(outline_directions() / np.array(self.reach)[:, None]).equations
        return ConvexHull(np.unique(np.round(-faces[:, :3] / faces[:, 3:], 7), axis=0))
