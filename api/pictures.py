"""Pictures of a trajectory: position, velocity and acceleration of every joint over time, and their limits."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from planner.kinematics import FloatArray

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#5D3A9B")
"""The colours of the joints, in turn; colour-blind eyes tell them apart (Okabe and Ito)."""

QUANTITIES = ("position", "velocity", "acceleration")
"""The quantities that are drawn, one row each."""

UNITS = {True: ("°", "°/s", "°/s²"), False: ("mm", "mm/s", "mm/s²")}
"""The units of the three quantities, by whether the joint turns."""

KEY = "grey bars: from the lower to the upper limit, colour: used; dashed: a limit near the curves; shaded: at rest"
"""The explanation below a picture."""

ROOM_FOR_LIMIT = 1.25
"""A limit is drawn among the curves when that makes their axis no taller than this many times."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
}


@dataclass(frozen=True, eq=False)
class Drawn:
    """One quantity of every joint, in the units of the picture.

    Attributes:
        values: (N, joints).
        lower: (joints,); infinite: no limit.
        upper: (joints,); infinite: no limit.
    """

    values: FloatArray
    lower: FloatArray
    upper: FloatArray


def picture(
    title: str, request: dict[str, Any], answer: dict[str, Any], robot: dict[str, Any], form: str = "png"
) -> bytes:
    """Draw an answer of POST /v1/trajectories.

    Args:
        title: The title of the picture.
        request: What was asked; its limits narrow the robot's.
        answer: The answer, with samples.
        robot: The answer of GET /v1/robots/{id}.
        form: The file format: `png` or `svg`.

    Returns:
        The content of the file.
    """
    file = BytesIO()
    turns = np.array([joint["kind"] != "prismatic" for joint in robot["joints"]])
    drawn = [_drawn(quantity, request, answer, robot, turns) for quantity in QUANTITIES]
    kinds = [kind for kind in (True, False) if (turns == kind).any()]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            len(QUANTITIES),
            len(kinds) + 1,
            figsize=(13.0 if len(kinds) == 1 else 17.0, 8.0),
            width_ratios=[*([6.0 / len(kinds) ** 0.5] * len(kinds)), 1.8],
            layout="constrained",
            squeeze=False,
        )
        for row, quantity in enumerate(QUANTITIES):
            for column, kind in enumerate(kinds):
                _draw_curves(axes[row, column], answer, drawn[row], turns == kind, f"{quantity} ({UNITS[kind][row]})")
            _draw_shares(axes[row, -1], robot, drawn[row], [UNITS[bool(kind)][row] for kind in turns])
        for axis in axes[0, :-1]:
            _name_waypoints(axis, answer)
        for axis in axes[-1, :-1]:
            axis.set_xlabel("time (s)")
        for axis in axes[:-1].flat:
            axis.tick_params(labelbottom=False)
        axes[0, -1].set_title("use of the limits", fontsize=9, color="#444444", loc="left")
        _entitle(figure, title, answer)
        figure.savefig(file, dpi=100, format=form)
        plt.close(figure)
    return file.getvalue()


def _drawn(
    quantity: str, request: dict[str, Any], answer: dict[str, Any], robot: dict[str, Any], turns: np.ndarray
) -> Drawn:
    scale = np.where(turns, np.degrees(1.0), 1000.0)
    values = np.array(answer["samples"][quantity]) * scale
    if quantity == "position":
        lower = _numbers([joint["lower"] for joint in robot["joints"]], -np.inf)
        upper = _numbers([joint["upper"] for joint in robot["joints"]], np.inf)
        return Drawn(values, lower * scale, upper * scale)
    asked = request.get("limits", {})
    limit = _numbers(asked.get(quantity) or [joint[quantity] for joint in robot["joints"]], np.inf)
    limit = limit * asked.get(f"{quantity}_scale", 1.0) * scale
    return Drawn(values, -limit, limit)


def _numbers(values: list[float | None], none: float) -> FloatArray:
    return np.array([none if value is None else value for value in values])


def _draw_curves(axis: Axes, answer: dict[str, Any], drawn: Drawn, joints: np.ndarray, label: str) -> None:
    time = answer["samples"]["time"]
    for joint in np.flatnonzero(joints).tolist():
        axis.plot(time, drawn.values[:, joint], color=_colour(joint), linewidth=1.6)
    axis.set_ylabel(label)
    axis.set_xlim(time[0], time[-1])
    axis.margins(y=0.08)
    _draw_limits(axis, answer["joint_names"], drawn, np.flatnonzero(joints).tolist())
    for waypoint in answer["waypoints"]:
        axis.axvline(waypoint["arrival_time"], color="#BBBBBB", linewidth=0.8, zorder=0)
        if waypoint["departure_time"] > waypoint["arrival_time"]:
            axis.axvspan(waypoint["arrival_time"], waypoint["departure_time"], color="#F3F3F3", zorder=0)


def _draw_limits(axis: Axes, names: list[str], drawn: Drawn, joints: list[int]) -> None:
    """Draw the limits that are near the curves; one line for joints that share one, with their names on it."""
    bottom, top = axis.get_ylim()
    for limit in {*drawn.lower[joints], *drawn.upper[joints]}:
        if max(top, limit) - min(bottom, limit) > ROOM_FOR_LIMIT * (top - bottom):
            continue
        bound = [joint for joint in joints if limit in {drawn.lower[joint], drawn.upper[joint]}]
        colour = _colour(bound[0]) if len(bound) == 1 else "#777777"
        axis.axhline(limit, color=colour, linewidth=1.0, linestyle=(0, (5, 3)))
        below = limit in drawn.lower[bound]
        axis.annotate(
            "limit of " + ", ".join(names[joint] for joint in bound), (1.0, limit), (-2, -2 if below else 2),
            xycoords=("axes fraction", "data"), textcoords="offset points",
            ha="right", va="top" if below else "bottom", fontsize=7, color=colour,
        )  # fmt: skip


def _draw_shares(axis: Axes, robot: dict[str, Any], drawn: Drawn, units: list[str]) -> None:
    """Draw for each joint a track from limit to limit, and on it the part that the trajectory uses."""
    for joint, (lower, upper) in enumerate(zip(drawn.lower, drawn.upper, strict=True)):
        limited = bool(np.isfinite(lower) and np.isfinite(upper))
        text = "no limit"
        if limited:
            values = 2.0 * (drawn.values[:, joint] - lower) / (upper - lower) - 1.0
            axis.barh(joint, 2.0, left=-1.0, height=0.56, color="#EDEDED")
            # What does not move still shows as a mark.
            axis.barh(joint, max(np.ptp(values), 0.02), left=values.min(), height=0.56, color=_colour(joint))
            bounds = f"±{upper:.4g}" if lower == -upper else f"{lower:.4g} to {upper:.4g}"
            space = "" if units[joint].startswith("°") else " "
            text = f"{100.0 * np.abs(values).max():.1f} % of {bounds}{space}{units[joint]}"
        axis.text(1.1 if limited else -1.0, joint, text, va="center", fontsize=8, color="#666666")
    axis.set_yticks(range(len(robot["joint_names"])), robot["joint_names"], fontsize=8, fontweight="bold")
    for joint, tick in enumerate(axis.get_yticklabels()):
        tick.set_color(_colour(joint))
    axis.set_ylim(len(robot["joint_names"]) - 0.4, -0.6)
    axis.set_xlim(-1.08, 2.6)
    axis.set_xticks([-1.0, 0.0, 1.0], ["lower\nlimit", "middle", "upper\nlimit"], fontsize=8)
    axis.grid(visible=False)
    axis.spines[["left", "bottom"]].set_visible(False)
    axis.tick_params(left=False, bottom=False)


def _name_waypoints(axis: Axes, answer: dict[str, Any]) -> None:
    """Name the waypoints above the axis, those left out that would run into the one before."""
    duration = answer["duration"]
    last = -duration
    for waypoint in answer["waypoints"]:
        middle = 0.5 * (waypoint["arrival_time"] + waypoint["departure_time"])
        if middle - last < 0.03 * duration:
            continue
        last = middle
        name = waypoint["name"] or str(waypoint["index"])
        axis.annotate(
            name, (middle, 1.0), (0, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="center", va="bottom", fontsize=8, color="#666666",
        )  # fmt: skip


def _entitle(figure: Figure, title: str, answer: dict[str, Any]) -> None:
    certificate = answer["certificate"]
    kept = "every enforced limit kept" if certificate["satisfied"] else "limits violated"
    facts = f"{answer['robot']}, {answer['backend']}, {answer['duration']:.2f} s, {kept}"
    figure.suptitle(f"{title}\n", x=0.01, ha="left", fontsize=14, fontweight="bold")
    figure.text(0.01, 0.95, facts, fontsize=10, color="#555555", va="top")
    figure.text(0.99, 0.985, KEY, fontsize=8, color="#888888", va="top", ha="right")


def _colour(joint: int) -> str:
    return COLOURS[joint % len(COLOURS)]
