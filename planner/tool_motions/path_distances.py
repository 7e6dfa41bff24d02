"""Distance between the tool's path in one motion and the path of another motion, regardless of time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial

CHORDS = 512
"""Number of chords that approximate a path of the tool.

A turn of an arm of 1 m has chords of 12 mm with an error of 0.02 mm, which the bounds include.
"""

POSITION_ROWS = 1024
"""Number of positions whose distances are computed at once, which bounds the memory that it takes."""

FIRST_SAMPLES = 65
"""Number of samples of a motion to begin with, so many that none of its turns is missed."""

DISTANCE_ERROR = 1e-4
"""Distance, m, by which the bound may exceed the true distance; it is below all requested accuracies."""

KNOWN_SHARE = 0.005
"""Fraction of the distance by which the bound may exceed the true distance, if that is more."""

KNOWN_OF_PATH = 1e-5
"""The same as a share of the length of the path: of a joint that turns fifty times it would take a million samples."""

CHORD_BISECTIONS = 20
"""Number of times that the part of a chord with the point nearest to another is halved: to 1e-6 of it."""

MOST_TIME_HALVINGS = 24
"""Times that steps are halved at most: then one of a second is 60 nanoseconds long."""


def farthest_from_path(
    robot: Robot, motion: PiecewisePolynomial, first: float, last: float, path: FloatArray
) -> tuple[float, float]:
    """Bound the largest distance of the tool from a path during a motion.

    Between two samples the tool is no further away than at one of them plus half of its path in between, which counts
    as straight. The function adds samples wherever that could matter, and adds the error of the chords.

    Args:
        robot: The robot, with its tool.
        motion: Joint positions by time.
        first: Start of the interval of time, s.
        last: Time until which it is looked at, s.
        path: (`CHORDS` + 1, joints), positions along the path.

    Returns:
        The distance, m, and its time, s. The distance is at least the true one. It exceeds it by at most 0.1 mm, half a
        percent, or a hundred-thousandth of the length of the path.
    """
    return _farthest(lambda positions: tool_poses(robot, positions)[0], _distances, 2, motion, first, last, path)


def joints_farthest_from_path(
    motion: PiecewisePolynomial, first: float, last: float, path: FloatArray
) -> tuple[float, float]:
    """Bound the largest distance of any joint from a path during a motion.

    The distance of two joint positions is the largest of any joint; see `farthest_from_path`.

    Returns:
        The distance, rad or m: no less than the true one, by as much more at most as there; and its time, s.
    """
    return _farthest(lambda positions: positions, _largest_distances, np.inf, motion, first, last, path)


def _farthest(
    points_at: Callable[[FloatArray], FloatArray],
    distances: Callable[[FloatArray, FloatArray], FloatArray],
    order: float,
    motion: PiecewisePolynomial,
    first: float,
    last: float,
    path: FloatArray,
) -> tuple[float, float]:
    """Bound the distance of the points of a motion from the points of a path.

    Args:
        points_at: The points (N, dimensions) of joint positions (N, joints).
        distances: The distances (N,) of points from the polygon through others, of the norm.
        order: The order of the norm, as numpy's.
        motion: Joint positions by time.
        first: Start of the interval of time, s.
        last: Time until which it is looked at, s.
        path: (`CHORDS` + 1, joints), positions along the path.
    """
    corners = points_at(path)
    known_to = max(DISTANCE_ERROR, KNOWN_OF_PATH * float(np.linalg.norm(np.diff(corners, axis=0), order, axis=1).sum()))
    sag = float(np.linalg.norm(np.diff(corners, 2, axis=0), order, axis=1).max()) / 8.0

    def sampled(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find the points (N, dimensions) at times (N,), and their distances (N,) from the path."""
        points = points_at(motion.evaluate(times, [0])[0])
        parts = [distances(points[row : row + POSITION_ROWS], corners) for row in range(0, len(points), POSITION_ROWS)]
        return points, np.concatenate(parts)

    inside = motion.breakpoints[(motion.breakpoints > first) & (motion.breakpoints < last)]
    times = np.union1d(np.linspace(first, last, FIRST_SAMPLES), inside)
    points, away = sampled(times)
    for _ in range(MOST_TIME_HALVINGS):
        bounds = np.maximum(away[:-1], away[1:]) + np.linalg.norm(np.diff(points, axis=0), order, axis=1) / 2.0
        farthest = float(away.max())
        rough = np.flatnonzero(bounds > farthest + max(known_to, KNOWN_SHARE * farthest))
        if not len(rough):
            break
        middles = (times[rough] + times[rough + 1]) / 2.0
        new_points, new_away = sampled(middles)
        times, points, away = (
            np.insert(old, rough + 1, new, axis=0)
            for old, new in ((times, middles), (points, new_points), (away, new_away))
        )
    return float(bounds.max()) + sag, float(times[away.argmax()])


def _distances(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the distances (N,) of points (N, 3) from the polygon through corners (M, 3)."""
    squares = (points**2).sum(axis=1)[:, None] - 2.0 * points @ corners.T + (corners**2).sum(axis=1)
    nearest = squares.argmin(axis=1)
    found: FloatArray = np.linalg.norm(points - corners[nearest], axis=1)
    steps = np.diff(corners, axis=0)
    lengths = np.maximum((steps**2).sum(axis=1), np.finfo(float).tiny)
    for chord in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(steps) - 1)):
        since = points - corners[chord]
        share = np.clip((since * steps[chord]).sum(axis=1) / lengths[chord], 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(since - share[:, None] * steps[chord], axis=1))
    return found


def _largest_distances(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the distances (N,) of points (N, joints) from the polygon through corners (M, joints), largest norm."""
    away = np.max([np.abs(points[:, [joint]] - corners[:, joint]) for joint in range(points.shape[1])], axis=0)
    nearest = away.argmin(axis=1)
    found: FloatArray = away[np.arange(len(points)), nearest]
    steps = np.diff(corners, axis=0)
    rows = np.arange(len(points))
    for chord in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(steps) - 1)):
        since, along = points - corners[chord], steps[chord]
        share, step = np.zeros(len(points)), 1.0
        for _ in range(CHORD_BISECTIONS):  # the distance is convex: it falls as long as that of the farthest joint does
            step /= 2.0
            gaps = since - (share + step)[:, None] * along
            farthest = np.abs(gaps).argmax(axis=1)
            share += step * (gaps[rows, farthest] * along[rows, farthest] > 0.0)
        found = np.minimum(found, np.abs(since - share[:, None] * along).max(axis=1))
    return found
