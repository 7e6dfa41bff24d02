"""The surroundings in a view: muted, from far to near, with their names and margins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from planner.plots.planned import Planned
from planner.plots.quantities import MILLIMETRES
from planner.plots.space.solids import CARRIED, MOST_CLOUD_POINTS, PLANE, STANDING, VEIL, Thing
from planner.plots.space.space import BEHIND, LINE_LAYER, Space
from planner.plots.space.surroundings import names_of, painted_order, points_along, shown_points, surroundings
from planner.scene import Scene

SPECK = 0.004
"""Share of the extent of a view below which a thing is drawn as a dot, too: less than two points of a picture."""

BORDER_SHARE = 0.08
"""Width of the border, as a share of the picture, in which names are aligned inwards so that they fit."""

UPPER_HALF = 0.5
"""Share of the height of a picture above which the names of planes are below their edges."""

MOST_MARGINS = 3
"""The largest number of objects whose margins are listed one by one."""


def finish_with_surroundings(space: Space, plan: Planned) -> None:
    """Finish a view of a plan with the objects near the robot and the attached objects."""
    things = surroundings(plan)
    if things:
        space.include(shown_points(things, np.array(space.bounds())))
    space.finish()
    shown = [part for thing in things if (part := thing.within(*space.limits())) is not None]
    _paint(space, painted_order(shown, space.view))
    _write_names(space, [thing for thing in shown if thing.style != CARRIED])
    if plan.problem.scene is not None:
        _tell(space, plan.problem.scene, things, shown)


def _paint(space: Space, things: Sequence[Thing]) -> None:
    """Paint objects in order; objects that hide the robot are painted over it, thinly."""
    low, high = space.limits()
    robot = np.concatenate([points_along(line) for line in space.lines])
    speck = SPECK * float((high - low).max())
    stride = -(-sum(len(thing.points) for thing in things) // MOST_CLOUD_POINTS) or 1
    for number, thing in enumerate(things):
        style, order, gid = thing.style, BEHIND, f"scene.{thing.name}.{number}"
        if thing.style != CARRIED and thing.is_over(robot, space.view):
            style, order = style._replace(opacity=VEIL * style.opacity), LINE_LAYER + 0.5
        if len(thing.points):
            space.cloud(thing.points[::stride], style.edge, f"points.{gid}")
        elif np.ptp(thing.vertices, axis=0).max() < speck:
            space.cloud(thing.vertices.mean(axis=0)[None], style.edge, f"speck.{gid}", size=6.0)
        if thing.pieces:
            order += 0.4 * number / len(things)
            space.area(thing.outlines(space.view), thing.edges(space.view, low, high), style, order, gid)


def _write_names(space: Space, things: Sequence[Thing]) -> None:
    """Write the names of things above them, and of planes in the upper half of the picture below their edges."""
    corners = space.view.project(np.array(np.meshgrid(*zip(*space.limits(), strict=True))).reshape(3, 8).T)
    planes = {thing.name for thing in things if thing.style == PLANE}
    for point, names in names_of(things, space.view):
        at = (space.view.project(point) - corners.min(axis=0)) / np.ptp(corners, axis=0)
        others = f" and {len(names) - 1} more" if len(names) > MOST_MARGINS else ""
        space.name(
            point,
            names[0] + others if others else ", ".join(names),
            "top" if names[0] in planes and at[1] > UPPER_HALF else "bottom",
            "left" if at[0] < BORDER_SHARE else "right" if at[0] > 1.0 - BORDER_SHARE else "center",
        )


def _tell(space: Space, scene: Scene, things: Sequence[Thing], shown: Sequence[Thing]) -> None:
    """Write the kept margins, the attached objects, and the objects too distant to be shown."""
    standing, inside = ({thing.name for thing in some if thing.style != CARRIED} for some in (things, shown))
    carried = sorted({thing.name for thing in shown if thing.style == CARRIED})
    margins = {thing.id: thing.margin for thing in scene.attached} | {thing.id: thing.margin for thing in scene.objects}
    handles: list[Artist] = []
    if inside:
        kept = {name: scene.margin if own is None else own for name, own in margins.items() if name in standing}
        handles.append(Patch(facecolor=STANDING.fill, edgecolor=STANDING.edge, alpha=0.8, label=_margins(kept)))
    if carried:
        label = f"carried: {_listed(carried)}"
        handles.append(Patch(facecolor=CARRIED.fill, edgecolor=CARRIED.edge, alpha=0.8, label=label))
    if far := sorted(standing - inside - set(carried)):
        handles.append(Line2D([], [], linestyle="", label=f"out of the picture: {_listed(far)}"))
    if handles:
        space.legend(handles)


def _listed(names: Sequence[str]) -> str:
    """List names, or count them if they are many."""
    return ", ".join(names) if len(names) <= MOST_MARGINS else f"{len(names)} things"


def _margins(kept: dict[str, float]) -> str:
    """Return the text of the margins, m, kept from named objects."""
    margins = {name: margin * MILLIMETRES for name, margin in kept.items()}
    values = sorted(set(margins.values()))
    if len(values) == 1:
        return f"scene, margin {values[0]:.4g} mm"
    if len(margins) <= MOST_MARGINS:
        return "scene, margins: " + ", ".join(f"{name} {margin:.4g} mm" for name, margin in margins.items())
    return f"scene, margins from {values[0]:.4g} to {values[-1]:.4g} mm"
