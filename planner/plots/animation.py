"""The moving stick model of a robot along a trajectory in its scene, as an SVG that plays by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape

import numpy as np

from planner.plots.quantities import MILLIMETRES, Planned, stops_of
from planner.plots.space.moving import Frames, Painted, Projection, paint_surroundings
from planner.plots.space.surroundings import shown_points, surroundings
from planner.plots.style import svg_points, well_formed
from planner.plots.view import VIEWS, View, joined_names, stick_model
from planner.spatial import FloatArray

FRAMES_PER_SECOND = 20.0
"""Joint positions computed for a second of the trajectory; the animation interpolates between them."""

ANIMATION_FRAMES = 400
"""The most joint positions of an animation, which is some tens of kilobytes large."""

LEAST_ANIMATION_DURATION = 0.01
"""Least duration of an animation, s: of a robot that rests, too."""

WIDTH = 640.0
"""Width of an animation, points."""

HEIGHT = 480.0
"""Height of an animation, points."""

EDGE = 40.0
"""Space around the moving picture, points."""

SHARED_NAME_DISTANCE = 8.0
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
    """An animation of a robot, which notebooks and browsers repeat.

    Attributes:
        svg: The animated picture.
        duration: The duration of one repetition, s.
    """

    svg: str
    duration: float

    def _repr_html_(self) -> str:
        return PAGE.format(svg=self.svg, duration=self.duration, width=WIDTH)


def animate(plan: Planned, *, view: str = "isometric", speed: float = 1.0) -> Animation:
    """Animate the stick model of a robot along a planned trajectory, with its scene and attached objects.

    Args:
        plan: The plan.
        view: The direction of view: `isometric`, or onto the plane `xy`, `xz` or `yz` of the base.
        speed: Seconds of the trajectory in one second of the animation.

    Raises:
        ValueError: The view is unknown, or the speed is not a positive number.
    """
    if view not in VIEWS:
        raise ValueError(f"view: {view}; there are {', '.join(VIEWS)}")
    if not 0.0 < speed < np.inf:
        raise ValueError(f"a trajectory cannot be played at {speed} times its speed")
    trajectory = plan.trajectory
    count = int(np.clip(np.ceil(trajectory.duration * FRAMES_PER_SECOND / speed), 2, ANIMATION_FRAMES)) + 1
    times = np.linspace(0.0, trajectory.duration, count)
    (positions,) = trajectory.evaluate(times, (0,))
    segments = trajectory.segments[trajectory.locate(times)[0]].tolist()
    models = np.array(
        [
            stick_model(plan.path.dynamics.robot_on(segment), position)
            for segment, position in zip(segments, positions, strict=True)
        ]
    )  # (times, points, 3)
    duration = max(trajectory.duration / speed, LEAST_ANIMATION_DURATION)
    timing = f'dur="{duration:.4f}s" repeatCount="indefinite"'
    points = models.reshape(-1, 3)
    things = surroundings(plan)
    shown = shown_points(things, points)
    project = _projecting(shown, VIEWS[view])
    painted = Painted([], [])
    if things:
        seen = Projection(VIEWS[view], project)
        painted = paint_surroundings(plan, Frames(segments, positions, times), models, shown, seen, timing)
    return Animation(_svg(plan, project(models), times, timing, painted), duration)


def _projecting(points: FloatArray, view: View) -> Callable[[FloatArray], FloatArray]:
    """Return what takes points (..., 3), m, to the picture (..., 2) that shows all of some points (N, 3), m."""
    shown = view.project(points) * MILLIMETRES
    low, extent = shown.min(axis=0), np.maximum(np.ptp(shown, axis=0), 1.0)
    scale = float(((WIDTH - 2.0 * EDGE, HEIGHT - 2.0 * EDGE) / extent).min())
    middle = 0.5 * np.array([WIDTH, HEIGHT])

    def project(those: FloatArray) -> FloatArray:
        projected: FloatArray = middle + (view.project(those) * MILLIMETRES - low - 0.5 * extent) * scale * (1.0, -1.0)
        return projected

    return project


def _svg(plan: Planned, frames: FloatArray, times: FloatArray, timing: str, painted: Painted) -> str:
    """Write the path of the last of the points (times, points, 2), the waypoints, and the moving sticks.

    `timing` has the attributes of every `animate` with its duration.
    """
    tool = frames[:, -1]
    rows = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="100%" role="img">',
        f"<title>{escape(plan.path.robot.id)} in motion</title>",
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="#ffffff"/>',
        '<marker id="planner-joint" markerWidth="4" markerHeight="4" refX="2" refY="2">',
        '<circle cx="2" cy="2" r="1.1" fill="#333333" stroke="#ffffff" stroke-width="0.3"/></marker>',
        *painted.behind,
        f'<polyline points="{svg_points(tool)}" fill="none" stroke="#0072B2" stroke-width="1.5"/>',
    ]
    stops = stops_of(plan)
    marks = np.array([[np.interp(stop.arrival, times, tool[:, k]) for k in (0, 1)] for stop in stops])
    rows += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#0072B2"/>' for x, y in marks.tolist()]
    for row, names in joined_names(marks, [stop.name for stop in stops], SHARED_NAME_DISTANCE):
        x, y = marks[row] + (6.0, -6.0)
        name = escape(", ".join(names))
        rows.append(f'<text x="{x:.1f}" y="{y:.1f}" font-family="sans-serif" font-size="12">{name}</text>')
    values = ";".join(map(svg_points, frames))
    rows += [
        '<polyline fill="none" stroke="#555555" stroke-width="5" stroke-linejoin="round" stroke-linecap="round"',
        f' marker-start="url(#planner-joint)" marker-mid="url(#planner-joint)" points="{svg_points(frames[0])}">',
        f'<animate attributeName="points" {timing} values="{values}"/></polyline>',
    ]
    across, down = (";".join(f"{value:.1f}" for value in tool[:, k]) for k in (0, 1))
    rows += [
        f'<circle r="5" cx="{tool[0, 0]:.1f}" cy="{tool[0, 1]:.1f}" fill="#D55E00">',
        f'<animate attributeName="cx" {timing} values="{across}"/>',
        f'<animate attributeName="cy" {timing} values="{down}"/></circle>',
        *painted.before,
        "</svg>",
    ]
    return well_formed("\n".join(rows))
