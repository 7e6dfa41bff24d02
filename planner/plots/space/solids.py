"""Convex pieces of objects in a view: their outlines and edges, and the points that they hide."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.plots.view import View
from planner.shapes.surfaces import surface_around
from planner.spatial import FloatArray

SHARP = np.cos(np.radians(30.0))
"""Cosine of the least angle between two faces whose edge is drawn; round shapes have smaller angles."""

EDGE_ON = 1e-6
"""Cosine between a face and the line of sight below which the face is not seen."""

ON_BORDER = 1e-6
"""Share of the extent of a box below which a point is on its border."""

OUTLINE_DIRECTIONS = 360
"""Number of directions in which the furthest corner of a piece is part of its outline."""

LEAST_CORNERS = 3
"""Least number of corners of a part of a plane."""

EDGE_PARTS = 6
"""Number of parts of an edge; each part is drawn or hidden."""


def ring(count: int) -> FloatArray:
    """Return directions (count, 2), evenly spaced around a circle."""
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles)])


class Style(NamedTuple):
    """The colours of faces and edges, and the opacity of faces, from 0 to 1."""

    fill: str
    edge: str
    opacity: float


STANDING = Style("#CDB894", "#86714D", 0.4)
"""The style of objects of the scene."""

CARRIED = Style("#8FB3C4", "#3D687D", 0.5)
"""The style of objects that the robot carries."""

PLANE = Style("#DAD3C6", "#B5AA97", 0.35)
"""The style of half spaces."""


VEIL = 0.4
"""Share of its opacity of an object that hides the robot."""

MOST_CLOUD_POINTS = 2000
"""Largest number of points of clouds that are drawn: as many as a picture can tell apart."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A convex body.

    Attributes:
        vertices: Its corners (N, 3), m.
        faces: The triangles of its surface (F, 3) by the numbers of their corners, counterclockwise from outside.
    """

    vertices: FloatArray
    faces: np.ndarray

    @cached_property
    def planes(self) -> tuple[FloatArray, FloatArray]:
        """The unit normals (F, 3) of its faces and their distances (F,), m, from the origin."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(lengths > 0.0, lengths, 1.0)
        return normals, np.einsum("ij,ij->i", normals, a)

    def moved(self, rotation: FloatArray, translation: FloatArray) -> Piece:
        """Return the piece, turned by a rotation (3, 3) and shifted by a translation (3,), m."""
        return Piece(self.vertices @ rotation.T + translation, self.faces)

    def within(self, low: FloatArray, high: FloatArray) -> Piece | None:
        """Return the part inside a box with lower and upper ends (3,), m; None: there is none."""
        piece: Piece | None = self
        for axis, lower, upper in zip(np.eye(3), low.tolist(), high.tolist(), strict=True):
            piece = piece and piece.cut(axis, upper)
            piece = piece and piece.cut(-axis, -lower)
        return piece

    def cut(self, normal: FloatArray, offset: float) -> Piece | None:
        """Return the part where n . x <= d; None: there is none."""
        heights = self.vertices @ normal - offset
        if (heights <= 0.0).all():
            return self
        if (heights >= 0.0).all():
            return None
        a, b = np.concatenate([self.faces, np.roll(self.faces, -1, axis=1)]).reshape(2, -1)
        crossing = (heights[a] < 0.0) & (heights[b] > 0.0)
        a, b = a[crossing], b[crossing]
        share = (heights[a] / (heights[a] - heights[b]))[:, None]
        crossed = (1.0 - share) * self.vertices[a] + share * self.vertices[b]
        return Piece(*surface_around(np.concatenate([self.vertices[heights <= 0.0], crossed])))

    def outline(self, view: View, corners: int = OUTLINE_DIRECTIONS) -> FloatArray:
        """Return the corners (N, 3), m, of its outline in a view, counterclockwise: one of each direction."""
        rows = (view.project(self.vertices) @ ring(corners).T).argmax(axis=0)
        return np.asarray(self.vertices[rows])

    def edges(self, view: View, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return the ends (N, 2, 3), m, of its visible sharp edges and of its outline in a view.

        A visible face goes on beyond the border of a box with lower and upper ends (3,), m, and has no edge there.
        """
        starts, ends = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        of = np.repeat(np.arange(len(self.faces)), 3).tolist()
        left_of = dict(zip(zip(starts.tolist(), ends.tolist(), strict=True), of, strict=True))
        pairs = np.array([(a, b, face, left_of.get((b, a), face)) for (a, b), face in left_of.items() if a < b])
        normals, _ = self.planes
        first, second = pairs[:, 2], pairs[:, 3]
        seen = normals @ view.toward > EDGE_ON
        sharp = np.einsum("ij,ij->i", normals[first], normals[second]) < SHARP
        drawn = (seen[first] != seen[second]) | (seen[first] & sharp)
        corners, slack = self.vertices[self.faces], ON_BORDER * float((high - low).max())
        on_border: np.ndarray = np.concatenate([corners - low, high - corners], axis=2) < slack
        cut = np.any(np.all(on_border, axis=1), axis=1)
        goes_on = (cut[first] & (cut[second] | seen[second])) | (cut[second] & (cut[first] | seen[first]))
        return np.asarray(self.vertices[pairs[drawn & ~goes_on, :2]], dtype=np.float64)

    def sides(self, points: FloatArray, view: View) -> np.ndarray:
        """Return 1 for points (N, 3), m, behind it in a view, -1 for points before it, otherwise 0."""
        sides, own, seen = np.zeros(len(points), dtype=int), view.project(self.vertices), view.project(points)
        near = np.flatnonzero(((seen > own.min(axis=0)) & (seen < own.max(axis=0))).all(axis=1))
        normals, offsets = self.planes
        rates = normals @ view.toward
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings = (offsets - points[near] @ normals.T) / rates
        enters = crossings[:, rates < -EDGE_ON].max(axis=1, initial=-np.inf)
        leaves = crossings[:, rates > EDGE_ON].min(axis=1, initial=np.inf)
        sides[near] = np.where(enters < leaves, np.where(leaves > 0.0, 1, -1), 0)
        return sides


@dataclass(frozen=True, eq=False)
class Thing:
    """An object at one place.

    Attributes:
        name: Its name.
        style: Its style.
        pieces: Its convex pieces.
        points: The points (N, 3), m, of a point cloud.
        plane: The normal (3,) and the offset, m, of a half space.
    """

    name: str
    style: Style
    pieces: tuple[Piece, ...] = ()
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    plane: tuple[FloatArray, float] | None = None

    @cached_property
    def vertices(self) -> FloatArray:
        """All its corners and points (N, 3), m."""
        return np.concatenate([*(piece.vertices for piece in self.pieces), self.points])

    def within(self, low: FloatArray, high: FloatArray) -> Thing | None:
        """Return the part inside a box between ends (3,), m: itself if all is inside; None: nothing."""
        if self.plane is not None:
            corners = _section(*self.plane, low, high)
            if len(corners) < LEAST_CORNERS:
                return None
            plate = surface_around(np.vstack([corners, corners.mean(axis=0)]))  # which takes four points
            return replace(self, pieces=(Piece(*plate),), plane=None)
        inside = ((self.points >= low) & (self.points <= high)).all(axis=1)
        pieces = tuple(part for piece in self.pieces if (part := piece.within(low, high)) is not None)
        if pieces == self.pieces and inside.all():
            return self
        return replace(self, pieces=pieces, points=self.points[inside]) if pieces or inside.any() else None

    def outlines(self, view: View) -> list[FloatArray]:
        """Return the corners (N, 3), m, of the outlines of its pieces in a view."""
        outlines = [piece.outline(view) for piece in self.pieces]
        return [points[(points != np.roll(points, 1, axis=0)).any(axis=1)] for points in outlines]

    def edges(self, view: View, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return the ends (N, 2, 3), m, of its edges in a view of a box between ends (3,), m."""
        ends = (np.full(3, -np.inf), np.full(3, np.inf)) if self.style == PLANE else (low, high)
        return np.concatenate([self._visible(piece, piece.edges(view, *ends), view) for piece in self.pieces])

    def _visible(self, piece: Piece, edges: FloatArray, view: View) -> FloatArray:
        """Return the parts of the edges (N, 2, 3), m, of a piece that no other piece hides."""
        if len(self.pieces) == 1:
            return edges
        shares = np.arange(EDGE_PARTS + 1)[:, None, None] / EDGE_PARTS
        points = (1.0 - shares) * edges[:, 0] + shares * edges[:, 1]
        parts = np.stack([points[:-1], points[1:]], axis=2).reshape(-1, 2, 3)
        for other in self.pieces:
            if other is not piece:
                parts = parts[other.sides(parts.mean(axis=1), view) <= 0]
        return parts

    def is_over(self, points: FloatArray, view: View) -> bool:
        """Tell whether it hides more of the points (N, 3), m, than lie in front of it."""
        return sum(int(piece.sides(points, view).sum()) for piece in self.pieces) > 0


def _section(normal: FloatArray, offset: float, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the corners (N, 3), m, of the part of a plane inside a box."""
    corners = np.array(np.meshgrid(*np.stack([low, high], axis=1))).reshape(3, 8).T
    heights = corners @ normal - offset
    a, b = np.nonzero((corners[:, None] != corners).sum(axis=2) == 1)
    crossing = (heights[a] < 0.0) & (heights[b] > 0.0)
    a, b = a[crossing], b[crossing]
    share = (heights[a] / (heights[a] - heights[b]))[:, None]
    return np.concatenate([corners[heights == 0.0], (1.0 - share) * corners[a] + share * corners[b]])
