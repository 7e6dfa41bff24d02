"""Pictures: graphs and views put together on a sheet, written as SVG or PNG."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from numpy.typing import ArrayLike

from planner.kinematics.workspace import Workspace
from planner.plots.graphs import draw_curves, draw_names, draw_shares, name_stops
from planner.plots.quantities import (
    JOINT_UNITS,
    TOOL_QUANTITIES,
    XYZ,
    Curves,
    Planned,
    drawn_times,
    joint_curves,
    joint_indices,
    kept_limits,
    samples_for,
    stops_of,
    tool_curves,
)
from planner.plots.space.views import draw_path, draw_points, draw_positions, draw_robot
from planner.plots.style import STYLE, well_formed
from planner.plots.view import VIEWS
from planner.robots import Robot
from planner.spatial import FloatArray

OVERVIEW = ("position", "velocity", "acceleration")
"""The quantities in a picture of a plan by default."""

SPACES = {"path": draw_path, "robot": draw_robot}
"""The views of a plan in space by name."""

SHOWN = (*JOINT_UNITS, *TOOL_QUANTITIES, *SPACES)
"""Everything of a plan that can be drawn."""

GRAPH_HEIGHT = 3.2
"""Height of one graph, inches."""

ROW_HEIGHT = 2.4
"""Height of one graph of three or more, inches."""

SPACE_HEIGHT = 6.6
"""Height of one view in space, inches."""

HEAD_HEIGHT = 0.8
"""Height of title and time axis, inches."""

DOTS_PER_INCH = 100
"""The resolution of PNG files."""

KEY = "grey bars: from the lower to the upper limit, colour: used; dashed: a limit near the curves; shaded: at rest"
"""The explanation beside the title of graphs of joints."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture, which notebooks show.

    Attributes:
        figure: The figure of matplotlib, to be changed as you like.
    """

    figure: Figure

    def svg(self) -> bytes:
        """Write it as SVG; the same picture gives the same bytes."""
        written = self._written("svg", metadata={"Date": None})
        return well_formed(written.decode()).encode()  # matplotlib writes texts as they are, into comments

    def png(self) -> bytes:
        """Write it as PNG."""
        return self._written("png", dpi=DOTS_PER_INCH)

    def _written(self, form: str, **options: Any) -> bytes:
        file = BytesIO()
        with mpl.rc_context(STYLE):
            self.figure.savefig(file, format=form, **options)
        return file.getvalue()

    def _repr_svg_(self) -> str:
        svg = self.svg().decode()
        return svg[svg.index("<svg") :]


def draw_plan(
    plan: Planned,
    show: Sequence[str] | None = None,
    *,
    joints: Collection[str] | None = None,
    axes: Collection[str] | None = None,
    view: str = "isometric",
    title: str | None = None,
) -> Picture:
    """Draw a plan: one row for each quantity or view.

    Args:
        plan: The plan.
        show: The rows, from above. Of the joints: `position`, `velocity`, `acceleration`, `jerk` and `torque`.
            Of the tool: `tcp_position`, `tcp_orientation`, `tcp_velocity`, `tcp_angular_velocity`, `tcp_acceleration`,
            `tcp_angular_acceleration`, `tcp_speed` and its `path` in space. Then the `robot` at the waypoints. None:
            positions, velocities and accelerations.
        joints: Names of the joints whose graphs are drawn; None: all.
        axes: The axes among `x`, `y` and `z` whose graphs are drawn; None: all.
        view: Where views look from: `isometric`, or onto the plane `xy`, `xz` or `yz` of the base.
        title: The title; None: the robot's id.

    Raises:
        InvalidProblem: The robot has no joint of such a name.
        MissingDynamics: Torques are requested of a robot without inertias and payload.
        ValueError: A name in `show` is unknown, or `show` is empty.
    """
    show = OVERVIEW if show is None else show
    _refuse_unknown("show", show, SHOWN)
    _refuse_unknown("axes", XYZ if axes is None else axes, XYZ)
    _refuse_unknown("view", (view,), VIEWS)
    graphs = [quantity for quantity in show if quantity not in SPACES]
    samples = samples_for(plan, graphs, drawn_times(plan))
    indices = joint_indices(plan.path.robot, joints)
    rows: list[tuple[str, list[Curves]]] = []
    for shown in show:
        if shown in JOINT_UNITS:
            rows.append((shown, joint_curves(plan, samples, shown, indices)))
        else:
            rows.append((shown, [tool_curves(plan, samples, shown, axes)] if shown in TOOL_QUANTITIES else []))
    with mpl.rc_context(STYLE):
        height = GRAPH_HEIGHT if len(graphs) < 3 else ROW_HEIGHT
        heights = [SPACE_HEIGHT if shown in SPACES else height for shown in show]
        figure = _sheet(heights, has_graphs=bool(graphs))
        columns = max((len(groups) for _, groups in rows), default=1)
        grid = figure.add_gridspec(
            len(rows), columns + 1 if graphs else 1,
            height_ratios=heights,
            width_ratios=[*([6.0 / columns**0.5] * columns), 1.8] if graphs else None,
        )  # fmt: skip
        for row, (shown, groups) in enumerate(rows):
            if not groups:
                SPACES[shown](figure, grid[row, :], plan, view)
                continue
            cells = [grid[row, column] for column in range(columns)] if len(groups) > 1 else [grid[row, :columns]]
            is_last = all(kind in SPACES for kind in show[row + 1 :])
            _draw_row(figure, plan, samples.time, groups, [*cells, grid[row, columns]], is_last=is_last)
        named = "" if title is None else f"{plan.path.robot.id}, "
        facts = f"{named}{plan.backend.kind}, {plan.trajectory.duration:.2f} s, {kept_limits(plan)}"
        _entitle(figure, title or plan.path.robot.id, facts, KEY if any(s in JOINT_UNITS for s in show) else "")
    return Picture(figure)


def draw_robot_at(
    robot: Robot, positions: ArrayLike | None = None, *, view: str = "isometric", title: str | None = None
) -> Picture:
    """Draw the stick model of a robot.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m, the joint positions at which it is drawn; None: at 0.
        view: Where it is looked at from, as `draw_plan` has it.
        title: The title; None: the robot's id.

    Raises:
        ValueError: There is no such view, or the positions are not of this robot.
    """
    _refuse_unknown("view", (view,), VIEWS)
    rows = np.zeros((1, robot.dof)) if positions is None else np.atleast_2d(np.asarray(positions, dtype=np.float64))
    if rows.ndim != 2 or rows.shape[1] != robot.dof or not np.isfinite(rows).all():
        raise ValueError(f"positions: rows of {robot.dof} numbers are needed, one a joint of {robot.id}")
    facts = "; ".join(", ".join(f"{value:.4g}" for value in row) for row in rows)
    return _view(title or robot.id, f"at {facts}", partial(draw_positions, robot=robot, positions=rows, view=view))


def draw_workspace(robot: Robot, workspace: Workspace, *, view: str = "isometric", title: str | None = None) -> Picture:
    """Draw the points that the tool of a robot reaches, coloured by their height.

    Args:
        robot: The robot.
        workspace: Its workspace, of as many points as are to be drawn.
        view: Where they are looked at from, as `draw_plan` has it.
        title: The title; None: one that names the robot.

    Raises:
        ValueError: There is no such view.
    """
    _refuse_unknown("view", (view,), VIEWS)
    inner, outer, top = (
        1000.0 * extreme.value
        for extreme in (workspace.minimum_radius, workspace.maximum_radius, workspace.maximum_height)
    )
    facts = f"{len(workspace.points)} points; radius from {inner:.4g} to {outer:.4g} mm, height up to {top:.4g} mm"
    return _view(title or f"Workspace of {robot.id}", facts, partial(draw_points, points=workspace.points, view=view))


def _view(title: str, facts: str, draw: Callable[[Figure, SubplotSpec], None]) -> Picture:
    with mpl.rc_context(STYLE):
        figure = _sheet([SPACE_HEIGHT], has_graphs=False)
        draw(figure, figure.add_gridspec(1, 1)[0, 0])
        _entitle(figure, title, facts)
    return Picture(figure)


def _draw_row(
    figure: Figure, plan: Planned, times: FloatArray, groups: list[Curves], cells: list[SubplotSpec], *, is_last: bool
) -> None:
    """Draw the graphs of one quantity, with a legend and the used shares of the limits."""
    stops = stops_of(plan)
    for curves, cell in zip(groups, cells, strict=False):
        axis = figure.add_subplot(cell, gid=f"graph.{curves.names[0]}.{curves.quantity}")
        draw_curves(axis, times, curves, stops)
        name_stops(axis, stops, plan.trajectory.duration)
        if is_last:
            axis.set_xlabel("time (s)")
        axis.tick_params(labelbottom=is_last)
    beside = figure.add_subplot(cells[-1])
    if groups[0].quantity in JOINT_UNITS:
        draw_shares(beside, groups)
        beside.tick_params(labelbottom=is_last)
    else:
        draw_names(beside, groups[0])


def _sheet(heights: Sequence[float], has_graphs: bool) -> Figure:
    return Figure(figsize=(13.0 if has_graphs else 9.0, HEAD_HEIGHT + float(np.sum(heights))), layout="constrained")


def _entitle(figure: Figure, title: str, facts: str, key: str = "") -> None:
    """Write the title, what there is to know below it, and an explanation beside it."""
    figure.suptitle(f"{title}\n", x=0.01, ha="left", fontsize=14, fontweight="bold")
    below = 1.0 - 0.4 / figure.get_figheight()
    figure.text(0.01, below, facts, fontsize=10, color="#555555", va="top")
    figure.text(0.99, 1.0 - 0.12 / figure.get_figheight(), key, fontsize=8, color="#888888", va="top", ha="right")


def _refuse_unknown(what: str, requested: Sequence[str] | Collection[str], known: Collection[str]) -> None:
    """Refuse names that there are not.

    Raises:
        ValueError: A name is unknown, or there is none.
    """
    wrong = [name for name in requested if name not in known]
    if wrong or not requested:
        raise ValueError(f"{what}: {', '.join(wrong) or 'nothing'}; there are {', '.join(known)}")
