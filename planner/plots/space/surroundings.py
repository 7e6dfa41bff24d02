"""What stands around the robot of a plan, and what it carries, as a view shows it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.planned import stops_of
from planner.plots.space.solids import Solid
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace
from planner.shapes.surfaces import surface, surface_around
from planner.spatial import rotation_with_z_along

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.plots.planned import Planned
    from planner.scene import CollisionChecker
    from planner.scene.obstacles import Obstacle
    from planner.shapes import Shape
    from planner.spatial import FloatArray

ROOM = 0.75
"""How much of its surroundings a view shows on each side of the robot and its path, as a share of their extent."""

POSE_DECIMALS = 6
"""Number of decimals, of m, by which two places of a thing are told apart."""

PATCH_THICKNESS = 3e-4
"""Thickness of a drawn plane, as a share of the extent of the view."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What stands around a robot and what it carries, in the base frame.

    Attributes:
        solids: Convex pieces, whole or what of them is in the view.
        planes: Half spaces by their names, the normals (3,) out of them and their offsets, m.
        clouds: Points that were seen (N, 3), m, by the names of what they are of.
        margins: Least distance, m, that is kept from each thing that stands, by its name.
    """

    solids: tuple[Solid, ...]
    planes: tuple[tuple[str, FloatArray, float], ...]
    clouds: tuple[tuple[str, FloatArray], ...]
    margins: dict[str, float]

    def within(self, low: FloatArray, high: FloatArray) -> Surroundings:
        """Return what of it is between lower and upper ends (3,), m."""
        solids = [part for solid in self.solids if (part := within(solid, low, high)) is not None]
        middle = 0.5 * (low + high)
        planes = [plane for plane in self.planes if _holds(low, high, foot_of(plane, middle))]
        inside = [(name, points[((points >= low) & (points <= high)).all(axis=1)]) for name, points in self.clouds]
        clouds = [(name, points) for name, points in inside if len(points)]
        return Surroundings(tuple(solids), tuple(planes), tuple(clouds), self.margins)

    def names(self, *, carried: bool) -> set[str]:
        """Return the names of what the robot carries, or of what stands."""
        return {solid.name for solid in self.solids if solid.carried == carried}


def surroundings(plan: Planned) -> Surroundings:
    """Return what stands around the robot at any time of a plan, and what it carries, at every waypoint.

    What is taken and put down again is where it stands, at the tool, and where it then stands.
    """
    if plan.problem.scene is None:
        return Surroundings((), (), (), {})
    checkers = segment_checkers(plan.problem, plan.path.positions)
    pieces = [piece for piece, _ in standing_pieces(checkers)]
    default = plan.problem.scene.margin
    margins = {piece.name: default if piece.margin is None else piece.margin for piece in pieces}
    solids: list[Solid] = []
    planes: list[tuple[str, FloatArray, float]] = []
    seen: dict[str, list[FloatArray]] = {}
    for piece in pieces:
        if isinstance(piece.shape, Cluster):
            seen.setdefault(piece.name, []).append(piece.shape.centers @ piece.rotation.T + piece.translation)
        elif isinstance(piece.shape, HalfSpace):
            planes.append(plane_of(piece, piece.shape))
        else:
            solids.append(solid_of(piece, piece.shape))
    for stop in stops_of(plan):
        checker = checkers[min(stop.row, len(checkers) - 1)]
        solids += carried_solids(checker, plan.path.positions[stop.row])
    clouds = tuple((name, np.concatenate(parts)) for name, parts in seen.items())
    return Surroundings(tuple(solids), tuple(planes), clouds, margins)


def standing_pieces(checkers: Sequence[CollisionChecker]) -> list[tuple[Obstacle, list[CollisionChecker]]]:
    """Return each piece of what stands, once for each of its places, with those of checkers that have it there."""
    pieces: dict[tuple[float, ...], tuple[Obstacle, list[CollisionChecker]]] = {}
    for checker in dict.fromkeys(checkers):
        for piece in checker.obstacles.all:
            pose = np.round(np.append(piece.translation, piece.rotation), POSE_DECIMALS).tolist()
            pieces.setdefault((id(piece.shape), *pose), (piece, []))[1].append(checker)
    return list(pieces.values())


def solid_of(piece: Obstacle, shape: Shape) -> Solid:
    """Return a piece of a convex shape, in the base frame."""
    vertices, faces = surface(shape)
    return Solid(piece.name, vertices @ piece.rotation.T + piece.translation, faces)


def plane_of(piece: Obstacle, shape: HalfSpace) -> tuple[str, FloatArray, float]:
    """Return the name of a half space, the normal (3,) out of it and its offset, m, in the base frame."""
    normal = piece.rotation @ shape.normal
    return piece.name, normal, float(shape.offset + normal @ piece.translation)


def carried_solids(checker: CollisionChecker, position: FloatArray) -> Iterator[Solid]:
    """Yield the pieces of what a robot carries at a posture (joints,)."""
    names = {thing.id for thing in checker.scene.attached}
    rotations, origins = checker.bodies.frames(position[None])
    for body in checker.bodies.pieces:
        if body.name in names:
            vertices, faces = surface(body.shape)
            in_joint = vertices @ body.rotation.T + body.translation
            yield Solid(body.name, in_joint @ rotations[0, body.joint].T + origins[0, body.joint], faces, carried=True)


def foot_of(plane: tuple[str, FloatArray, float], point: FloatArray) -> FloatArray:
    """Return the point (3,) of a plane that is nearest to a point (3,), m."""
    _, normal, offset = plane
    foot: FloatArray = point - (normal @ point - offset) * normal
    return foot


def patch(plane: tuple[str, FloatArray, float], low: FloatArray, high: FloatArray) -> Solid | None:
    """Return what of a plane is between lower and upper ends (3,), m, as a thin plate below it."""
    name, normal, _ = plane
    extent = float(np.linalg.norm(high - low))
    axes = rotation_with_z_along(normal)
    corners = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-PATCH_THICKNESS, 0.0])).reshape(3, 8).T * extent
    vertices, faces = surface_around(corners)
    plate = within(Solid(name, vertices @ axes.T + foot_of(plane, 0.5 * (low + high)), faces), low, high)
    return plate and replace(plate, cuts=())


def grown(low: FloatArray, high: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper ends (3,), m, further apart by a share of their largest distance on each side."""
    more = share * float((high - low).max())
    return low - more, high + more


def within(solid: Solid, low: FloatArray, high: FloatArray) -> Solid | None:
    """Return what of a solid is between lower and upper ends (3,), m, if anything is."""
    part: Solid | None = solid
    for axis, lower, upper in zip(np.eye(3), low.tolist(), high.tolist(), strict=True):
        part = part and part.cut(axis, upper)
        part = part and part.cut(-axis, -lower)
    return part


def _holds(low: FloatArray, high: FloatArray, point: FloatArray) -> bool:
    return bool(((point >= low) & (point <= high)).all())
