"""Surroundings painted into a view: the farthest first, muted, with their names and the margins that are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from planner.plots.quantities import MILLIMETRES
from planner.plots.space.solids import painted_order
from planner.plots.space.space import BEHIND, LINES, Style
from planner.plots.space.surroundings import ROOM, foot_of, grown, patch, surroundings, within

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.artist import Artist

    from planner.plots.planned import Planned
    from planner.plots.space.camera import Camera
    from planner.plots.space.solids import Solid
    from planner.plots.space.space import Space
    from planner.plots.space.surroundings import Surroundings
    from planner.spatial import FloatArray

STANDING = Style("#CDB894", "#86714D", 0.4)
"""How what stands around the robot is drawn."""

CARRIED = Style("#8FB3C4", "#3D687D", 0.5)
"""How what it carries is drawn."""

PLANE = Style("#DAD3C6", "#B5AA97", 0.35)
"""How floors, walls and ceilings are drawn."""

VEIL = 0.4
"""How much of its opacity a thing keeps that hides the robot from the eye, so that the robot is seen through it."""

GROWTH = 0.15
"""How much of a thing that is larger than the room around the robot is shown at least, as a share of the robot's
extent."""

SPECK = 0.004
"""Share of the extent of a view below which a thing is drawn as a dot, too: less than two points of a picture."""

SAME_HEIGHT = 0.01
"""Share of the extent of a thing by which points of it are as high as its highest one."""

CLOSE_NAMES = 0.03
"""Share of the extent of a view up to which two things have their names on one line."""

NEAR_END = 0.08
"""Share of the width of a picture in which names at its left and right ends begin or end, so that they are inside."""

MOST_POINTS = 2000
"""The most points of clouds that are drawn: as many as a picture can tell apart."""

MOST_NAMED = 12
"""The most things whose names are written beside them; of more, one would hide the other."""

MOST_MARGINS = 3
"""The most things whose margins are told one by one."""

STEPS = 12
"""The number of points that stand for each stretch of a line, where it is seen what hides it."""


def finish_with_surroundings(space: Space, plan: Planned) -> None:
    """Finish a view of a plan with what stands around the robot, as far as it is near, and what it carries."""
    everything = surroundings(plan)
    low, high = space.bounds()
    near = everything.within(*grown(low, high, ROOM))
    for points in shown_points(near, low, high):
        space.include(points)
    space.finish()
    solids = [part for solid in near.solids if (part := within(solid, *space.limits())) is not None]
    plates = [plate for plane in everything.planes if (plate := patch(plane, *space.limits())) is not None]
    _paint(space, solids, plates)
    stride = -(-sum(len(points) for _, points in near.clouds) // MOST_POINTS)
    for name, points in near.clouds:
        space.cloud(points[::stride], STANDING.edge, gid=f"scene.{name}")
    _write_names(space, [solid for solid in solids if not solid.carried], plates)
    _tell(space, everything, near, plates)


def shown_points(near: Surroundings, low: FloatArray, high: FloatArray) -> Iterator[FloatArray]:
    """Yield points (N, 3), m, of what is near that a view of the robot between ends (3,), m, shows as well."""
    yield from (points for _, points in near.clouds)
    for solid in near.solids:
        yield _beginning(solid, low, high).vertices if solid.cuts else solid.vertices
    for plane in near.planes:
        yield foot_of(plane, 0.5 * (low + high))[None]


def _beginning(solid: Solid, low: FloatArray, high: FloatArray) -> Solid:
    """Return what of a large thing is nearest to lower and upper ends (3,), m, and some more of it."""
    for share in np.arange(GROWTH, ROOM, GROWTH).tolist():
        if within(solid, *grown(low, high, share)) is not None:
            return within(solid, *grown(low, high, share + GROWTH)) or solid
    return solid


def _paint(space: Space, solids: Sequence[Solid], plates: list[Solid]) -> None:
    """Paint solids and plates of planes, those that hide the robot over it and thinly."""
    camera = space.camera()
    robot = np.concatenate([points_along(line) for line in space.lines])
    behind, before = BEHIND, LINES + 0.5
    everything = [*solids, *plates]
    speck = SPECK * float(np.ptp(space.limits(), axis=0).max())
    for rank, number in enumerate(painted_order(everything, camera)):
        solid = everything[number]
        style = PLANE if solid in plates else CARRIED if solid.carried else STANDING
        hidden, in_front = solid.hidden(robot, camera)
        is_veil = hidden > in_front and not solid.carried
        if is_veil:
            style = style._replace(opacity=VEIL * style.opacity)
        order = (before if is_veil else behind) + 0.4 * rank / len(everything)
        if np.ptp(solid.vertices, axis=0).max() < speck:
            space.cloud(solid.vertices.mean(axis=0)[None], style.edge, f"speck.{solid.name}.{number}", size=6.0)
        space.area(solid.outline(camera), solid.edges(camera), style, order, f"scene.{solid.name}.{number}")


def points_along(line: FloatArray) -> FloatArray:
    """Return points (N, 3) all along a line through points (N, 3)."""
    if len(line) > STEPS * STEPS:
        return line
    shares = np.arange(STEPS)[:, None, None] / STEPS
    between: FloatArray = ((1.0 - shares) * line[:-1] + shares * line[1:]).reshape(-1, 3)
    return np.concatenate([between, line[-1:]])


def _write_names(space: Space, solids: Sequence[Solid], plates: Sequence[Solid]) -> None:
    """Write the names of what stands over it, and of planes in them, unless they are too many."""
    camera = space.camera()
    middle = camera.project(np.mean(space.limits(), axis=0)[None])[0]
    positions: dict[str, tuple[FloatArray, bool]] = {}
    for solid in (*solids, *plates):
        seen = camera.project(solid.vertices)
        highest = seen[:, 1].max()
        at = solid.vertices[seen[:, 1] >= highest - SAME_HEIGHT * np.ptp(seen)].mean(axis=0)
        is_under = solid in plates and highest > middle[1]
        known = positions.get(solid.name)
        if known is None or camera.project(np.array([known[0], at]))[:, 1].argmax() == 1:
            positions[solid.name] = at, is_under
    if len(positions) > MOST_NAMED:
        return
    extent = np.linalg.norm(np.ptp(camera.project(np.array(space.limits())), axis=0))
    written: list[tuple[FloatArray, bool, list[str]]] = []
    for name, (at, is_under) in positions.items():
        apart = [np.linalg.norm(np.subtract(*camera.project(np.array([at, other])))) for other, _, _ in written]
        if apart and min(apart) < CLOSE_NAMES * extent:
            written[int(np.argmin(apart))][2].append(name)
        else:
            written.append((at, is_under, [name]))
    for at, is_under, names in written:
        others = f" and {len(names) - 1} more" if len(names) > MOST_MARGINS else ""
        space.name(
            at,
            names[0] + others if others else ", ".join(names),
            "top" if is_under else "bottom",
            _side(camera, at, space.limits()),
        )


def _side(camera: Camera, point: FloatArray, limits: tuple[FloatArray, FloatArray]) -> str:
    """Return which side of a name is at a point (3,), m; at the ends of a picture that which leaves the name inside."""
    corners = camera.project(np.array(np.meshgrid(*zip(*limits, strict=True))).reshape(3, 8).T)[:, 0]
    share = float((camera.project(point[None])[0, 0] - corners.min()) / np.ptp(corners))
    return "left" if share < NEAR_END else "right" if share > 1.0 - NEAR_END else "center"


def _tell(space: Space, everything: Surroundings, near: Surroundings, plates: list[Solid]) -> None:
    """Tell the margins that are kept, and what is too far away to be shown."""
    shown = near.names(carried=False) | near.names(carried=True) | {plate.name for plate in plates}
    shown |= {name for name, _ in near.clouds}
    margins = {name: margin * MILLIMETRES for name, margin in everything.margins.items()}
    handles: list[Artist] = []
    if shown - near.names(carried=True):
        handles.append(Patch(facecolor=STANDING.fill, edgecolor=STANDING.edge, alpha=0.8, label=_margins(margins)))
    if carried := sorted(near.names(carried=True)):
        label = f"carried: {', '.join(carried)}" if len(carried) <= MOST_MARGINS else f"carried: {len(carried)} things"
        handles.append(Patch(facecolor=CARRIED.fill, edgecolor=CARRIED.edge, alpha=0.8, label=label))
    if far := sorted(margins.keys() - shown):
        label = ", ".join(far) if len(far) <= MOST_MARGINS else f"{len(far)} things"
        handles.append(Line2D([], [], linestyle="", label=f"out of the picture: {label}"))
    if handles:
        space.legend(handles)


def _margins(margins: dict[str, float]) -> str:
    """Say which margins, mm, are kept from things by their names."""
    values = sorted(set(margins.values()))
    if len(values) == 1:
        return f"scene, margin {values[0]:.4g} mm"
    if len(margins) <= MOST_MARGINS:
        return "scene, margins: " + ", ".join(f"{name} {margin:.4g} mm" for name, margin in margins.items())
    return f"scene, margins from {values[0]:.4g} to {values[-1]:.4g} mm"
