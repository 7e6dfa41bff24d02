"""The surroundings of the robot of a plan: objects of its scene and attached objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.planned import Planned, stops_of
from planner.plots.space.solids import CARRIED, PLANE, STANDING, Piece, Thing
from planner.plots.view import View, joined_names
from planner.scene import CollisionChecker
from planner.scene.obstacles import Obstacle
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace
from planner.shapes.surfaces import surface
from planner.spatial import FloatArray

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


def surroundings(plan: Planned) -> list[Thing]:
    """Return the objects around the robot at any time of a plan, and its attached objects at every waypoint.

    An object that it takes and puts down stands at its poses before and after.
    """
    if plan.problem.scene is None:
        return []
    checkers = segment_checkers(plan.problem, plan.path.positions)
    things = [thing for thing, _ in standing_things(checkers)]
    for stop in stops_of(plan):
        things += carried_things(checkers[min(stop.row, len(checkers) - 1)], plan.path.positions[stop.row])
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
