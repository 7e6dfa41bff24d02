"""Views of the base frame: the path of the tool, stick models of the robot, its surroundings, and reachable points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import tool_poses_on
from planner.plots.quantities import MILLIMETRES, Planned, drawn_times, samples_for, stops_of
from planner.plots.space.space import BEHIND, LINE_LAYER, Space
from planner.plots.space.surroundings import (
    CARRIED,
    MOST_CLOUD_POINTS,
    PLANE,
    STANDING,
    VEIL,
    Thing,
    names_of,
    painted_order,
    points_along,
    shown_points,
    surroundings,
)
from planner.plots.view import distinct_points, drawn_tool_poses, joined_names, stick_model
from planner.robots import Robot
from planner.scene import Scene
from planner.spatial import FloatArray

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


DRAWN_TOOL_FRAMES = 9
"""Largest number of tool frames drawn along the path."""

NAME_SHARE = 0.02
"""Distance up to which two waypoints have their names on one line, as a share of the extent of the drawing."""

FRAME_SHARE = 0.06
"""Length of the axes of a tool frame, as a share of the extent of the picture."""


def draw_path(figure: Figure, cell: SubplotSpec, plan: Planned, view: str) -> None:
    """Draw the path of the tool, coloured by its speed, with the tool's frame along it and the waypoints.

    The path of a tool that stands in the cell is in the frame of the workpiece, without the surroundings.
    """
    space, on_workpiece = Space(figure, cell, view), plan.path.robot.holds_workpiece
    points, rotations = _tool_path(space, plan, on_workpiece=on_workpiece)
    length = FRAME_SHARE * float(np.ptp(points, axis=0).max())
    for row in np.linspace(0, len(points) - 1, DRAWN_TOOL_FRAMES).astype(int).tolist():
        space.frame(points[row], rotations[row], length)
    if on_workpiece:
        space.legend([Line2D([], [], linestyle="", label="in the frame of the workpiece")])
        space.finish()
    else:
        finish_with_surroundings(space, plan)


def draw_robot(figure: Figure, cell: SubplotSpec, plan: Planned, view: str) -> None:
    """Draw the stick model of the robot at every waypoint, and the path of its tool."""
    space = Space(figure, cell, view)
    stops = stops_of(plan)
    for number, stop in enumerate(stops):
        robot = plan.path.dynamics.robot_on(min(stop.row, len(plan.path.durations) - 1))
        shade = 0.75 - 0.6 * (number + 1) / len(stops)
        _draw_sticks(space, robot, plan.path.positions[stop.row], str(shade), f"robot.{number}")
    _tool_path(space, plan)
    finish_with_surroundings(space, plan)


def draw_positions(figure: Figure, cell: SubplotSpec, robot: Robot, positions: FloatArray, view: str) -> None:
    """Draw the stick model of a robot at joint positions (N, joints), and the frame of its tool."""
    space = Space(figure, cell, view)
    tools = drawn_tool_poses(SegmentDynamics.unchanged(robot), np.zeros(len(positions), dtype=int), positions)
    for number, (position, point, rotation) in enumerate(zip(positions, *tools, strict=True)):
        points = _draw_sticks(space, robot, position, "0.25", f"robot.{number}")
        space.frame(point, rotation, FRAME_SHARE * float(np.ptp(points, axis=0).max()))
    space.finish()


def draw_points(figure: Figure, cell: SubplotSpec, points: FloatArray, view: str) -> None:
    """Draw points (N, 3), m, that the tool reaches, coloured by their height."""
    space = Space(figure, cell, view)
    dots = space.dots(points, c=points[:, 2] * MILLIMETRES, s=2.0, cmap="viridis", linewidths=0, gid="workspace")
    figure.colorbar(dots, ax=space.axes, label="height (mm)", shrink=0.5, pad=0.08)
    space.finish()


def _tool_path(space: Space, plan: Planned, *, on_workpiece: bool = False) -> tuple[FloatArray, FloatArray]:
    """Draw the path of the tool, coloured by its speed, and the waypoints; return its points and orientations."""
    samples = samples_for(plan, ("tcp_velocity",), drawn_times(plan))
    poses = tool_poses_on if on_workpiece else drawn_tool_poses
    points, rotations = poses(plan.path.dynamics, samples.segment, samples.position)
    linear = np.asarray(samples.tcp_velocity)[0]
    space.coloured(points, np.linalg.norm(linear, axis=1) * MILLIMETRES, "tool speed (mm/s)", "path")
    stops = stops_of(plan)
    rows = np.searchsorted(samples.time, [stop.arrival for stop in stops]).clip(0, len(points) - 1)
    space.dots(points[rows], c="#222222", s=14)
    low, high = space.bounds()
    for row, names in joined_names(points[rows], [stop.name for stop in stops], NAME_SHARE * float((high - low).max())):
        space.text(points[rows][row], ", ".join(names))
    return points, rotations


def _draw_sticks(space: Space, robot: Robot, position: FloatArray, shade: str, gid: str) -> FloatArray:
    """Draw the stick model at a joint position (joints,) in a shade of grey; return its points (N, 3), m."""
    points = distinct_points(stick_model(robot, position))
    space.line(points, color=shade, linewidth=3.0, solid_capstyle="round", gid=gid)
    space.dots(points[: max(1, len(points) - 1)], c=shade, s=26, edgecolors="white", linewidths=0.8)
    return points
