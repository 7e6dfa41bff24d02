"""Graphs over time: curves with the limits in force, waypoints, rests, and each joint's largest share of a limit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from planner.plots.quantities import Curves, NamedStop
from planner.spatial import FloatArray

ROOM_FOR_LIMIT = 1.25
"""A limit is drawn among the curves when that makes their axis no taller than this many times."""

LEAST_DISTANCE = 0.03
"""Share of the time axis that the names of two waypoints are apart at least; one that would be nearer is left out."""

LEAST_MARK = 0.02
"""Width of the mark of a joint that does not move, of a track from -1 to 1."""


def draw_curves(axis: Axes, times: FloatArray, curves: Curves, stops: Sequence[NamedStop]) -> None:
    """Draw curves over time, s, the limits near them, the waypoints, and the rests."""
    for name, colour, values in zip(curves.names, curves.colours, curves.values.T, strict=True):
        axis.plot(times, values, color=colour, linewidth=1.6, gid=f"{curves.quantity}.{name}")
    axis.set_ylabel(curves.label)
    axis.set_xlim(times[0], times[-1])
    axis.margins(y=0.08)
    _draw_limits(axis, times, curves)
    for stop in stops:
        axis.axvline(stop.arrival, color="#BBBBBB", linewidth=0.8, zorder=0)
        if stop.departure > stop.arrival:
            axis.axvspan(stop.arrival, stop.departure, color="#F3F3F3", zorder=0)


def _draw_limits(axis: Axes, times: FloatArray, curves: Curves) -> None:
    """Draw the limits that are near the curves; one line for curves that share one, with their names on it."""
    bottom, top = axis.get_ylim()
    for sides, below in ((curves.lower, True), (curves.upper, False)):
        for side in np.unique(sides, axis=1).T:
            drawn = np.where(np.isfinite(side), side, np.nan)
            if np.isnan(drawn).all():
                continue
            if max(top, np.nanmax(drawn)) - min(bottom, np.nanmin(drawn)) > ROOM_FOR_LIMIT * (top - bottom):
                continue
            bound = np.flatnonzero((sides == side[:, None]).all(axis=0)).tolist()
            colour = curves.colours[bound[0]] if len(bound) == 1 else "#777777"
            axis.plot(times, drawn, color=colour, linewidth=1.0, linestyle=(0, (5, 3)))
            last = drawn[np.isfinite(drawn)][-1]
            axis.annotate(
                "limit of " + ", ".join(curves.names[k] for k in bound), (1.0, last), (-2, -2 if below else 2),
                xycoords=("axes fraction", "data"), textcoords="offset points",
                ha="right", va="top" if below else "bottom", fontsize=7, color=colour,
            )  # fmt: skip


def draw_shares(axis: Axes, groups: Sequence[Curves]) -> None:
    """Draw for each joint a track from limit to limit, and on it the part that the trajectory uses."""
    names = [name for curves in groups for name in curves.names]
    colours = [colour for curves in groups for colour in curves.colours]
    row, any_limited = 0, False
    for curves in groups:
        space = "" if curves.unit.startswith("°") else " "
        for values, lower, upper in zip(curves.values.T, curves.lower.T, curves.upper.T, strict=True):
            limited = bool(np.isfinite(lower).all() and np.isfinite(upper).all() and (lower < upper).all())
            text = f"held at {upper[0]:.4g}{space}{curves.unit}" if (lower == upper).all() else "no limit"
            if limited:
                any_limited = True
                used = 2.0 * (values - lower) / (upper - lower) - 1.0
                axis.barh(row, 2.0, left=-1.0, height=0.56, color="#EDEDED")
                width = max(np.ptp(used), LEAST_MARK)
                axis.barh(row, width, left=used.min(), height=0.56, color=colours[row])
                text = f"{100.0 * np.abs(used).max():.1f} % of {_bounds(lower, upper)}{space}{curves.unit}"
            axis.text(1.1 if limited else -1.0, row, text, va="center", fontsize=8, color="#666666")
            row += 1
    axis.set_yticks(range(len(names)), names, fontsize=8, fontweight="bold")
    for colour, tick in zip(colours, axis.get_yticklabels(), strict=True):
        tick.set_color(colour)
    axis.set_ylim(max(len(names), 4) - 0.4, -0.6)  # bars of a few joints are no thicker
    axis.set_xlim(-1.08, 2.6)
    marks = {-1.0: "lower\nlimit", 0.0: "middle", 1.0: "upper\nlimit"} if any_limited else {}
    axis.set_xticks([*marks], [*marks.values()], fontsize=8)
    axis.grid(visible=False)
    axis.spines[["left", "bottom"]].set_visible(False)
    axis.tick_params(left=False, bottom=False)


def _bounds(lower: FloatArray, upper: FloatArray) -> str:
    """Write the limits of a joint; if they change, the limits of the widest segment."""
    least, most = float(lower.min()), float(upper.max())
    text = f"±{most:.4g}" if least == -most else f"{least:.4g} to {most:.4g}"
    changes = lower.min() != lower.max() or upper.min() != upper.max()
    return f"up to {text}" if changes else text


def draw_names(axis: Axes, curves: Curves) -> None:
    """Name the curves of the tool, beside their axis."""
    for row, (name, colour) in enumerate(zip(curves.names, curves.colours, strict=True)):
        axis.plot([0.0, 0.06], [-row, -row], color=colour, linewidth=1.6)
        axis.text(0.09, -row, name, va="center", fontsize=9, color=colour, fontweight="bold")
    axis.set_xlim(0.0, 1.0)
    axis.set_ylim(-5.5, 0.6)
    axis.set_axis_off()


def name_stops(axis: Axes, stops: Sequence[NamedStop], duration: float) -> None:
    """Name the waypoints above the axis, those left out that would run into the one before."""
    last = -duration
    for stop in stops:
        middle = 0.5 * (stop.arrival + stop.departure)
        if middle - last < LEAST_DISTANCE * duration:
            continue
        last = middle
        axis.annotate(
            stop.name, (middle, 1.0), (0, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="center", va="bottom", fontsize=8, color="#666666",
        )  # fmt: skip
