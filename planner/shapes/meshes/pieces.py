"""A mesh as a few convex pieces: cut by planes, with the convex hull of each part.

The hull of each side of a plane contains the surface on that side and the edges of the cut. So the hulls cover the
whole surface, and the inside of a closed one. A single hull of a link with a thin middle and thick ends, such as a
forearm, would fill the space beside the middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.shapes.hulls import LEAST_THICKNESS, ConvexHull, hull_corners, hull_of, hull_volume
from planner.shapes.meshes.mesh import Mesh
from planner.spatial import FloatArray

MOST_PIECES = 6
"""Largest number of convex pieces of a mesh.

With six, the forearm of a UR5 leaves its hollows free; the time of a check grows with the number.
"""

MOST_TIGHT_PIECES = 32
"""Number of convex pieces that a mesh of a scene becomes at most."""

TRIANGLES_OF_PARTS = 200_000
"""Largest number of parts times triangles, so that fine meshes are cut into fewer parts: in a second or two."""

LEAST_DEPTH = 1e-3
"""Depth of a face in the hull of its part, relative to the size of the mesh, above which a cut follows the face."""

SNAPPED = 1e-6
"""Height above a cut, relative to the least depth, up to which a corner is in it."""

JOINED = 1e-6
"""Volume that two parts may fill between them, relative to that of the whole hull, and still are joined."""

MANY_FACES = 500
"""Number of faces of a part along which it may be cut: a half of them the largest, the others of all sizes."""

WORTHWHILE = 0.02
"""Share of the volume of a mesh's hull that a cut has to take off to be made."""

NEARLY_CONVEX = 0.9
"""Volume of a closed mesh relative to its hull's above which no cut is sought."""

CUTS = (0.25, 0.5, 0.75)
"""Heights at which a part may be cut across, as shares of its extent."""

FINER_STEPS = (1 / 8, 1 / 16, 1 / 32)
"""Steps from the best of these cuts, one after the other, to those beside it that are tried, too."""

MANY_CORNERS = 6000
"""Number of corners of triangles beyond which not all edges count when cuts are compared."""

CELLS = 24
"""Number of cells along the longest side of a part, for comparing cuts with one corner of each cell.

The final hulls contain all corners.
"""


def convex_pieces(mesh: Mesh, most: int = MOST_PIECES) -> tuple[ConvexHull, ...]:
    """Cut a mesh into at most `most` convex pieces that cover its surface to within a nanometre.

    The first cut, across x, y or z, is the one that reduces the volume of the hulls most. The function cuts the parts
    in the same way, until no cut reduces the volume much or there are enough pieces.
    """
    return _hulls(_parts(mesh, most))


def tight_pieces(mesh: Mesh, most: int = MOST_TIGHT_PIECES) -> tuple[ConvexHull, ...]:
    """Cut a mesh into convex pieces that cover it like `convex_pieces`, but leave its cavities open.

    A bin needs five cuts before any of them reduces the volume of the hulls. So the function first cuts each connected
    component as in `convex_pieces`, then along its faces deep inside the hull of a part. Then it joins parts where that
    fills no cavity.
    """
    whole = hull_volume(mesh.triangles.reshape(-1, 3))
    components = _components(mesh.triangles)
    if len(components) > most:
        return convex_pieces(mesh, most)
    most = int(np.clip(TRIANGLES_OF_PARTS / len(mesh.triangles), len(components) + MOST_PIECES, most))
    parts = [part for triangles in components for part in _parts(replace(mesh, triangles=triangles), MOST_PIECES)]
    least = LEAST_DEPTH * float(mesh.size.max())
    inner = [_deepest_face(part, least) for part in parts]
    while len(parts) < most and max(face.weight for face in inner) > 0.0:
        number = max(range(len(inner)), key=lambda k: inner[k].weight)
        face, part = inner.pop(number), parts.pop(number)
        heights = part @ face.normal - face.offset
        halves = split_at(part, np.where(np.abs(heights) < SNAPPED * least, 0.0, heights))
        parts += halves
        inner += [_deepest_face(half, least) for half in halves]
    return _hulls(_joined(parts, JOINED * whole))


def _hulls(parts: Sequence[FloatArray]) -> tuple[ConvexHull, ...]:
    return tuple(ConvexHull(np.concatenate([part.reshape(-1, 3), part[0, :1]])) for part in parts)


def _components(triangles: FloatArray) -> list[FloatArray]:
    """Return the triangles (T, 3, 3) of each part of a surface that is connected by corners."""
    from scipy.sparse import coo_array  # here: a process that cuts no mesh stays small
    from scipy.sparse.csgraph import connected_components

    corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    ends = np.concatenate([corners[:, :2], corners[:, 1:]])
    count = int(corners.max()) + 1
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    labels = connected_components(graph, directed=False)[1][corners[:, 0]]
    order = np.argsort(labels, kind="stable")
    return np.split(triangles[order], np.flatnonzero(np.diff(labels[order])) + 1)


class _Face(NamedTuple):
    """The plane normal . x = offset of a face inside the hull of its part, and its area times its depth there, m^3."""

    weight: float
    normal: FloatArray
    offset: float


def _deepest_face(triangles: FloatArray, least: float) -> _Face:
    """Find the face of a part (T, 3, 3) deepest in its hull, at least `least` m; weight 0: none."""
    crosses = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(crosses, axis=1)
    order, half = np.argsort(-areas, kind="stable"), MANY_FACES // 2
    some = np.concatenate([order[:half], order[half :: 1 + len(areas) // half]])
    middles = triangles[some].mean(axis=1)
    hull = hull_of(triangles.reshape(-1, 3))
    if hull is None:  # flat
        return _Face(0.0, np.zeros(3), 0.0)
    depths = -(middles @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    weights = np.where(depths > least, depths * areas[some], 0.0)
    best = int(np.argmax(weights))
    normal = crosses[some[best]] / max(areas[some[best]], np.finfo(np.float64).tiny)
    return _Face(float(weights[best]), normal, float(normal @ middles[best]))


def _joined(parts: list[FloatArray], free: float) -> list[FloatArray]:
    """Join parts whose boxes touch where their common hull fills no more than a volume, m^3, beyond them."""
    corners = [hull_corners(part.reshape(-1, 3)) for part in parts]
    volumes = [
        hull_volume(points) for points in corners
    ]  # of joined parts the sum, so that nothing is filled bit by bit
    apart = free ** (1.0 / 3.0)

    def filled(i: int, j: int) -> float:
        one, other = corners[i], corners[j]
        if ((one.min(axis=0) > other.max(axis=0) + apart) | (other.min(axis=0) > one.max(axis=0) + apart)).any():
            return np.inf
        return hull_volume(np.concatenate([one, other])) - volumes[i] - volumes[j]

    losses = {(i, j): filled(i, j) for j in range(len(parts)) for i in range(j)}
    left = set(range(len(parts)))
    while losses:
        (i, j), loss = min(losses.items(), key=lambda item: item[1])
        if loss > free:
            break
        left.remove(j)
        parts[i] = np.concatenate([parts[i], parts[j]])
        corners[i] = hull_corners(np.concatenate([corners[i], corners[j]]))
        volumes[i] += volumes[j]
        losses = {pair: filled(*pair) if i in pair else loss for pair, loss in losses.items() if j not in pair}
    return [parts[k] for k in sorted(left)]


def _parts(mesh: Mesh, most: int) -> list[FloatArray]:
    """Cut a mesh into parts where that takes most off the volume of their hulls."""
    whole = hull_volume(mesh.triangles.reshape(-1, 3))
    parts = [mesh.triangles]
    if mesh.volume < NEARLY_CONVEX * whole:
        cuts = [_best_cut(mesh.triangles)]
        while len(parts) < most and max(cut.gain for cut in cuts) >= WORTHWHILE * whole:
            number = max(range(len(cuts)), key=lambda k: cuts[k].gain)
            halves = split(parts.pop(number), *cuts.pop(number)[:2])
            parts += halves
            cuts += [_best_cut(half) for half in halves]
    return parts


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
    return split_at(triangles, triangles[:, :, axis] - height)


def split_at(triangles: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut triangles (T, 3, 3) at a plane with corner heights x (T, 3) into those below and those above."""
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
