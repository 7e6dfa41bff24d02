"""A view of the base frame, in which lines, dots and frames are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from planner.plots.quantities import MILLIMETRES, XYZ
from planner.plots.space.surroundings import Style
from planner.plots.style import AXIS_COLOURS
from planner.plots.view import AZIMUTH, ELEVATION, VIEWS
from planner.spatial import FloatArray

FLATTEST = 0.5
"""Least extent of a picture along an axis, as a share of its largest one."""

ZOOM = 0.92
"""Magnification of isometric views: as large as their labels allow."""

MOST_TICKS = 6
"""Largest number of tick intervals on the axes of an isometric view, which have less room."""

BEHIND = 1.6
"""The layer (matplotlib's zorder) of things: over the grid, under the robot."""

LINE_LAYER = 3.0
"""The layer of the robot and of the path of its tool."""

DOTS = 4.0
"""The layer of dots on them."""

TEXT = 9.0
"""The layer of names, over all else."""


class _Area(PathPatch):
    """A patch in space, whose outlines are projected when it is drawn."""

    def __init__(self, corners: FloatArray, codes: Sequence[Any], **style: Any) -> None:
        super().__init__(Path(corners[:, :2], codes), **style)
        self._corners, self._codes = corners, codes

    def do_3d_projection(self) -> float:
        """Project it, and return its `zorder` as its depth among other patches."""
        x, y, _ = proj_transform(*self._corners.T, self.axes.M)  # type: ignore[union-attr]
        self.set_path(Path(np.column_stack([x, y]), self._codes))
        return 0.0


class Space:
    """A view of the base frame in axes of matplotlib; lengths are drawn in mm.

    Attributes:
        axes: The axes of matplotlib.
        view: The view.
        columns: The coordinates shown by its axes.
        drawn: Corners of the drawing so far, each (3,), mm.
        lines: Points of the lines that were drawn so far, each (N, 3), m.
    """

    def __init__(self, figure: Figure, cell: SubplotSpec, view: str) -> None:
        self.view = VIEWS[view]
        self.columns = self.view.columns
        self.is_solid = len(self.columns) == 3
        if self.is_solid:
            options = {"elev": ELEVATION, "azim": AZIMUTH, "proj_type": "ortho", "computed_zorder": False}
            self.axes: Any = figure.add_subplot(cell, projection="3d", **options)
        else:
            self.axes = figure.add_subplot(cell, gid=f"graph.{view}")
        self.drawn: list[FloatArray] = []
        self.lines: list[FloatArray] = []

    def shown(self, points: FloatArray) -> FloatArray:
        """Make points (N, 3), m, part of the picture, and return their coordinates (columns, N), mm."""
        self.include(points)
        scaled = points * MILLIMETRES
        return np.ascontiguousarray(scaled[:, self.columns].T)

    def include(self, points: FloatArray) -> None:
        """Make points (N, 3), m, part of the picture, whether anything is drawn there or not."""
        self.drawn += [points.min(axis=0) * MILLIMETRES, points.max(axis=0) * MILLIMETRES]

    def line(self, points: FloatArray, **style: Any) -> None:
        """Draw a line through points (N, 3), m."""
        self.lines.append(points)
        self.axes.plot(*self.shown(points), zorder=LINE_LAYER, **style)

    def coloured(self, points: FloatArray, values: FloatArray, label: str, gid: str) -> None:
        """Draw a line through points (N, 3), m, coloured by values (N,), with a scale unless all are 0."""
        self.lines.append(points)
        coordinates = self.shown(points).T
        pieces = np.stack([coordinates[:-1], coordinates[1:]], axis=1)
        kind: Any = Line3DCollection if self.is_solid else LineCollection
        line = kind(pieces, cmap="viridis", linewidth=2.6, capstyle="round", gid=gid, zorder=LINE_LAYER)
        line.set_array(0.5 * (values[:-1] + values[1:]))
        line.set_clim(0.0, max(float(values.max()), np.finfo(float).tiny))
        self.axes.add_collection(line)
        if values.max() > 0.0:
            self.axes.figure.colorbar(line, ax=self.axes, label=label, shrink=0.5, pad=0.08)

    def dots(self, points: FloatArray, **style: Any) -> Any:
        """Draw dots at points (N, 3), m."""
        return self.axes.scatter(*self.shown(points), zorder=DOTS, **style)

    def text(self, point: FloatArray, text: str) -> None:
        """Write at a point (3,), m."""
        self.axes.text(*self.shown(point[None])[:, 0], f"  {text}", fontsize=8, color="#444444", zorder=TEXT)

    def frame(self, point: FloatArray, rotation: FloatArray, length: float) -> None:
        """Draw a frame at a point (3,), m: the columns of a rotation (3, 3), scaled to a length, m."""
        for axis, colour in zip(rotation.T, AXIS_COLOURS, strict=True):
            self.line(np.array([point, point + length * axis]), color=colour, linewidth=1.2)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper ends (3,), m, of the drawing so far."""
        corners = np.array(self.drawn) / MILLIMETRES
        return corners.min(axis=0), corners.max(axis=0)

    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper ends (3,), m, of the finished picture."""
        low, high = self._ends()
        return low / MILLIMETRES, high / MILLIMETRES

    def area(self, outlines: Sequence[FloatArray], edges: FloatArray, style: Style, order: float, gid: str) -> None:
        """Fill the union of outlines (N, 3), m, and draw edges (N, 2, 3), m, in a layer."""
        codes = [code for each in outlines for code in (Path.MOVETO, *[Path.LINETO] * (len(each) - 1), Path.CLOSEPOLY)]
        closed = [np.concatenate([each, each[:1]])[:, self.columns] * MILLIMETRES for each in outlines]
        fill = {"facecolor": style.fill, "alpha": style.opacity, "linewidth": 0.0, "zorder": order, "gid": gid}
        self.axes.add_patch(_Area(np.concatenate(closed), codes, **fill))
        apart = np.full((len(edges), 1, 3), np.nan)
        strokes = np.concatenate([edges, apart], axis=1).reshape(-1, 3)[:, self.columns] * MILLIMETRES
        stroke = {"color": style.edge, "linewidth": 0.7, "solid_capstyle": "butt", "zorder": order}
        self.axes.plot(*strokes.T, **stroke, gid=f"edges.{gid}")

    def cloud(self, points: FloatArray, colour: str, gid: str, size: float = 1.5) -> None:
        """Draw small dots at points (N, 3), m, of things, below the robot."""
        coordinates = points[:, self.columns].T * MILLIMETRES
        self.axes.scatter(*coordinates, c=colour, s=size, alpha=0.6, linewidths=0, zorder=BEHIND + 0.5, gid=gid)

    def name(self, point: FloatArray, text: str, vertical: str, horizontal: str) -> None:
        """Write a name at a point (3,), m, aligned to sides as in matplotlib."""
        at = point[list(self.columns)] * MILLIMETRES
        style = {"fontsize": 7.5, "fontstyle": "italic", "color": "#6B5A3A", "zorder": TEXT}
        self.axes.text(*at, text, va=vertical, ha=horizontal, clip_on=True, **style)

    def legend(self, handles: list[Artist]) -> None:
        """Write the legend above the picture."""
        options = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": len(handles)}
        self.axes.legend(handles=handles, frameon=False, fontsize=8, borderaxespad=0.2, handlelength=1.4, **options)

    def finish(self) -> None:
        """Give all axes the same scale, and name them."""
        low, high = self._ends()
        for column, side in zip(self.columns, XYZ, strict=False):
            getattr(self.axes, f"set_{side}label")(f"{XYZ[column]} (mm)")
            getattr(self.axes, f"set_{side}lim")(low[column], high[column])
        if self.is_solid:
            self.axes.locator_params(nbins=MOST_TICKS)
            self.axes.zaxis.labelpad = 9.0
            self.axes.set_box_aspect((high - low) / (high - low).max(), zoom=ZOOM)
        else:
            self.axes.set_aspect("equal")

    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper ends of the axes (3,), mm."""
        corners = np.array(self.drawn)
        middle, extents = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        half = 0.53 * np.maximum(extents, FLATTEST * max(float(extents.max()), 1.0))
        return middle - half, middle + half
