"""What stands around a robot in motion, and what it carries, as SVG: things come, go and move as they do on the way."""

from __future__ import annotations

from collections import Counter
from html import escape
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.space.camera import Camera
from planner.plots.space.painting import (
    CARRIED,
    MOST_NAMED,
    MOST_POINTS,
    PLANE,
    STANDING,
    VEIL,
    points_along,
    shown_points,
)
from planner.plots.space.solids import painted_order
from planner.plots.space.surroundings import (
    ROOM,
    carried_solids,
    grown,
    patch,
    plane_of,
    solid_of,
    standing_pieces,
    surroundings,
    within,
)
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.plots.planned import Planned
    from planner.plots.space.solids import Solid
    from planner.plots.space.space import Style
    from planner.scene import CollisionChecker
    from planner.spatial import FloatArray

RIM = 0.03
"""Share of the extent of what is shown that things larger than it are cut beyond it."""

MOST_LOOKED_AT = 40
"""The most pictures at which it is seen whether a thing hides the robot."""

CORNERS = 32
"""The number of corners of the outline of what moves: each is where it reaches furthest along one direction."""

DIRECTIONS = np.column_stack([f(2.0 * np.pi * np.arange(CORNERS) / CORNERS) for f in (np.cos, np.sin)])
"""These directions, (CORNERS, 2)."""


class Frames(NamedTuple):
    """The pictures of a motion, evenly apart in time: the segments (T,) and the joint positions (T, joints) then."""

    segments: list[int]
    positions: FloatArray


class Projection(NamedTuple):
    """The camera, and what takes points (..., 3), m, to where they are in the picture (..., 2)."""

    camera: Camera
    project: Callable[[FloatArray], FloatArray]


def projection(directions: Sequence[Sequence[float]], project: Callable[[FloatArray], FloatArray]) -> Projection:
    """Return how things are seen along parallel lines, where directions (2, 3) point to the right and up."""
    matrix = np.zeros((3, 4))
    matrix[:2, :3] = directions
    matrix[2, 3] = 1.0
    return Projection(Camera(matrix), project)


class Painted(NamedTuple):
    """Elements of SVG behind the robot, and those before it."""

    behind: list[str]
    before: list[str]


def with_surroundings(plan: Planned, points: FloatArray) -> FloatArray:
    """Return points (N, 3), m, of a robot in motion with those of what is near, which a view has to show."""
    low, high = points.min(axis=0), points.max(axis=0)
    near = surroundings(plan).within(*grown(low, high, ROOM))
    points = np.concatenate([points, *shown_points(near, low, high)])
    low, high = points.min(axis=0), points.max(axis=0)
    parts = [within(solid, low, high) for solid in near.solids if solid.cuts]
    parts += [patch(plane, low, high) for plane in near.planes]
    return np.concatenate([points, *(part.vertices for part in parts if part)])


def paint_surroundings(
    plan: Planned,
    frames: Frames,
    models: FloatArray,
    shown: FloatArray,
    seen: Projection,
    timing: str,
) -> Painted:
    """Draw what stands around a robot in motion, and what it carries.

    Args:
        plan: The plan.
        frames: The pictures of the motion.
        models: The stick model of the robot at these times (T, N, 3), m: what hides most of it is drawn thinly over it.
        shown: Points (N, 3), m, that are shown: what goes further is cut.
        seen: How it is seen.
        timing: The attributes of every `animate` that say how long it takes.
    """
    checkers = segment_checkers(plan.problem, plan.path.positions)
    around = [checkers[min(segment, len(checkers) - 1)] for segment in frames.segments]
    low, high = grown(shown.min(axis=0), shown.max(axis=0), RIM)
    clock = _Clock(len(around) - 1, timing)
    robot = np.concatenate([points_along(model) for model in models[:: -(-len(models) // MOST_LOOKED_AT)]])
    painted = Painted([], [])
    things: list[tuple[Solid, Style, str]] = []
    for piece, having_it in standing_pieces(checkers):
        when = clock.shown([checker in having_it for checker in around])
        if isinstance(piece.shape, Cluster):
            points = piece.shape.centers @ piece.rotation.T + piece.translation
            inside = points[((points >= low) & (points <= high)).all(axis=1)]
            painted.behind.append(_dots(seen.project(inside), piece.name, when))
        elif isinstance(piece.shape, HalfSpace):
            plate = patch(plane_of(piece, piece.shape), low, high)
            things += [(plate, PLANE, when)] if plate else []
        else:
            part = within(solid_of(piece, piece.shape), low, high)
            things += [(part, STANDING, when)] if part else []
    for number in painted_order([solid for solid, _, _ in things], seen.camera):
        solid, style, when = things[number]
        hidden, in_front = solid.hidden(robot, seen.camera)
        if hidden > in_front:
            painted.before.append(_area(solid, style._replace(opacity=VEIL * style.opacity), seen, when))
        else:
            painted.behind.append(_area(solid, style, seen, when))
    painted.behind.extend(_carried(around, frames.positions, seen, clock))
    painted.before.extend(_names([solid for solid, _, when in things if not when], seen))
    return painted


class _Clock(NamedTuple):
    """The number of the last picture, and the attributes of `animate` that say how long all of them take."""

    last: int
    timing: str

    def animate(self, attribute: str, values: Sequence[str], rows: Sequence[int], more: str = "") -> str:
        """Let an attribute have values at the pictures of such numbers."""
        times = ";".join(f"{row / self.last:.5f}" for row in rows)
        return (
            f'<animate attributeName="{attribute}"{more} {self.timing} keyTimes="{times}" values="{";".join(values)}"/>'
        )

    def shown(self, when: Sequence[bool]) -> str:
        """Show an element on some of the pictures, and hide it on the others."""
        if all(when):
            return ""
        changes = [0, *(row for row in range(1, len(when)) if when[row] != when[row - 1])]
        values = ["visible" if when[row] else "hidden" for row in changes]
        return self.animate("visibility", values, changes, ' calcMode="discrete"')


def _carried(
    around: Sequence[CollisionChecker], positions: FloatArray, seen: Projection, clock: _Clock
) -> Iterator[str]:
    """Draw what a robot carries at joint positions (T, joints), each piece while it is carried."""
    outlines: dict[tuple[str, int], dict[int, str]] = {}
    for row, (checker, position) in enumerate(zip(around, positions, strict=True)):
        pieces: Counter[str] = Counter()
        for solid in carried_solids(checker, position):
            corners = seen.project(solid.vertices)
            outline = _points(corners[(corners @ DIRECTIONS.T).argmax(axis=0)])
            outlines.setdefault((solid.name, pieces[solid.name]), {})[row] = outline
            pieces[solid.name] += 1
    for (name, _), known in outlines.items():
        first, *_, last = [*known.values()] * 2
        inner = [row for row in known if 0 < row < clock.last]
        values = [known.get(0, first), *(known[row] for row in inner), known.get(clock.last, last)]
        yield (
            f'<g data-name="{escape(name)}"><title>{escape(name)}</title>'
            f"{clock.shown([row in known for row in range(clock.last + 1)])}"
            f'<polygon points="{first}" fill="{CARRIED.fill}" fill-opacity="{CARRIED.opacity:g}"'
            f' stroke="{CARRIED.edge}">{clock.animate("points", values, [0, *inner, clock.last])}</polygon></g>'
        )


def _area(solid: Solid, style: Style, seen: Projection, when: str) -> str:
    """Draw the outline of a solid and those of its edges that are seen."""
    outline, edges = seen.project(solid.outline(seen.camera)), seen.project(solid.edges(seen.camera))
    strokes = "".join(f"M{_points(edge)}" for edge in edges)
    return (
        f'<g data-name="{escape(solid.name)}"><title>{escape(solid.name)}</title>{when}'
        f'<polygon points="{_points(outline)}" fill="{style.fill}" fill-opacity="{style.opacity:g}"/>'
        f'<path d="{strokes}" fill="none" stroke="{style.edge}" stroke-width="0.8"/></g>'
    )


def _dots(points: FloatArray, name: str, when: str) -> str:
    """Draw points (N, 2) of a cloud."""
    stride = -(-len(points) // MOST_POINTS) or 1
    dots = "".join(f"M{x:.1f},{y:.1f}h0" for x, y in points[::stride].tolist())
    return (
        f'<g data-name="{escape(name)}"><title>{escape(name)}</title>{when}'
        f'<path d="{dots}" stroke="{STANDING.edge}" stroke-width="1.5" stroke-linecap="round"/></g>'
    )


def _names(solids: Sequence[Solid], seen: Projection) -> Iterator[str]:
    """Write the names of what stands all the time above it, unless they are too many."""
    tops: dict[str, tuple[float, float]] = {}
    for solid in solids:
        x, y = seen.project(solid.vertices).T
        top = float(y.min()), float(x.mean())
        tops[solid.name] = min(tops.get(solid.name, top), top)
    if len(tops) <= MOST_NAMED:
        for name, (y, x) in tops.items():
            yield (
                f'<text x="{x:.1f}" y="{y - 4.0:.1f}" text-anchor="middle" font-family="sans-serif" font-size="11"'
                f' font-style="italic" fill="#6B5A3A">{escape(name)}</text>'
            )


def _points(points: FloatArray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
