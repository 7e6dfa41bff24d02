"""Views of the base frame: the path of the tool, stick models of the robot, and its reachable points."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from planner.kinematics.forward import tool_poses_on
from planner.plots.planned import Planned, drawn_times, stops_of
from planner.plots.quantities import MILLIMETRES, samples_for
from planner.plots.space.painting import finish_with_surroundings
from planner.plots.space.space import Space
from planner.plots.stick_model import distinct_points, stick_model
from planner.plots.view import joined_names
from planner.robots import Robot
from planner.spatial import FloatArray

DRAWN_TOOL_FRAMES = 9
"""Largest number of tool frames drawn along the path."""

NAME_SHARE = 0.02
"""Distance up to which two waypoints have their names on one line, as a share of the extent of the drawing."""

FRAME_SHARE = 0.06
"""Length of the axes of a tool frame, as a share of the extent of the picture."""


def draw_path(figure: Figure, cell: SubplotSpec, plan: Planned, view: str) -> None:
    """Draw the path of the tool, coloured by its speed, with the tool's frame along it and the waypoints."""
    space = Space(figure, cell, view)
    points, rotations = _tool_path(space, plan)
    length = FRAME_SHARE * float(np.ptp(points, axis=0).max())
    for row in np.linspace(0, len(points) - 1, DRAWN_TOOL_FRAMES).astype(int).tolist():
        space.frame(points[row], rotations[row], length)
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
    for number, position in enumerate(positions):
        points = _draw_sticks(space, robot, position, "0.25", f"robot.{number}")
        rotation = robot.data.oMf[robot.tool_frame_id].rotation
        space.frame(points[-1], rotation, FRAME_SHARE * float(np.ptp(points, axis=0).max()))
    space.finish()


def draw_points(figure: Figure, cell: SubplotSpec, points: FloatArray, view: str) -> None:
    """Draw points (N, 3), m, that the tool reaches, coloured by their height."""
    space = Space(figure, cell, view)
    dots = space.dots(points, c=points[:, 2] * MILLIMETRES, s=2.0, cmap="viridis", linewidths=0, gid="workspace")
    figure.colorbar(dots, ax=space.axes, label="height (mm)", shrink=0.5, pad=0.08)
    space.finish()


def _tool_path(space: Space, plan: Planned) -> tuple[FloatArray, FloatArray]:
    """Draw the path of the tool, coloured by its speed, and the waypoints; return its points and orientations."""
    samples = samples_for(plan, ("tcp_velocity",), drawn_times(plan))
    points, rotations = tool_poses_on(plan.path.dynamics, samples.segment, samples.position)
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
