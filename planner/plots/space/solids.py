"""Convex things as a camera sees them: their outlines and edges, and which of them hides which."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.shapes.surfaces import surface_around

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.plots.space.camera import Camera
    from planner.spatial import FloatArray

SHARP = np.cos(np.radians(30.0))
"""Cosine of the angle between two faces from which on the edge between them is drawn: sides of what is round meet at
less."""

EDGE_ON = 1e-6
"""Cosine between a face and a line of sight, below which the face is seen from neither side."""

TOUCHING = 1e-3
"""Share of the extent of all things by which two of them may overlap and still count as beside each other: less than a
point of a picture."""


MOST_ORDERED = 200
"""The most things whose order is found from planes between any two; more are ordered by their middles."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex thing.

    Attributes:
        name: What it is a piece of.
        vertices: Its corners (N, 3), m.
        faces: The triangles of its surface (F, 3), by the numbers of their corners, counterclockwise from outside.
        carried: Whether it moves with the robot.
        cuts: Planes at which it was cut, normals (3,) and offsets, m: what goes on there has no edge.
    """

    name: str
    vertices: FloatArray
    faces: np.ndarray
    carried: bool = False
    cuts: tuple[tuple[FloatArray, float], ...] = ()

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the faces (F, 3), out of the solid; zero of faces that are lines."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.asarray(normals / np.where(lengths > 0.0, lengths, 1.0), dtype=np.float64)

    @cached_property
    def offsets(self) -> FloatArray:
        """Distances of the faces' planes from the origin along their normals (F,), m."""
        offsets: FloatArray = np.einsum("ij,ij->i", self.normals, self.vertices[self.faces[:, 0]])
        return offsets

    def facing(self, camera: Camera) -> np.ndarray:
        """Return 1 of faces (F,) that a camera sees, -1 of those that are turned away, and 0 of those seen edge-on."""
        sides = camera.sides(self.normals, self.offsets)
        scale = max(1.0, float(np.linalg.norm(camera.eye[:3])))
        return np.asarray(np.where(np.abs(sides) > EDGE_ON * scale, np.sign(sides), 0.0), dtype=int)

    def cut(self, normal: FloatArray, offset: float) -> Solid | None:
        """Return the part in front of which a plane n . x = d is, n . x <= d, unless nothing is left."""
        heights = self.vertices @ normal - offset
        if (heights <= 0.0).all():
            return self
        if (heights >= 0.0).all():
            return None
        a, b = np.concatenate([self.faces, np.roll(self.faces, -1, axis=1)]).reshape(2, -1)
        crossing = (heights[a] < 0.0) & (heights[b] > 0.0)
        a, b = a[crossing], b[crossing]
        share = (heights[a] / (heights[a] - heights[b]))[:, None]
        points = np.concatenate(
            [self.vertices[heights <= 0.0], (1.0 - share) * self.vertices[a] + share * self.vertices[b]]
        )
        return Solid(self.name, *surface_around(points), self.carried, (*self.cuts, (normal, offset)))

    def outline(self, camera: Camera) -> FloatArray:
        """Return the corners (N, 3), m, of what a camera sees of it, counterclockwise."""
        return self.vertices[_hull(camera.project(self.vertices))]

    def edges(self, camera: Camera) -> FloatArray:
        """Return the ends (N, 2, 3), m, of edges that a camera sees: sharp ones, and where the surface turns away.

        Where it was cut, a face that is seen goes on and has no edge.
        """
        starts, ends = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        of = np.repeat(np.arange(len(self.faces)), 3)
        left_of = {(a, b): face for a, b, face in zip(starts.tolist(), ends.tolist(), of.tolist(), strict=True)}
        pairs = np.array([(a, b, face, left_of.get((b, a), face)) for (a, b), face in left_of.items() if a < b])
        facing = self.facing(camera)
        one, other = facing[pairs[:, 2]] > 0, facing[pairs[:, 3]] > 0
        sharp = np.einsum("ij,ij->i", self.normals[pairs[:, 2]], self.normals[pairs[:, 3]]) < SHARP
        seen = (one != other) | (one & other & sharp)
        cut = self._on_cuts()
        first, second = pairs[:, 2], pairs[:, 3]
        goes_on = (cut[first] & (cut[second] | other)) | (cut[second] & (cut[first] | one))
        return np.asarray(self.vertices[pairs[seen & ~goes_on, :2]], dtype=np.float64)

    def _on_cuts(self) -> np.ndarray:
        """Tell which faces (F,) it has from where it was cut."""
        on_cuts = np.zeros(len(self.faces), dtype=bool)
        slack = TOUCHING * float(np.ptp(self.vertices, axis=0).max())
        for normal, offset in self.cuts:
            on_cuts |= (np.abs(self.vertices[self.faces] @ normal - offset) < slack).all(axis=1)
        return on_cuts

    def hidden(self, points: FloatArray, camera: Camera) -> tuple[int, int]:
        """Count the points (N, 3), m, that it hides from a camera, and those that hide it."""
        outline = camera.project(self.outline(camera))
        seen = camera.project(points)
        along = np.roll(outline, -1, axis=0) - outline
        apart = seen[:, None] - outline
        inside = (along[:, 0] * apart[..., 1] - along[:, 1] * apart[..., 0] >= 0.0).all(axis=1)
        heights = points[inside] @ self.normals.T - self.offsets
        facing = self.facing(camera)
        in_front = (heights[:, facing > 0] > 0.0).any(axis=1)
        behind = (heights[:, facing < 0] > 0.0).any(axis=1) & ~in_front
        return int(behind.sum()), int(in_front.sum())


def painted_order(solids: Sequence[Solid], camera: Camera) -> list[int]:
    """Return the numbers of solids in an order in which each may be painted over those before it.

    A plane through a face of one with another one beyond it tells which one cannot hide the other: that on the side
    away from the eye. Where no such order is found, the farthest one comes first.

    Args:
        solids: Things that are beside each other.
        camera: Where they are seen from.
    """
    count = len(solids)
    nearness = np.array([camera.nearness(solid.vertices.mean(axis=0)) for solid in solids])
    if count > MOST_ORDERED:
        return list(np.argsort(nearness, kind="stable").tolist())
    may_hide = _may_hide(solids, camera)
    left, order = np.ones(count, dtype=bool), []
    while left.any():
        free = left & ~may_hide[:, left].any(axis=1)
        candidates = np.flatnonzero(free if free.any() else left)
        order.append(int(candidates[np.argmin(nearness[candidates])]))
        left[order[-1]] = False
    return order


def _may_hide(solids: Sequence[Solid], camera: Camera) -> np.ndarray:
    """Tell which of solids (N,) may hide which (N, N): false where a plane between the two proves that it cannot."""
    boxes = [camera.project(solid.vertices) for solid in solids]
    low, high = (np.array([bound(box, axis=0) for box in boxes]).reshape(-1, 2) for bound in (np.min, np.max))
    overlap = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
    may_hide = overlap & ~np.eye(len(solids), dtype=bool)
    slack = TOUCHING * max((float(np.ptp(solid.vertices, axis=0).max()) for solid in solids), default=0.0)
    facing = [solid.facing(camera) for solid in solids]
    for first, second in np.argwhere(may_hide).tolist():
        gaps = (solids[second].vertices @ solids[first].normals.T - solids[first].offsets).min(axis=0)
        between = facing[first][gaps > -slack]
        may_hide[first, second] &= not (between >= 0).any()
        may_hide[second, first] &= not (between <= 0).any()
    return may_hide


def _hull(points: FloatArray) -> list[int]:
    """Return the numbers of the corners of the hull of points (N, 2), counterclockwise (Andrew's monotone chain)."""
    order = np.lexsort(points.T[::-1]).tolist()
    rows = points.tolist()
    half: list[list[int]] = []
    for numbers in (order, order[::-1]):
        chain: list[int] = []
        for number in numbers:
            while len(chain) > 1 and _turn(rows[chain[-2]], rows[chain[-1]], rows[number]) <= 0.0:
                chain.pop()
            chain.append(number)
        half.append(chain[:-1])
    return [*half[0], *half[1]]


def _turn(a: list[float], b: list[float], c: list[float]) -> float:
    """Return twice the area of a triangle, positive if it is counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
