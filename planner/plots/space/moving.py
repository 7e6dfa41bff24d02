"""The surroundings of a moving robot as SVG: objects appear, disappear and move along the trajectory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.quantities import Planned
from planner.plots.space.surroundings import (
    CARRIED,
    MOST_CLOUD_POINTS,
    VEIL,
    Thing,
    carried_things,
    grown,
    moving_things,
    names_of,
    painted_order,
    points_along,
    standing_things,
)
from planner.plots.style import svg_points
from planner.plots.view import View
from planner.scene import CollisionChecker
from planner.spatial import FloatArray

RIM = 0.03
"""Share of the extent of the view beyond which larger objects are cut."""

MOST_CHECKED_PICTURES = 40
"""Largest number of pictures checked for an object that hides the robot."""

CARRIED_CORNERS = 32
"""The number of corners of a moving outline; each is the farthest point along one direction."""


class Frames(NamedTuple):
    """The pictures of a motion at equal time steps: segments (T,), joint positions (T, joints) and times (T,), s."""

    segments: list[int]
    positions: FloatArray
    times: FloatArray


class Projection(NamedTuple):
    """The view, and the function from points (..., 3), m, to their places in the picture (..., 2)."""

    view: View
    project: Callable[[FloatArray], FloatArray]


class Painted(NamedTuple):
    """Elements of SVG behind the robot, and those before it."""

    behind: list[str]
    before: list[str]


def paint_surroundings(
    plan: Planned,
    frames: Frames,
    models: FloatArray,
    shown: FloatArray,
    seen: Projection,
    timing: str,
) -> Painted:
    """Draw the scene of a robot in motion, with its attached objects.

    Args:
        plan: The plan.
        frames: The pictures of the motion.
        models: The stick model of the robot at these times (T, N, 3), m; objects that hide most of it are drawn thinly.
        shown: Points (N, 3), m, in the view; objects are cut beyond them.
        seen: The view.
        timing: The attributes of every `animate` with its duration.
    """
    checkers = segment_checkers(plan.problem, plan.path.positions)
    around = [checkers[min(segment, len(checkers) - 1)] for segment in frames.segments]
    low, high = grown(shown.min(axis=0), shown.max(axis=0), RIM)
    clock = _Clock(len(around) - 1, timing)
    robot = np.concatenate([points_along(model) for model in models[:: -(-len(models) // MOST_CHECKED_PICTURES)]])
    painted = Painted([], [])
    things: dict[Thing, str] = {}
    for thing, having_it in standing_things(checkers):
        if (part := thing.within(low, high)) is not None:
            things[part] = clock.shown([checker in having_it for checker in around])
    for thing in painted_order(list(things), seen.view):
        over = thing.is_over(robot, seen.view)
        drawn = _thing(thing, VEIL if over else 1.0, (low, high), seen, things[thing])
        (painted.before if over else painted.behind).append(drawn)
    painted.behind.extend(_moving(around, frames, seen, clock))
    painted.before.extend(_names([thing for thing, when in things.items() if not when], seen))
    return painted


class _Clock(NamedTuple):
    """The number of the last picture, and the attributes of `animate` with the duration of all pictures."""

    last: int
    timing: str

    def animate(self, attribute: str, values: Sequence[str], rows: Sequence[int], more: str = "") -> str:
        """Set the values of an attribute at numbered pictures."""
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


def _moving(around: Sequence[CollisionChecker], frames: Frames, seen: Projection, clock: _Clock) -> Iterator[str]:
    """Draw the attached objects, each while it is attached, and the moving objects."""
    outlines: dict[tuple[str, int], dict[int, str]] = {}
    rows = zip(around, frames.positions, frames.times.tolist(), strict=True)
    for row, (checker, position, time) in enumerate(rows):
        for thing in (*carried_things(checker, position), *moving_things(checker, time)):
            for number, piece in enumerate(thing.pieces):
                outline = svg_points(seen.project(piece.outline(seen.view, CARRIED_CORNERS)))
                outlines.setdefault((thing.name, number), {})[row] = outline
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


def _thing(thing: Thing, share: float, ends: tuple[FloatArray, FloatArray], seen: Projection, when: str) -> str:
    """Draw the outline of an object with a share of its opacity, its edges and its points."""
    style, stride = thing.style, -(-len(thing.points) // MOST_CLOUD_POINTS) or 1
    outlines = "".join(f"M{svg_points(seen.project(outline))}Z" for outline in thing.outlines(seen.view))
    edges = thing.edges(seen.view, *ends) if thing.pieces else ()
    strokes = "".join(f"M{svg_points(seen.project(edge))}" for edge in edges)
    dots = "".join(f"M{x:.1f},{y:.1f}h0" for x, y in seen.project(thing.points[::stride]).tolist())
    return (
        f'<g data-name="{escape(thing.name)}"><title>{escape(thing.name)}</title>{when}'
        + (f'<path d="{outlines}" fill="{style.fill}" fill-opacity="{share * style.opacity:g}"/>' if outlines else "")
        + (f'<path d="{strokes}" fill="none" stroke="{style.edge}" stroke-width="0.8"/>' if strokes else "")
        + (f'<path d="{dots}" stroke="{style.edge}" stroke-width="1.5" stroke-linecap="round"/>' if dots else "")
        + "</g>"
    )


def _names(things: Sequence[Thing], seen: Projection) -> Iterator[str]:
    """Write the names of objects that never move above them, unless they are too many."""
    for point, names in names_of(things, seen.view):
        x, y = seen.project(point)
        yield (
            f'<text x="{x:.1f}" y="{y - 4.0:.1f}" text-anchor="middle" font-family="sans-serif" font-size="11"'
            f' font-style="italic" fill="#6B5A3A">{escape(", ".join(names))}</text>'
        )
