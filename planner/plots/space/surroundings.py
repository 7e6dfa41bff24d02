"""The surroundings of the robot of a plan: objects of its scene and attached objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.quantities import Planned, stops_of
from planner.plots.view import View, joined_names
from planner.scene import HERE, CollisionChecker
from planner.scene.obstacles import Obstacle
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace, Shape
from planner.shapes.surfaces import surface, surface_around
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


SHOWN_SHARE = 0.75
"""Largest distance of objects that a view shows from the robot and its path, as a share of their extent."""

BEGINNING_SHARE = 0.15
"""Part of an object beyond this room that a view shows at least, as a share of the same extent."""

BELOW_PLANE_SHARE = 0.01
"""Distance beyond a half space that a view shows at least, as a share of the same extent."""

POSE_DECIMALS = 6
"""Number of decimals, of m, by which two places of an object are distinguished."""

MOST_NAMES = 12
"""Largest number of objects whose names are written."""

CLOSE_NAMES = 0.03
"""Share of the extent of a view up to which two objects have their names on one line."""

SAME_HEIGHT = 0.01
"""Share of the extent of an object by which its points are as high as its highest one."""

LINE_STEPS = 12
"""Number of points that sample each stretch of a line for hiding by objects."""


def standing_things(checkers: Sequence[CollisionChecker]) -> list[tuple[Thing, set[CollisionChecker]]]:
    """Return each object of the scene, once for each of its places, with the checkers that have it there."""
    poses: dict[tuple[object, ...], tuple[Obstacle, list[CollisionChecker]]] = {}
    for checker in dict.fromkeys(checkers):
        for piece in checker.obstacles.all:
            pose = np.round(np.append(piece.translation, piece.rotation), POSE_DECIMALS).tolist()
            poses.setdefault((id(piece.shape), *pose), (piece, []))[1].append(checker)
    groups: dict[tuple[object, ...], tuple[list[Obstacle], set[CollisionChecker]]] = {}
    for piece, having in poses.values():
        kind = "plane" if isinstance(piece.shape, HalfSpace) else "object"
        groups.setdefault((piece.name, kind, *map(id, having)), ([], set(having)))[0].append(piece)
    return [(thing, having) for pieces, having in groups.values() for thing in _things(pieces)]


def _things(pieces: Sequence[Obstacle]) -> Iterator[Thing]:
    """Yield the objects made of pieces, in the base frame; each half space separately."""
    name, solids, points = pieces[0].name, [], [np.zeros((0, 3))]
    for piece in pieces:
        if isinstance(piece.shape, HalfSpace):
            normal = piece.rotation @ piece.shape.normal
            yield Thing(name, PLANE, plane=(normal, float(piece.shape.offset + normal @ piece.translation)))
        elif isinstance(piece.shape, Cluster):
            points.append(piece.shape.centers @ piece.rotation.T + piece.translation)
        else:
            solids.append(Piece(*surface(piece.shape)).moved(piece.rotation, piece.translation))
    if solids or len(points) > 1:
        yield Thing(name, STANDING, tuple(solids), np.concatenate(points))


def carried_things(checker: CollisionChecker, position: FloatArray) -> list[Thing]:
    """Return the objects that a robot carries at a joint position (joints,)."""
    pieces: dict[str, list[Piece]] = {thing.id: [] for thing in checker.scene.attached}
    rotations, origins = checker.bodies.frames(position[None])
    for body in checker.bodies.pieces:
        if body.name in pieces:
            piece = Piece(*surface(body.shape)).moved(body.rotation, body.translation)
            pieces[body.name].append(piece.moved(rotations[0, body.joint], origins[0, body.joint]))
    return [Thing(name, CARRIED, tuple(own)) for name, own in pieces.items()]


def moving_things(checker: CollisionChecker, time: float) -> list[Thing]:
    """Return the moving objects around a robot at a time, s."""
    things = []
    for thing in checker.moving:
        pose = thing.pose_at(time).to_frame(checker.base or HERE)
        rotation = np.eye(3) if pose.rotation is None else pose.rotation
        surfaces = (Piece(*surface(shape)) for shape in thing.shapes if isinstance(shape, Shape))
        things.append(Thing(thing.id, STANDING, tuple(piece.moved(rotation, pose.position) for piece in surfaces)))
    return things


def surroundings(plan: Planned) -> list[Thing]:
    """Return the objects around the robot at any time of a plan, and its attached objects at every waypoint.

    An object that it takes and puts down stands at its poses before and after. Moving objects are where they are at the
    arrivals at the waypoints.
    """
    if plan.problem.scene is None:
        return []
    checkers = segment_checkers(plan.problem, plan.path.positions)
    things = [thing for thing, _ in standing_things(checkers)]
    for stop in stops_of(plan):
        checker = checkers[min(stop.row, len(checkers) - 1)]
        things += carried_things(checker, plan.path.positions[stop.row]) + moving_things(checker, stop.arrival)
    return things


def grown(low: FloatArray, high: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper ends (3,), m, further apart by a share of their largest distance on each side."""
    more = share * float((high - low).max())
    return low - more, high + more


def shown_points(things: Sequence[Thing], points: FloatArray) -> FloatArray:
    """Return points (N, 3), m, of a robot and of objects near it, which a view must show.

    Of an object that goes on beyond the room around the robot, a view shows the beginning.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    shown, extent = [points], float((high - low).max())
    for thing in things:
        part = thing.within(*grown(low, high, SHOWN_SHARE))
        if part is thing:
            shown.append(part.vertices)
        elif part is not None:
            more = (BELOW_PLANE_SHARE if thing.style == PLANE else BEGINNING_SHARE) * extent
            begins, ends = part.vertices.max(axis=0), part.vertices.min(axis=0)
            shown.append(
                np.stack([np.where(begins < low, begins - more, low), np.where(ends > high, ends + more, high)])
            )
    points = np.concatenate(shown)
    parts = (thing.within(points.min(axis=0), points.max(axis=0)) for thing in things)
    return np.concatenate([points, *(part.vertices for part in parts if part is not None)])


def points_along(line: FloatArray) -> FloatArray:
    """Return sample points (N, 3), m, along a line through points (N, 3), m."""
    if len(line) > LINE_STEPS * LINE_STEPS:
        return line
    shares = np.arange(LINE_STEPS)[:, None, None] / LINE_STEPS
    between: FloatArray = ((1.0 - shares) * line[:-1] + shares * line[1:]).reshape(-1, 3)
    return np.concatenate([between, line[-1:]])


def painted_order(things: Sequence[Thing], view: View) -> list[Thing]:
    """Return objects in the order of painting: half spaces first, then from far to near."""
    return sorted(things, key=lambda thing: (thing.style != PLANE, float(thing.vertices.mean(axis=0) @ view.toward)))


def names_of(things: Sequence[Thing], view: View) -> list[tuple[FloatArray, list[str]]]:
    """Return the names of things, and the points (3,), m, at their tops; none if they are too many."""
    tops: dict[str, FloatArray] = {}
    for thing in things:
        heights = view.project(thing.vertices)[:, 1]
        top = thing.vertices[heights >= heights.max() - SAME_HEIGHT * np.ptp(heights)].mean(axis=0)
        known = tops.get(thing.name, top)
        tops[thing.name] = top if view.project(top)[1] > view.project(known)[1] else known
    if not 0 < len(tops) <= MOST_NAMES:
        return []
    points, everything = np.array([*tops.values()]), np.concatenate([thing.vertices for thing in things])
    distance = CLOSE_NAMES * float(np.linalg.norm(np.ptp(view.project(everything), axis=0)))
    return [(points[row], names) for row, names in joined_names(view.project(points), list(tops), distance)]
