"""A mesh as a few convex pieces: cut by planes, with the convex hull of each part.

What is left of the surface on each side of a plane, and the edges of the cut itself, are in the hull of that side: the
hulls cover the whole surface, and the inside of one that is closed. One hull of a link that has a thin middle and thick
ends, as forearms have, would fill the space beside the middle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.shapes.hulls import LEAST_THICKNESS, ConvexHull, hull_volume

if TYPE_CHECKING:
    from planner.shapes.meshes.mesh import Mesh
    from planner.spatial import FloatArray

MOST_PIECES = 6
"""Number of convex pieces that a mesh becomes at most: with six the forearm of a UR5 leaves the places free that it
does not reach, and the time that a check takes grows with it."""

WORTHWHILE = 0.02
"""Share of the volume of a mesh's hull that a cut has to take off to be made."""

NEARLY_CONVEX = 0.9
"""Volume of a closed mesh relative to its hull's from which on no cut is looked for."""

CUTS = (0.25, 0.5, 0.75)
"""Heights at which a part may be cut across, as shares of its extent."""

FINER_STEPS = (1 / 8, 1 / 16, 1 / 32)
"""Steps from the best of these cuts, one after the other, to those beside it that are tried, too."""

MANY_CORNERS = 6000
"""Number of corners of triangles beyond which not all edges count when cuts are compared."""

CELLS = 24
"""Number of cells along the longest side of a part, of each of which one corner counts when cuts are compared; the
hulls of the pieces in the end are those of all corners."""


def convex_pieces(mesh: Mesh, most: int = MOST_PIECES) -> tuple[ConvexHull, ...]:
    """Cut a mesh into convex pieces that cover its surface to within a nanometre.

    The cut, across x, y or z, that takes most off the volume of the hulls is made first; and so on with the parts,
    until no cut takes off much or there are enough pieces.

    Args:
        mesh: The triangles.
        most: Number of pieces that there may be.
    """
    whole = hull_volume(mesh.triangles.reshape(-1, 3))
    parts = [mesh.triangles]
    if mesh.volume < NEARLY_CONVEX * whole:
        cuts = [_best_cut(mesh.triangles)]
        while len(parts) < most and max(cut.gain for cut in cuts) >= WORTHWHILE * whole:
            number = max(range(len(cuts)), key=lambda k: cuts[k].gain)
            halves = split(parts.pop(number), *cuts.pop(number)[:2])
            parts += halves
            cuts += [_best_cut(half) for half in halves]
    return tuple(ConvexHull(np.concatenate([part.reshape(-1, 3), part[0, :1]])) for part in parts)


class _Cut(NamedTuple):
    """A plane across a part, and the volume by which the hulls beside it are less than one hull of both, m^3."""

    axis: int
    height: float
    gain: float


def _best_cut(triangles: FloatArray) -> _Cut:
    """Find the plane across triangles (T, 3, 3) that takes most off the volume of their hull."""
    corners, following = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    low, size = corners.min(axis=0), np.ptp(corners, axis=0)
    cells = ((corners - low) * (CELLS / max(size.max(), LEAST_THICKNESS))).astype(np.int64)
    few = corners[np.unique(cells @ [1, CELLS + 1, (CELLS + 1) ** 2], return_index=True)[1]]
    whole = hull_volume(few)

    def cut(axis: int, share: float) -> _Cut:
        height = float(low[axis] + share * size[axis])
        a, b = corners[:, axis] - height, following[:, axis] - height
        crossing = np.flatnonzero(a * b < 0.0)[:: 1 + len(corners) // MANY_CORNERS]
        along = (a[crossing] / (a[crossing] - b[crossing]))[:, None]
        on_plane = corners[crossing] + along * (following[crossing] - corners[crossing])
        sides = few[few[:, axis] <= height], few[few[:, axis] >= height]
        return _Cut(axis, height, whole - sum(hull_volume(np.concatenate([side, on_plane])) for side in sides))

    best = max(((cut(axis, share), share) for axis in range(3) for share in CUTS), key=lambda found: found[0].gain)
    for step in FINER_STEPS:
        beside = [(cut(best[0].axis, share), share) for share in (best[1] - step, best[1] + step)]
        best = max([best, *beside], key=lambda found: found[0].gain)
    return best[0]


def split(triangles: FloatArray, axis: int, height: float) -> tuple[FloatArray, FloatArray]:
    """Cut triangles (T, 3, 3) at the plane x[axis] = height into those below it and those above it."""
    x = triangles[:, :, axis] - height
    lower, upper = (x <= 0.0).all(axis=1), (x >= 0.0).all(axis=1)
    crossing = ~(lower | upper)
    # Turned so that the corner that is alone on its side (a corner in the plane is with neither) comes first.
    cut, signs = triangles[crossing], np.sign(x[crossing])
    lonely = np.argmax(signs * np.where(signs.sum(axis=1) >= 0.0, -1.0, 1.0)[:, None], axis=1)
    order = (lonely[:, None] + np.arange(3)) % 3
    row = np.arange(len(cut))[:, None]
    cut, x = cut[row, order], x[crossing][row, order]
    a, b, c = cut[:, 0], cut[:, 1], cut[:, 2]
    ab, ac = (a + (x[:, :1] / (x[:, :1] - x[:, k : k + 1])) * (other - a) for k, other in ((1, b), (2, c)))
    single = np.stack([a, ab, ac], axis=1)
    double = np.concatenate([np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)])
    first_low = x[:, 0] < 0.0
    twice = np.concatenate([first_low, first_low])
    return (
        np.concatenate([triangles[lower], single[first_low], double[~twice]]),
        np.concatenate([triangles[upper & ~lower], single[~first_low], double[twice]]),
    )
