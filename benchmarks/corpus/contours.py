"""Contours at a steady speed: gluing, deburring, spray painting, and inspection."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.corpus.job import Draft
from benchmarks.corpus.programme import STOP, THROUGH, Programme
from planner.limits import Limits
from planner.spatial import FloatArray, Pose, rotation_x, rotation_y

if TYPE_CHECKING:
    from benchmarks.corpus.arms import Place

QUARTER = np.pi / 2.0


def gluing(place: Place, variant: int) -> Draft:
    """Draw a bead around a rounded rectangle, by tangent arcs or by blends; or an S of arcs only."""
    speed, shape = (0.05, 0.1, 0.2)[variant % 3], variant // 3 % 3
    a, b, r = (0.15, 0.1, 0.02) if variant % 2 else (0.2, 0.12, 0.04)
    programme = Programme(place, place.at(-a, -b + r, 0.0))
    if shape == 0:
        programme = Programme(place, place.at(-a + r, -b, 0.0))
        corners = (
            (a - r, r - b, -QUARTER),
            (a - r, b - r, 0.0),
            (r - a, b - r, QUARTER),
            (r - a, r - b, 2.0 * QUARTER),
        )
        for x, y, angle in corners:
            first, middle, last = (
                place.at(x + r * np.cos(t), y + r * np.sin(t), 0.0) for t in angle + QUARTER * np.array([0.0, 0.5, 1.0])
            )
            passing = programme.blend(r / 4.0)
            programme.line(first, speed=speed, transition=passing)
            programme.arc(middle.position, last, speed=speed, transition=passing)
    elif shape == 1:
        for x, y in ((-a, b), (a, b), (a, -b), (-a, -b), (-a, -b + r)):
            programme.line(place.at(x, y, 0.0), speed=speed, transition=programme.blend(r / 4.0))
    else:
        programme = Programme(place, place.at(-a, 0.0, 0.0))
        for k in range(4):
            x, side = -a + a * (k + 0.5) / 2.0, (-1) ** k * a / 4.0
            end = place.at(-a + a * (k + 1.0) / 2.0, 0.0, 0.0)
            programme.arc(place.at(x, side, 0.0).position, end, speed=speed, transition=programme.blend(r / 8.0))
    return Draft(programme, {"speed": speed, "shape": ("arcs", "blends", "waves")[shape]})


COUNTS = (50, 80, 120, 50, 200, 80, 120, 300, 50, 500, 80, 1000)
"""Points of a contour from a CAM program."""


def deburring(place: Place, variant: int) -> Draft:
    """Return a dense, uneven polyline around a freeform edge: lines with blends, or joint motions passed through."""
    count, joint = COUNTS[variant % 12], variant % 3 == 2
    speed = (0.05, 0.2)[variant % 2]
    rng = np.random.default_rng(variant)
    # Chord lengths as a CAM program spaces them: long on the flat, ten times shorter in the curves, never equal.
    steps = (0.1 + 0.9 * np.cos(np.linspace(0.0, 6.0 * np.pi, count - 1)) ** 2) * rng.uniform(0.7, 1.3, count - 1)
    t = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    points = contour(t)
    shortest = float(np.linalg.norm(np.diff(points, axis=0), axis=1).min())
    programme = Programme(place, place.at(*points[0]))
    for k in range(1, count):
        if joint:
            programme.to(place.at(*points[k]), transition=THROUGH)
        else:
            programme.line(place.at(*points[k]), transition=programme.blend(0.3 * shortest))
    limits = Limits(tcp_linear_velocity=speed)
    return Draft(programme, {"points": count, "joint": joint, "speed": speed}, limits)


def contour(t: FloatArray) -> FloatArray:
    """Return points (N, 3) of an open edge: an arc of 0.15 m with waves of 5 mm."""
    angle = 1.5 * np.pi * t
    radius = 0.15 + 0.005 * np.sin(8.0 * angle)
    return np.column_stack([radius * np.cos(angle) - 0.05, radius * np.sin(angle), 0.01 * np.sin(2.0 * angle)])


def spraying(place: Place, variant: int) -> Draft:
    """Return a raster over a panel: long strokes and short steps, by blends, by half circles, or with stops."""
    strokes, turning, speed = (4, 6, 10)[variant % 3], variant // 3 % 3, (0.3, 0.8)[variant % 2]
    pitch = 0.3 / strokes
    tilt = rotation_y((0.0, 0.3)[variant % 2])
    programme = Programme(place, place.at(-0.15, -0.15, 0.0, tilt))
    passing = STOP if turning == 2 else programme.blend(pitch / 4.0)
    for k in range(strokes):
        x, y = 0.15 * (-1) ** k, -0.15 + pitch * k
        programme.line(place.at(x, y, 0.0, tilt), speed=speed, transition=passing)
        if k == strokes - 1:
            break
        end = place.at(x, y + pitch, 0.0, tilt)
        if turning == 1:
            over = place.at(x + 0.5 * pitch * (-1) ** k, y + pitch / 2.0, 0.0).position
            programme.arc(over, end, speed=speed, transition=passing)
        else:
            programme.line(end, speed=speed, transition=passing)
    return Draft(programme, {"strokes": strokes, "turning": ("blends", "arcs", "stops")[turning], "speed": speed})


def inspection(place: Place, variant: int) -> Draft:
    """Return a probe or a camera around a part: only the position counts, or the tool tilts at every view."""
    views, free = (3, 6, 12, 24)[variant % 4], variant % 3 != 2
    passing = (STOP, THROUGH)[variant // 4 % 2]
    dwell = 0.1 if passing is STOP else 0.0
    programme = Programme(place)
    for k in range(views):
        angle = 2.0 * np.pi * k / views
        x, y, z = 0.15 * np.cos(angle), 0.15 * np.sin(angle), 0.05 * (k % 2)
        pose = place.at(x, y, z, rotation_x(-0.3 * np.sin(angle)) @ rotation_y(-0.3 * np.cos(angle)))
        programme.to(Pose(pose.position) if free else pose, transition=passing, dwell=dwell)
    programme.joints(place.position)
    return Draft(programme, {"views": views, "free": free, "through": passing is THROUGH})


def trimming(place: Place, variant: int) -> Draft:
    """Cut a blank along one closed polyline: a star, whose points are cut; or a comb."""
    count, speed, blend = (4, 8, 16)[variant % 3], (0.05, 0.15)[variant % 2], (0.005, 0.02)[variant // 3 % 2]
    angles = 2.0 * np.pi * np.arange(2 * count + 1) / (2 * count)
    radii = np.where(np.arange(2 * count + 1) % 2, (0.1, 0.15)[variant % 2], 0.18)
    points = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 0.01 * np.cos(3.0 * angles)])
    if variant // 6 % 3 == 2:
        points = np.array([(-0.15 + 0.3 * (k // 2) / count, 0.08 * (k // 2 % 2) - 0.04, 0.0) for k in range(2 * count)])
        points[1::2, 0] += 0.15 / count
    programme = Programme(place, place.at(*points[0]))
    programme.polyline([place.at(*point) for point in points[1:]], blend, speed)
    return Draft(programme, {"corners": len(points) - 2, "speed": speed, "blend": blend})


FAMILIES = {
    "gluing": gluing,
    "deburring": deburring,
    "spraying": spraying,
    "inspection": inspection,
    "trimming": trimming,
}
