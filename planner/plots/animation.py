"""The moving stick model of a robot along a trajectory in its scene, as an SVG that plays by itself."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from planner.plots.planned import stops_of
from planner.plots.quantities import MILLIMETRES
from planner.plots.stick_model import stick_model
from planner.plots.xml import well_formed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.plots.planned import Planned
    from planner.spatial import FloatArray

FRAMES_PER_SECOND = 20.0
"""Postures computed for a second of the trajectory; what is shown goes evenly from one to the next."""

MOST_FRAMES = 400
"""The most postures of an animation, which is some tens of kilobytes large."""

SHORTEST = 0.01
"""Least duration of an animation, s: of a robot that rests, too."""

ISOMETRIC = ((0.819, 0.574, 0.0), (-0.242, 0.346, 0.906))
"""The directions, in the base frame, that point to the right and up where a view looks from 25 degrees above, and 55
degrees from the x axis."""

DIRECTIONS = {
    "isometric": ISOMETRIC,
    "xy": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "xz": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "yz": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}
"""The directions to the right and up of every view."""

WIDTH = 640.0
"""Width of an animation, points."""

HEIGHT = 480.0
"""Height of an animation, points."""

EDGE = 40.0
"""Room around what moves, points."""

SAME_POINT = 8.0
"""Distance, points, below which two waypoints have their names on one line."""

PAGE = """\
<div style="max-width: {width:g}px">
{svg}
<input type="range" min="0" max="{duration:.4f}" step="any" value="0" aria-label="time" style="width: 80%"
 oninput="const s = this.parentElement.querySelector('svg'); s.pauseAnimations(); s.setCurrentTime(this.value)">
<button type="button" onclick="this.parentElement.querySelector('svg').unpauseAnimations()">Play</button>
</div>"""
"""The animation in a page, with a time line."""


@dataclass(frozen=True)
class Animation:
    """A robot that moves, over and over, which notebooks and browsers play.

    Attributes:
        svg: The picture that moves.
        duration: How long one run takes, s.
    """

    svg: str
    duration: float

    def _repr_html_(self) -> str:
        return PAGE.format(svg=self.svg, duration=self.duration, width=WIDTH)


def animate(plan: Planned, *, view: str = "isometric", speed: float = 1.0) -> Animation:
    """Let the stick model of a robot move along a planned trajectory, with what it carries, in what stands around it.

    Args:
        plan: The plan.
        view: Where it is looked at from: `isometric`, or onto the plane `xy`, `xz` or `yz` of the base.
        speed: How many seconds of the trajectory pass in one.

    Raises:
        ValueError: There is no such view, or the speed is not a positive number.
    """
    if view not in DIRECTIONS:
        raise ValueError(f"view: {view}; there are {', '.join(DIRECTIONS)}")
    if not 0.0 < speed < np.inf:
        raise ValueError(f"a trajectory cannot be played at {speed} times its speed")
    trajectory = plan.trajectory
    count = int(np.clip(np.ceil(trajectory.duration * FRAMES_PER_SECOND / speed), 2, MOST_FRAMES)) + 1
    times = np.linspace(0.0, trajectory.duration, count)
    (positions,) = trajectory.evaluate(times, (0,))
    segments = trajectory.segments[trajectory.locate(times)[0]].tolist()
    models = np.array(
        [
            stick_model(plan.path.dynamics.robot_on(segment), position)
            for segment, position in zip(segments, positions, strict=True)
        ]
    )  # (times, points, 3)
    duration = max(trajectory.duration / speed, SHORTEST)
    timing = f'dur="{duration:.4f}s" repeatCount="indefinite"'
    points = models.reshape(-1, 3)
    if plan.problem.scene is None:
        return Animation(_svg(plan, _projecting(points, view)(models), times, timing), duration)
    from planner.plots.space.moving import Frames, paint_surroundings, projection, with_surroundings

    shown = with_surroundings(plan, points)
    project = _projecting(shown, view)
    seen = projection(DIRECTIONS[view], project)
    painted = paint_surroundings(plan, Frames(segments, positions), models, shown, seen, timing)
    return Animation(_svg(plan, project(models), times, timing, painted.behind, painted.before), duration)


def _projecting(points: FloatArray, view: str) -> Callable[[FloatArray], FloatArray]:
    """Return what takes points (..., 3), m, to the picture (..., 2) that shows all of some points (N, 3), m."""
    directions = np.array(DIRECTIONS[view]).T * MILLIMETRES
    shown = points @ directions
    low, extent = shown.min(axis=0), np.maximum(np.ptp(shown, axis=0), 1.0)
    scale = float(((WIDTH - 2.0 * EDGE, HEIGHT - 2.0 * EDGE) / extent).min())
    middle = 0.5 * np.array([WIDTH, HEIGHT])

    def project(those: FloatArray) -> FloatArray:
        projected: FloatArray = middle + (those @ directions - low - 0.5 * extent) * scale * (1.0, -1.0)
        return projected

    return project


def _svg(
    plan: Planned,
    frames: FloatArray,
    times: FloatArray,
    timing: str,
    behind: Sequence[str] = (),
    before: Sequence[str] = (),
) -> str:
    """Write points (times, points, 2) down: the path of the last, the waypoints, and the sticks that move.

    Args:
        plan: The plan.
        frames: The points.
        times: Their times (times,), s.
        timing: The attributes of every `animate` that say how long it takes.
        behind: Elements that the robot is drawn over.
        before: Elements that are drawn over it.
    """
    tool = frames[:, -1]
    rows = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="100%" role="img">',
        f"<title>{escape(plan.path.robot.id)} in motion</title>",
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="#ffffff"/>',
        '<marker id="planner-joint" markerWidth="4" markerHeight="4" refX="2" refY="2">',
        '<circle cx="2" cy="2" r="1.1" fill="#333333" stroke="#ffffff" stroke-width="0.3"/></marker>',
        *behind,
        f'<polyline points="{_points(tool)}" fill="none" stroke="#0072B2" stroke-width="1.5"/>',
    ]
    named: dict[tuple[float, float], list[str]] = {}
    for stop in stops_of(plan):
        x, y = (float(np.interp(stop.arrival, times, tool[:, k])) for k in (0, 1))
        near = next((at for at in named if np.hypot(at[0] - x, at[1] - y) < SAME_POINT), (x, y))
        named.setdefault(near, []).append(stop.name)
        rows.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#0072B2"/>')
    for (x, y), names in named.items():
        name = escape(", ".join(dict.fromkeys(names)))
        rows.append(f'<text x="{x + 6:.1f}" y="{y - 6:.1f}" font-family="sans-serif" font-size="12">{name}</text>')
    values = ";".join(map(_points, frames))
    rows += [
        '<polyline fill="none" stroke="#555555" stroke-width="5" stroke-linejoin="round" stroke-linecap="round"',
        f' marker-start="url(#planner-joint)" marker-mid="url(#planner-joint)" points="{_points(frames[0])}">',
        f'<animate attributeName="points" {timing} values="{values}"/></polyline>',
    ]
    across, down = (";".join(f"{value:.1f}" for value in tool[:, k]) for k in (0, 1))
    rows += [
        f'<circle r="5" cx="{tool[0, 0]:.1f}" cy="{tool[0, 1]:.1f}" fill="#D55E00">',
        f'<animate attributeName="cx" {timing} values="{across}"/>',
        f'<animate attributeName="cy" {timing} values="{down}"/></circle>',
        *before,
        "</svg>",
    ]
    return well_formed("\n".join(rows))


def _points(points: FloatArray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
