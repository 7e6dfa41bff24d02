"""Corners cut: at each waypoint that is blended, from the curve that arrives over to the one that leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.polynomials import SegmentedPolynomial, horner, quintic_hermite, shifted

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray

MOST = 0.48
"""Share of a segment that the blend at one of its ends may take; as much is for the other end, a little stays."""

SAMPLES = 48
"""Points on a curve at which the tool's distance from the waypoint is looked at."""

LOOKS = 3
"""Number of looks at these points, finer each time; there are more where the radius is tiny."""

SHRINK = 0.8
"""Factor by which the way to the waypoint is cut while the blend swings out beyond its radius."""

WITHIN = 0.999
"""The share of the radius that a blend uses: the rest is for what lies between the points looked at."""


class Corners(NamedTuple):
    """The waypoints that are blended.

    Attributes:
        knots: (corners,), index of the breakpoint of the curve where each lies.
        positions: (corners, 3), m, of the tool there.
        radii: (corners,), m, that the tool stays within while it cuts the corner.
    """

    knots: np.ndarray
    positions: FloatArray
    radii: FloatArray


class BlendedCurve(NamedTuple):
    """A curve whose corners are cut.

    Attributes:
        curve: Joint positions over a length.
        waypoint_knots: (waypoints,), index of the breakpoint where each waypoint lies, or the middle of its blend.
        blend_knots: Indices of the breakpoints where blends begin and end, ascending.
    """

    curve: SegmentedPolynomial
    waypoint_knots: np.ndarray
    blend_knots: np.ndarray


def cut_corners(robot: Robot, curve: SegmentedPolynomial, waypoint_knots: np.ndarray, corners: Corners) -> BlendedCurve:
    """Cut corners by quintics in joint space, with the first and second derivatives of the curve at both of their ends.

    Behind each corner the curve is stretched so that the tool comes and goes at the same pace: the blend begins as far
    before the waypoint, in length of the curve, as it ends after it.

    Args:
        robot: The robot, with its tool.
        curve: Joint positions, smooth but for the corners.
        waypoint_knots: (waypoints,), index of the breakpoint of the curve where each waypoint lies.
        corners: The waypoints to blend, none of them the first or the last.
    """
    knots = curve.breakpoints[waypoint_knots]
    behind = np.searchsorted(waypoint_knots, corners.knots)
    lengths = np.diff(knots)
    before, after = (
        _ways_within(robot, curve, corners, direction, MOST * lengths[segments])
        for direction, segments in ((-1.0, behind - 1), (1.0, behind))
    )
    ratios: FloatArray = np.ones(len(lengths))
    ratios[behind] = before / after
    factors = np.cumprod(ratios)
    curve = curve.stretched(np.repeat(factors, np.diff(waypoint_knots)))
    ways, coefficients = _blends(robot, curve, corners, before * factors[behind - 1])
    return _joined_with(curve, waypoint_knots, corners.knots, ways, coefficients)


def _ways_within(
    robot: Robot, curve: SegmentedPolynomial, corners: Corners, direction: float, most: FloatArray
) -> FloatArray:
    """How far (corners,) before (`direction` -1) or after (1) each corner the curve stays within its radius.

    Args:
        robot: The robot, with its tool.
        curve: Joint positions.
        corners: N corners.
        direction: Which side of the corners.
        most: (corners,), how far is looked.
    """
    origins = curve.breakpoints[corners.knots]
    inside, beyond, looks = np.zeros(len(most)), most.copy(), 0
    rows = np.arange(len(most))
    while len(rows):  # each time finer, between the last point inside and the first outside
        looks += 1
        ways = np.linspace(inside[rows], beyond[rows], SAMPLES, axis=1)
        at = origins[rows, None] + direction * ways
        positions = curve.evaluate(at.ravel(), [0])[0].reshape(*at.shape, -1)
        out = _distances(robot, positions, corners.positions[rows]) > WITHIN * corners.radii[rows, None]
        leaves, first = out.any(axis=1), out.argmax(axis=1)
        number = np.arange(len(rows))
        inside[rows] = np.where(leaves, ways[number, np.maximum(first - 1, 0)], beyond[rows])
        beyond[rows] = np.where(leaves, ways[number, first], beyond[rows])
        rows = rows[leaves & ((looks < LOOKS) | (inside[rows] == 0.0))]
    return inside


def _blends(
    robot: Robot, curve: SegmentedPolynomial, corners: Corners, ways: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The blends that keep the tool within the radii.

    Args:
        robot: The robot, with its tool.
        curve: Joint positions.
        corners: N corners.
        ways: (corners,), over which the blends would begin before and end after the corners.

    Returns:
        The ways (corners,), shorter where a blend would swing out, and the coefficients (corners, joints, 6).
    """
    origins, ways = curve.breakpoints[corners.knots], ways.copy()
    coefficients = np.zeros((len(ways), curve.coefficients.shape[1], 6))
    rows = np.arange(len(ways))
    while len(rows):  # those that swing out beyond their radius
        spans = 2.0 * ways[rows]
        starts, ends = (tuple(curve.evaluate(origins[rows] + side * ways[rows])) for side in (-1.0, 1.0))
        coefficients[rows] = quintic_hermite(spans, starts, ends)
        at = np.linspace(np.zeros_like(spans), spans, SAMPLES, axis=1)
        positions = horner(coefficients[rows][:, None], at[..., None])
        swing = _distances(robot, positions, corners.positions[rows]).max(axis=1)
        rows = rows[swing > WITHIN * corners.radii[rows]]
        ways[rows] *= SHRINK
    return ways, coefficients


def _distances(robot: Robot, positions: FloatArray, centers: FloatArray) -> FloatArray:
    """The distances (corners, N), m, of the tool at positions (corners, N, joints) from the centers (corners, 3)."""
    tools = tool_poses(robot, positions.reshape(-1, positions.shape[-1]))[0]
    distances: FloatArray = np.linalg.norm(tools.reshape(*positions.shape[:2], 3) - centers[:, None], axis=2)
    return distances


def _joined_with(
    curve: SegmentedPolynomial,
    waypoint_knots: np.ndarray,
    corners: np.ndarray,
    ways: FloatArray,
    blends: FloatArray,
) -> BlendedCurve:
    """The curve with the blends in the place of its corners.

    Args:
        curve: Joint positions.
        waypoint_knots: (waypoints,), index of the breakpoint where each waypoint lies.
        corners: (corners,), index of the breakpoint where each corner lies.
        ways: (corners,), over which the blends begin before and end after them.
        blends: (corners, joints, 6), coefficients.
    """
    middles = curve.breakpoints[corners]
    begins, ends = middles - ways, middles + ways
    cuts = np.union1d(curve.breakpoints, np.concatenate([begins, ends]))
    starts = cuts[:-1]
    pieces, offsets = curve.locate(starts)
    whole = (offsets == 0.0) & (cuts[1:] == curve.breakpoints[pieces + 1])
    lengths = np.where(whole, curve.lengths[pieces], np.diff(cuts))
    blend = np.searchsorted(begins, starts, side="right") - 1
    kept = (blend < 0) | (starts >= ends[blend])
    own = curve.coefficients[pieces]
    coefficients = np.where((offsets > 0.0)[:, None, None], shifted(own, offsets[:, None]), own)
    starts = np.concatenate([starts[kept], begins, middles])
    parts = SegmentedPolynomial(
        np.concatenate([lengths[kept], ways, ways]),
        np.concatenate([coefficients[kept], blends, shifted(blends, ways[:, None])]),
        np.concatenate([curve.segments[pieces[kept]], curve.segments[corners - 1], curve.segments[corners]]),
    )
    order = np.argsort(starts)
    starts = starts[order]
    at_waypoints = np.searchsorted(starts, curve.breakpoints[waypoint_knots])
    return BlendedCurve(parts.of(order), at_waypoints, np.searchsorted(starts, np.union1d(begins, ends)))
