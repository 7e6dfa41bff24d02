"""Coordinates of open waypoints for which the estimated duration is least: successive linear programmes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from planner.planning.off_path.leg_times import LegTimes
from planner.planning.off_path.open_waypoints import OpenWaypoint
from planner.spatial import FloatArray

MOST_PROGRAMMES = 25
"""The most linear programmes of one descent; most need ten."""

LEAST_PREDICTED_GAIN = 1e-4
"""The predicted gain, relative to the estimate, below which a descent ends."""

FINITE_DIFFERENCE = 1e-6
"""The step of finite differences, rad or m."""

LARGEST_TRUST_RADIUS = 0.5
"""The largest change of a direction in one step, rad or m."""

LEAST_TRUST_RADIUS = 1e-4
"""The largest change below which a descent ends, rad or m."""


@dataclass(frozen=True, eq=False)
class Points:
    """The joint positions of a path, some of which are open.

    Attributes:
        rows: The open waypoints with their rows on the path.
        coordinates: Their coordinates, one array each.
        positions: (waypoints, joints), rad or m, of the whole path.
    """

    rows: Sequence[tuple[OpenWaypoint, int]]
    coordinates: tuple[FloatArray, ...]
    positions: FloatArray

    def tangents(self) -> list[FloatArray]:
        """Return the directions (directions, coordinates) of each open waypoint."""
        return [waypoint.tangent(own) for (waypoint, _), own in zip(self.rows, self.coordinates, strict=True)]

    def moved(self, steps: Sequence[FloatArray]) -> Points | None:
        """Return the points after steps of the coordinates; None: a pose is not met any more."""
        found, positions = [], self.positions.copy()
        for (waypoint, row), own, step in zip(self.rows, self.coordinates, steps, strict=True):
            solved = waypoint.returned(own + step) if step.any() else own
            if solved is None:
                return None
            found.append(solved)
            positions[row] = waypoint.position(solved)
        return replace(self, coordinates=tuple(found), positions=positions)


def descended(points: Points, times: LegTimes, reach: float) -> Points:
    """Return points with a lower estimated duration, by linear programmes within a trust region.

    The estimate is a sum of largest values. Each programme takes these values as linear in the tangent directions, and
    bounds them from above. See Madsen, Nielsen, "Linearly constrained minimax optimization", Math. Program. 14, 1978.

    Args:
        points: The start.
        times: The estimate.
        reach: The largest distance of each coordinate from the start, rad or m.
    """
    start, value, radius = points, float(times(points.positions).total), min(reach, LARGEST_TRUST_RADIUS)
    for _ in range(MOST_PROGRAMMES):
        if radius < LEAST_TRUST_RADIUS:
            break
        steps, predicted = _linear_step(points, start, times, radius, reach)
        if value - predicted < LEAST_PREDICTED_GAIN * value:
            break
        ahead = points.moved(steps)
        found = np.inf if ahead is None else float(times(ahead.positions).total)
        if ahead is not None and found < value - 0.1 * (value - predicted):
            points, value, radius = ahead, found, min(2.0 * radius, LARGEST_TRUST_RADIUS)
        else:
            radius /= 4.0
    return points


def _linear_step(
    points: Points, start: Points, times: LegTimes, radius: float, reach: float
) -> tuple[list[FloatArray], float]:
    """Return the steps (coordinates,) of the open waypoints for the least linear estimate, and that estimate, s."""
    tangents = points.tangents()
    count = sum(map(len, tangents))
    shifted = np.repeat(points.positions[None], count, axis=0)
    lower, upper, directions = [], [], np.zeros((sum(map(len, points.coordinates)), count))
    row = first = 0
    for (waypoint, k), own, origin, tangent in zip(
        points.rows, points.coordinates, start.coordinates, tangents, strict=True
    ):
        columns = np.arange(first, first + len(tangent))
        shifted[columns[:, None], k, waypoint.joints] += FINITE_DIFFERENCE * tangent[:, : len(waypoint.joints)]
        directions[row : row + len(own), columns] = tangent.T
        lower.append(np.maximum(waypoint.search.lower, origin - reach) - own)
        upper.append(np.minimum(waypoint.search.upper, origin + reach) - own)
        row, first = row + len(own), first + len(tangent)
    here = times(points.positions)
    values, weights = here.values, here.weights
    slopes = np.moveaxis((times(shifted).values - values) / FINITE_DIFFERENCE, 0, -1)  # (parts, joints, directions)
    moves = np.abs(slopes).max(axis=(1, 2)) > 0.0
    total = float(here.total) - float((weights * np.abs(values).max(axis=1))[moves].sum())
    slopes, values, weights = slopes[moves], values[moves], weights[moves]
    parts, joints = values.shape
    largest = -np.repeat(np.eye(parts), joints, axis=0)
    slopes, flat = slopes.reshape(-1, count), values.reshape(-1)
    above, below = np.minimum(np.concatenate(lower), 0.0), np.maximum(np.concatenate(upper), 0.0)
    matrix = np.block(
        [[slopes, largest], [-slopes, largest], [directions, np.zeros((len(directions), parts))],
         [-directions, np.zeros((len(directions), parts))]]
    )  # fmt: skip
    bounds = np.concatenate([-flat, flat, below, -above])
    keep = np.isfinite(bounds)
    result = linprog(
        np.concatenate([np.zeros(count), weights]),
        A_ub=matrix[keep],
        b_ub=bounds[keep],
        bounds=[(-radius, radius)] * count + [(0.0, None)] * parts,
        method="highs",
    )
    if result.x is None:
        return [np.zeros_like(own) for own in points.coordinates], float(here.total)
    step = directions @ result.x[:count]
    ends = np.cumsum([len(own) for own in points.coordinates])[:-1]
    return np.split(step, ends), total + float(result.fun)
