"""Views of the base frame: the path of the tool, stick models of the robot, and the points that it reaches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from planner.kinematics.forward import tool_poses_on
from planner.plots.planned import drawn_times, stops_of
from planner.plots.quantities import MILLIMETRES, XYZ, samples_for
from planner.plots.stick_model import distinct_points, stick_model
from planner.plots.style import AXIS_COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

    from planner.plots.planned import Planned
    from planner.robots import Robot
    from planner.spatial import FloatArray

VIEWS = {"isometric": (0, 1, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""The views by name, and the coordinates that each shows."""

ELEVATION = 25.0
"""How far above the floor the isometric view looks from, degrees."""

AZIMUTH = -55.0
"""The direction that it looks from, degrees from the x axis."""

MOST_FRAMES = 9
"""The most frames of the tool that are drawn along its path."""

FRAME_SHARE = 0.06
"""Length of the axes of such a frame, as a share of the extent of the picture."""


FLATTEST = 0.5
"""Least extent of a picture along an axis, as a share of its largest one."""

ZOOM = 0.92
"""How much larger than usual isometric views are drawn: as large as their labels allow."""


class Space:
    """A view of the base frame, in perspective or onto the plane of two of its axes; lengths are drawn in mm.

    Attributes:
        axes: The axes of matplotlib.
        columns: The coordinates that are shown.
        drawn: Corners of what was drawn so far, each (3,), mm.
    """

    def __init__(self, figure: Figure, cell: SubplotSpec, view: str) -> None:
        self.columns = VIEWS[view]
        self.is_solid = len(self.columns) == 3
        if self.is_solid:
            self.axes: Any = figure.add_subplot(cell, projection="3d", elev=ELEVATION, azim=AZIMUTH)
        else:
            self.axes = figure.add_subplot(cell, gid=f"graph.{view}")
        self.drawn: list[FloatArray] = []

    def shown(self, points: FloatArray) -> FloatArray:
        """Return the coordinates (columns, N), mm, of points (N, 3), m, that are now part of the picture."""
        scaled = points * MILLIMETRES
        self.drawn += [scaled.min(axis=0), scaled.max(axis=0)]
        return np.ascontiguousarray(scaled[:, self.columns].T)

    def line(self, points: FloatArray, **style: Any) -> None:
        """Draw a line through points (N, 3), m."""
        self.axes.plot(*self.shown(points), **style)

    def coloured(self, points: FloatArray, values: FloatArray, label: str, gid: str) -> None:
        """Draw a line through points (N, 3), m, coloured by values (N,), with their scale beside it."""
        coordinates = self.shown(points).T
        pieces = np.stack([coordinates[:-1], coordinates[1:]], axis=1)
        kind: Any = Line3DCollection if self.is_solid else LineCollection
        line = kind(pieces, cmap="viridis", linewidth=2.6, capstyle="round", gid=gid)
        line.set_array(0.5 * (values[:-1] + values[1:]))
        line.set_clim(0.0, max(float(values.max()), np.finfo(float).tiny))
        self.axes.add_collection(line)
        self.axes.figure.colorbar(line, ax=self.axes, label=label, shrink=0.5, pad=0.08)

    def dots(self, points: FloatArray, **style: Any) -> Any:
        """Draw dots at points (N, 3), m."""
        return self.axes.scatter(*self.shown(points), **style)

    def text(self, point: FloatArray, text: str) -> None:
        """Write at a point (3,), m."""
        self.axes.text(*self.shown(point[None])[:, 0], f"  {text}", fontsize=8, color="#444444", zorder=9)

    def frame(self, point: FloatArray, rotation: FloatArray, length: float) -> None:
        """Draw a frame at a point (3,), m, its axes the columns of a rotation (3, 3) and of a length, m."""
        for axis, colour in zip(rotation.T, AXIS_COLOURS, strict=True):
            self.line(np.array([point, point + length * axis]), color=colour, linewidth=1.2)

    def finish(self) -> None:
        """Give all axes the same scale, and name them."""
        corners = np.array(self.drawn)
        middle, extents = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        half = 0.53 * np.maximum(extents, FLATTEST * max(float(extents.max()), 1.0))
        for column, side in zip(self.columns, XYZ, strict=False):
            getattr(self.axes, f"set_{side}label")(f"{XYZ[column]} (mm)")
            getattr(self.axes, f"set_{side}lim")(middle[column] - half[column], middle[column] + half[column])
        if self.is_solid:
            self.axes.set_box_aspect(half / half.max(), zoom=ZOOM)
        else:
            self.axes.set_aspect("equal")


def draw_path(figure: Figure, cell: SubplotSpec, plan: Planned, view: str) -> None:
    """Draw the path of the tool, coloured by its speed, with the tool's frame along it and the waypoints."""
    space = Space(figure, cell, view)
    points, rotations = _tool_path(space, plan)
    length = FRAME_SHARE * float(np.ptp(points, axis=0).max())
    for row in np.linspace(0, len(points) - 1, MOST_FRAMES).astype(int).tolist():
        space.frame(points[row], rotations[row], length)
    space.finish()


def draw_robot(figure: Figure, cell: SubplotSpec, plan: Planned, view: str) -> None:
    """Draw the stick model of the robot at every waypoint, and the path of its tool."""
    space = Space(figure, cell, view)
    stops = stops_of(plan)
    for number, stop in enumerate(stops):
        robot = plan.path.dynamics.robot_on(min(stop.row, len(plan.path.durations) - 1))
        shade = 0.75 - 0.6 * (number + 1) / len(stops)
        _draw_sticks(space, robot, plan.path.positions[stop.row], str(shade), f"robot.{number}")
    _tool_path(space, plan)
    space.finish()


def draw_postures(figure: Figure, cell: SubplotSpec, robot: Robot, positions: FloatArray, view: str) -> None:
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
    for stop in stops_of(plan):
        row = int(np.searchsorted(samples.time, stop.arrival).clip(0, len(points) - 1))
        space.dots(points[row][None], c="#222222", s=14)
        space.text(points[row], stop.name)
    return points, rotations


def _draw_sticks(space: Space, robot: Robot, position: FloatArray, shade: str, gid: str) -> FloatArray:
    """Draw the stick model at a joint position (joints,) in a shade of grey; return its points (N, 3), m."""
    points = distinct_points(stick_model(robot, position))
    space.line(points, color=shade, linewidth=3.0, solid_capstyle="round", gid=gid)
    space.dots(points[:-1], c=shade, s=26, edgecolors="white", linewidths=0.8)
    return points
