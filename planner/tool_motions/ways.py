"""How far one motion takes the tool from the way of another, whenever it is there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.forward import tool_poses

if TYPE_CHECKING:
    from planner.polynomials import PiecewisePolynomial
    from planner.robots import Robot
    from planner.spatial import FloatArray

CHORDS = 512
"""Number of chords that stand for a way of the tool: of a turn of an arm of 1 m they are 12 mm long and off by 0.02 mm,
which is counted."""

ROWS = 1024
"""Number of positions whose distances are computed at once, which bounds the memory that it takes."""

FIRST_SAMPLES = 65
"""Number of samples of a motion to begin with, so many that none of its turns is missed."""

KNOWN_TO = 1e-4
"""Distance, m, by which the true one may be less than what is found: less than anybody asks."""

KNOWN_SHARE = 0.005
"""Share of the distance by which the true one may be less than what is found, if that is more."""

MOST_HALVINGS = 24
"""Times that steps are halved at most: then one of a second is 60 nanoseconds long."""


def farthest_from_way(
    robot: Robot, motion: PiecewisePolynomial, first: float, last: float, way: FloatArray
) -> tuple[float, float]:
    """Bound how far a motion takes the tool from a way, wherever on it that is.

    Between two samples the tool is no further away than at one of them and half of its path in between, which is taken
    for straight there. Samples are put in between wherever that could matter; how far chords are off the way is added.

    Args:
        robot: The robot, with its tool.
        motion: Joint positions by time.
        first: Time from which on it is looked at, s.
        last: Time until which it is looked at, s.
        way: (`CHORDS` + 1, joints), positions along the way.

    Returns:
        The distance, m: no less than the true one, by 0.1 mm or half a percent more at most; and the time of it, s.
    """
    corners = tool_poses(robot, way)[0]
    sag = float(np.linalg.norm(np.diff(corners, 2, axis=0), axis=1).max()) / 8.0

    def sampled(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find the places (N, 3) of the tool at times (N,), and their distances (N,) from the way."""
        tools = tool_poses(robot, motion.evaluate(times, [0])[0])[0]
        parts = [_distances(tools[row : row + ROWS], corners) for row in range(0, len(tools), ROWS)]
        return tools, np.concatenate(parts)

    inside = motion.breakpoints[(motion.breakpoints > first) & (motion.breakpoints < last)]
    times = np.union1d(np.linspace(first, last, FIRST_SAMPLES), inside)
    tools, away = sampled(times)
    for _ in range(MOST_HALVINGS):
        bounds = np.maximum(away[:-1], away[1:]) + np.linalg.norm(np.diff(tools, axis=0), axis=1) / 2.0
        farthest = float(away.max())
        rough = np.flatnonzero(bounds > farthest + max(KNOWN_TO, KNOWN_SHARE * farthest))
        if not len(rough):
            break
        middles = (times[rough] + times[rough + 1]) / 2.0
        new_tools, new_away = sampled(middles)
        times, tools, away = (
            np.insert(old, rough + 1, new, axis=0)
            for old, new in ((times, middles), (tools, new_tools), (away, new_away))
        )
    return float(bounds.max()) + sag, float(times[away.argmax()])


def _distances(points: FloatArray, corners: FloatArray) -> FloatArray:
    """The distances (N,) of points (N, 3) from the polygon through corners (M, 3)."""
    squares = (points**2).sum(axis=1)[:, None] - 2.0 * points @ corners.T + (corners**2).sum(axis=1)
    nearest = squares.argmin(axis=1)
    found: FloatArray = np.linalg.norm(points - corners[nearest], axis=1)
    ways = np.diff(corners, axis=0)
    lengths = np.maximum((ways**2).sum(axis=1), np.finfo(float).tiny)
    for chord in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(ways) - 1)):
        since = points - corners[chord]
        share = np.clip((since * ways[chord]).sum(axis=1) / lengths[chord], 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(since - share[:, None] * ways[chord], axis=1))
    return found
