"""The convex hull of points."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import coal
import numpy as np
from numpy.typing import ArrayLike

from planner.shapes.shape import (
    BOUND_ROUNDING,
    MOST_SIZE,
    BoundingCapsule,
    InvalidShape,
    Shape,
    checked_numbers,
    with_bounds,
)
from planner.spatial import FloatArray

LEAST_POINTS = 4
"""The least number of points of a hull: the corners of a tetrahedron."""

LEAST_THICKNESS = 1e-4
"""Thickness given to a flat hull, m, below the measuring accuracy of any cell.

Qhull finds no faces of points in one plane, and coal's own hull ends the process.
"""

THICKNESS_ROUNDING = 1e-6
"""Share of this thickness by which rounded corners of a thickened hull may fall short: they are thickened only once."""

MOST_FACES_AT_A_VERTEX = 200
"""Largest number of faces at one vertex, with a reserve below coal's maximum of 254.

The middle of a finely tessellated disc has more, unless Qhull shakes the points a little; so does the tip of a finely
tessellated cone.
"""

BLUNTNESS = 1e-5
"""Width given to a tip with too many faces, m, or relative to the size of a hull longer than a metre."""

FACES_AT_A_BLUNT_TIP = 64
"""Number of the faces of such a tip that each of the corners gets that take its place, as a rule."""


@dataclass(frozen=True, eq=False)
class ConvexHull(Shape):
    """The smallest convex shape around points. Points in a plane, on a line or at a point get a thickness of 0.1 mm.

    A tip with hundreds of faces, as of a finely tessellated cone, is widened by 0.01 mm, or 1e-5 of a longer hull.

    Attributes:
        vertices: The corners of the hull (N, 3), m; points inside of it are left out.

    Examples:
        >>> import planner
        >>> wedge = planner.ConvexHull([[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0, 0, 0.3], [0.01, 0.01, 0.01]])
        >>> len(wedge.vertices)
        4
    """

    vertices: FloatArray

    if TYPE_CHECKING:

        def __init__(self, vertices: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        """Check the points, thicken a flat hull and keep the corners."""
        points = checked_numbers("vertices", self.vertices, (-1, 3))
        if len(points) < LEAST_POINTS:
            raise InvalidShape("vertices", f"are {len(points)}: a hull needs at least {LEAST_POINTS}")
        if np.abs(points).max() > MOST_SIZE:
            raise InvalidShape("vertices", f"are beyond {MOST_SIZE:g} m")
        vertices, faces = _hull(_thickened(points))
        vertices.flags.writeable = faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "_faces", faces)

    @property
    def faces(self) -> np.ndarray:
        """The triangles of the surface (F, 3) by the numbers of their vertices, counterclockwise seen from outside."""
        faces: np.ndarray = self.__dict__["_faces"]
        return faces

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the vertices."""
        support: FloatArray = (np.asarray(directions) @ self.vertices.T).max(axis=1)
        return support

    @cached_property
    def bounding_capsule(self) -> BoundingCapsule:
        """The smallest of the capsules around the principal axes of the vertices, and the ball around their middle."""
        middle = (self.vertices.max(axis=0) + self.vertices.min(axis=0)) / 2.0
        radius = float(np.linalg.norm(self.vertices - middle, axis=1).max())
        candidates = [_around_line(self.vertices, middle, axis) for axis in _principal_axes(self.vertices)]
        smallest = min([BoundingCapsule(middle, middle, radius), *candidates], key=lambda capsule: capsule.volume)
        return smallest._replace(radius=smallest.radius + BOUND_ROUNDING * (radius + np.abs(self.vertices).max()))

    @cached_property
    def geometry(self) -> coal.Convex:
        """The hull as coal has it."""
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        points.extend(list(self.vertices))
        triangles.extend([coal.Triangle(*face) for face in self.faces.tolist()])
        return with_bounds(coal.Convex(points, triangles))


def _thickened(points: FloatArray) -> FloatArray:
    """Return points (N, 3) whose hull is at least `LEAST_THICKNESS` thick in every direction, and contains them."""
    middle = points.mean(axis=0)
    for axis in _principal_axes(points):
        along = (points - middle) @ axis
        if along.max() - along.min() < LEAST_THICKNESS * (1.0 - THICKNESS_ROUNDING):
            points = np.concatenate([points - LEAST_THICKNESS / 2.0 * axis, points + LEAST_THICKNESS / 2.0 * axis])
    return points


def _hull(points: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the corners (N, 3) of the hull of points and its triangles (F, 3), counterclockwise seen from outside.

    Raises:
        InvalidShape: Qhull finds no hull, or one that coal cannot store.
    """
    from scipy.spatial import ConvexHull as Qhull  # here: a process that needs no hull stays small
    from scipy.spatial import QhullError

    middle = (points.max(axis=0) + points.min(axis=0)) / 2.0  # since Qhull shakes by a share of the coordinates
    try:
        hull = Qhull(points)
        if _has_too_many_faces(hull.simplices):
            points = points[hull.vertices]
            hull = Qhull(points - middle, qhull_options="QJ")
        if _has_too_many_faces(hull.simplices):
            points = _blunted(points, hull.simplices, hull.equations[:, :3])
            hull = Qhull(points - middle, qhull_options="QJ")
    except QhullError:
        raise InvalidShape("vertices", "have no hull that can be computed") from None
    if _has_too_many_faces(hull.simplices):
        raise InvalidShape("vertices", f"have a hull with more than {MOST_FACES_AT_A_VERTEX} faces at one of them")
    number = np.full(len(points), -1)
    number[hull.vertices] = np.arange(len(hull.vertices))
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces = number[np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)]
    return points[hull.vertices], faces


def _has_too_many_faces(faces: np.ndarray) -> bool:
    return bool(np.bincount(faces.ravel()).max() > MOST_FACES_AT_A_VERTEX)


def _blunted(points: FloatArray, faces: np.ndarray, normals: FloatArray) -> FloatArray:
    """Put a small polygon around each corner that has too many faces, across its tip.

    Each of the polygon's corners gets the faces that look the way in which it lies. They lie where a share of the faces
    look, and all around, so that the tip is between them.

    Returns:
        Points (M, 3) whose hull contains that of the others, m.
    """
    radius = BLUNTNESS * max(1.0, float(np.ptp(points, axis=0).max()))
    tips = np.flatnonzero(np.bincount(faces.ravel()) > MOST_FACES_AT_A_VERTEX)
    polygons = []
    for tip in tips.tolist():
        around = normals[(faces == tip).any(axis=1)]
        across = np.linalg.svd(around.sum(axis=0)[None])[2][1:]
        towards = np.sort(np.arctan2(*(across @ around.T)))
        angles = np.concatenate([towards[::FACES_AT_A_BLUNT_TIP], [0.0, np.pi / 1.5, -np.pi / 1.5]])
        polygons.append(points[tip] + radius * np.column_stack([np.sin(angles), np.cos(angles)]) @ across)
    return np.concatenate([np.delete(points, tips, axis=0), *polygons])


def hull_volume(points: FloatArray) -> float:
    """Compute the volume of the hull of points (N, 3), m^3; 0: they are flat, or not enough."""
    hull = hull_of(points)
    return 0.0 if hull is None else float(hull.volume)


def hull_corners(points: FloatArray) -> FloatArray:
    """Return the points of (N, 3) that are corners of their hull; all, if they are flat or too few."""
    hull = hull_of(points)
    return points if hull is None else points[hull.vertices]


def hull_of(points: FloatArray) -> Any:
    """Compute Qhull's hull of points (N, 3); None: they are flat, or too few."""
    from scipy.spatial import ConvexHull as Qhull  # here: a process that needs no hull stays small
    from scipy.spatial import QhullError

    with suppress(QhullError):
        return Qhull(points) if len(points) >= LEAST_POINTS else None
    return None


def _around_line(points: FloatArray, middle: FloatArray, axis: FloatArray) -> BoundingCapsule:
    """Return the thinnest, then shortest, capsule around points (N, 3) with its axis on a line."""
    along = (points - middle) @ axis
    off = np.linalg.norm(points - middle - along[:, None] * axis, axis=1)
    radius = float(off.max())
    reach = np.sqrt(np.maximum(radius**2 - off**2, 0.0))  # of a ball around the axis that touches the point, along it
    low, high = float((along + reach).min()), float((along - reach).max())
    low, high = (low, high) if low < high else ((low + high) / 2.0,) * 2
    start, end = middle + low * axis, middle + high * axis
    nearest = np.clip(along, low, high)
    radius = float(np.linalg.norm(points - middle - nearest[:, None] * axis, axis=1).max())
    return BoundingCapsule(start, end, radius)


def _principal_axes(points: FloatArray) -> FloatArray:
    """Return the principal axes (3, 3) of points (N, 3), one a row, the one of the least variance first."""
    return np.linalg.eigh(np.cov(points.T, bias=True))[1].T
