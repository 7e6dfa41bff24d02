"""Corners cut: at each waypoint that is blended, from the curve that arrives over to the one that leaves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import SegmentedPolynomial, horner, quintic_hermite, shifted

MOST_BLENDED_SHARE = 0.48
"""Share of a segment that the blend at one of its ends may take; as much is for the other end, a little stays."""

BLEND_POINTS = 48
"""Points on a curve at which the tool's distance from the waypoint is looked at."""

BLEND_SEARCHES = 3
"""Number of looks at these points, finer each time; there are more where the radius is tiny."""

BLEND_DECREASE = 0.8
"""Factor by which the way to the waypoint is cut while the blend swings out beyond its radius."""

SHORT_SEGMENT_RATIO = 0.1
"""Length of a segment, relative to its blended length on the other side of the corner, below which the blend takes all
of it.

This applies only if the other end of the segment has no blend: the remainder would be too short for a turn. The same
fraction applies to the radius.
"""

WITHIN = 0.999
"""The fraction of the radius that a blend uses; the remainder covers the path between the checked points."""


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


class _Blends(NamedTuple):
    """The reach of blends before and after their corners, in lengths of the curve.

    Attributes:
        before: (corners,), distance of the start of each blend before its corner.
        after: (corners,), distance of the end of each blend after its corner.
        from_waypoint: (corners,), whether it begins at the waypoint before the corner.
        to_waypoint: (corners,), whether it ends at the waypoint after the corner.
    """

    before: FloatArray
    after: FloatArray
    from_waypoint: np.ndarray
    to_waypoint: np.ndarray

    def shorter(self, rows: np.ndarray) -> _Blends:
        """Return some of them (rows,) made shorter, but where they have to reach a waypoint."""
        before, after = self.before.copy(), self.after.copy()
        before[rows] *= np.where(self.from_waypoint[rows], 1.0, BLEND_DECREASE)
        after[rows] *= np.where(self.to_waypoint[rows], 1.0, BLEND_DECREASE)
        return self._replace(before=before, after=after)


def cut_corners(robot: Robot, curve: SegmentedPolynomial, waypoint_knots: np.ndarray, corners: Corners) -> BlendedCurve:
    """Cut corners by quintics in joint space that continue the curve's first and second derivatives.

    The curve after each corner is stretched so that the tool arrives and leaves at the same pace. So the blend extends
    equally far before and after the waypoint, in length of the curve. If the waypoint before is near the corner and is
    no corner itself, the blend begins there, and the curve keeps its pace. The same holds for the waypoint after.

    Args:
        robot: The robot, with its tool.
        curve: Joint positions, smooth but for the corners.
        waypoint_knots: (waypoints,), index of the breakpoint of the curve where each waypoint lies.
        corners: The waypoints to blend, none of them the first or the last.
    """
    behind = np.searchsorted(waypoint_knots, corners.knots)
    lengths = np.diff(curve.breakpoints[waypoint_knots])
    before, after = (
        _ways_within(robot, curve, corners, direction, MOST_BLENDED_SHARE * lengths[segments])
        for direction, segments in ((-1.0, behind - 1), (1.0, behind))
    )
    from_waypoint = _is_whole(robot, curve, corners, -1.0, lengths[behind - 1], after, np.isin(behind - 1, behind))
    to_waypoint = _is_whole(robot, curve, corners, 1.0, lengths[behind], before, np.isin(behind + 1, behind))
    before, after = (
        np.where(from_waypoint, lengths[behind - 1], before),
        np.where(to_waypoint, lengths[behind], after),
    )
    ratios: FloatArray = np.ones(len(lengths))
    ratios[behind] = np.where(from_waypoint | to_waypoint, 1.0, before / after)
    factors = np.cumprod(ratios)
    curve = curve.stretched(np.repeat(factors, np.diff(waypoint_knots)))
    blends = _Blends(before * factors[behind - 1], after * factors[behind], from_waypoint, to_waypoint)
    blends, coefficients = _blends(robot, curve, corners, blends)
    return _joined_with(curve, waypoint_knots, corners.knots, blends, coefficients)


def _is_whole(
    robot: Robot,
    curve: SegmentedPolynomial,
    corners: Corners,
    direction: float,
    lengths: FloatArray,
    beyond: FloatArray,
    blended: np.ndarray,
) -> np.ndarray:
    """Tell for each corner whether its blend takes the whole segment before (`direction` -1) or after (1) it.

    `lengths` (corners,) are of these segments, and `beyond` (corners,) the largest lengths of the blends on the other
    side. `blended` (corners,) tells which of the segments end at another corner.
    """
    whole: np.ndarray = (lengths <= SHORT_SEGMENT_RATIO * beyond) & ~blended
    rows = np.flatnonzero(whole)
    near = Corners(*(part[rows] for part in corners))
    whole[rows] = _ways_within(robot, curve, near, direction, lengths[rows]) == lengths[rows]
    return whole


def _ways_within(
    robot: Robot, curve: SegmentedPolynomial, corners: Corners, direction: float, most: FloatArray
) -> FloatArray:
    """Measure the length (corners,) of curve within the radius before (`direction` -1) or after (1) each corner.

    The search goes no further than the lengths `most` (corners,).
    """
    origins = curve.breakpoints[corners.knots]
    inside, beyond, looks = np.zeros(len(most)), most.copy(), 0
    rows = np.arange(len(most))
    while len(rows):  # each time finer, between the last point inside and the first outside
        looks += 1
        ways = np.linspace(inside[rows], beyond[rows], BLEND_POINTS, axis=1)
        at = origins[rows, None] + direction * ways
        positions = curve.evaluate(at.ravel(), [0])[0].reshape(*at.shape, -1)
        out = _distances(robot, positions, corners.positions[rows]) > WITHIN * corners.radii[rows, None]
        leaves, first = out.any(axis=1), out.argmax(axis=1)
        number = np.arange(len(rows))
        inside[rows] = np.where(leaves, ways[number, np.maximum(first - 1, 0)], beyond[rows])
        beyond[rows] = np.where(leaves, ways[number, first], beyond[rows])
        rows = rows[leaves & ((looks < BLEND_SEARCHES) | (inside[rows] == 0.0))]
    return inside


def _blends(robot: Robot, curve: SegmentedPolynomial, corners: Corners, blends: _Blends) -> tuple[_Blends, FloatArray]:
    """Return the blends that keep the tool within the radii.

    Returns:
        The blends, shorter where they would swing out, and the coefficients (corners, joints, 6).
    """
    origins, whole = curve.breakpoints[corners.knots], curve.breakpoints[-1]
    coefficients = np.zeros((len(origins), curve.coefficients.shape[1], 6))
    rows = np.arange(len(origins))
    while len(rows):  # those that swing out beyond their radius
        begins, ends = origins[rows] - blends.before[rows], origins[rows] + blends.after[rows]
        spans = blends.before[rows] + blends.after[rows]
        states = [curve.evaluate(np.clip(at, 0.0, whole)) for at in (begins, ends)]
        chords = (states[1][0] - states[0][0]) / spans[:, None]
        for own, away in zip(states, (begins, whole - ends), strict=True):
            # From rest and into it the blend is about straight: which way its waypoint lies is of no account.
            rests = (away <= NEGLIGIBLE_SHARE * spans)[:, None]
            own[1], own[2] = np.where(rests, chords, own[1]), np.where(rests, 0.0, own[2])
        coefficients[rows] = quintic_hermite(spans, *(tuple(own) for own in states))
        at = np.linspace(np.zeros_like(spans), spans, BLEND_POINTS, axis=1)
        positions = horner(coefficients[rows][:, None], at[..., None])
        swing = _distances(robot, positions, corners.positions[rows]).max(axis=1)
        rows = rows[swing > WITHIN * corners.radii[rows]]
        blends = blends.shorter(rows)
    return blends, coefficients


def _distances(robot: Robot, positions: FloatArray, centers: FloatArray) -> FloatArray:
    """Return distances (corners, N), m, of the tool at positions (corners, N, joints) from the centers (corners, 3)."""
    tools = tool_poses(robot, positions.reshape(-1, positions.shape[-1]))[0]
    distances: FloatArray = np.linalg.norm(tools.reshape(*positions.shape[:2], 3) - centers[:, None], axis=2)
    return distances


def _joined_with(
    curve: SegmentedPolynomial,
    waypoint_knots: np.ndarray,
    corners: np.ndarray,
    blends: _Blends,
    coefficients: FloatArray,
) -> BlendedCurve:
    """Return the curve with the blends in the place of its corners.

    `waypoint_knots` (waypoints,) and `corners` (corners,) are indices of breakpoints of the curve.
    """
    knots, behind = curve.breakpoints[waypoint_knots], np.searchsorted(waypoint_knots, corners)
    begins = np.where(blends.from_waypoint, knots[behind - 1], knots[behind] - blends.before)
    ends = np.where(blends.to_waypoint, knots[behind + 1], knots[behind] + blends.after)
    halves = (blends.before + blends.after) / 2.0
    middles = np.where(blends.from_waypoint | blends.to_waypoint, begins + halves, knots[behind])
    knots[behind] = middles
    cuts = np.union1d(curve.breakpoints, np.concatenate([begins, ends]))
    starts = cuts[:-1]
    pieces, offsets = curve.locate(starts)
    whole = (offsets == 0.0) & (cuts[1:] == curve.breakpoints[pieces + 1])
    lengths = np.where(whole, curve.lengths[pieces], np.diff(cuts))
    blend = np.searchsorted(begins, starts, side="right") - 1
    kept = (blend < 0) | (starts >= ends[blend])
    own = curve.coefficients[pieces]
    own = np.where((offsets > 0.0)[:, None, None], shifted(own, offsets[:, None]), own)
    starts = np.concatenate([starts[kept], begins, middles])
    parts = SegmentedPolynomial(
        np.concatenate([lengths[kept], halves, halves]),
        np.concatenate([own[kept], coefficients, shifted(coefficients, halves[:, None])]),
        np.concatenate([curve.segments[pieces[kept]], curve.segments[corners - 1], curve.segments[corners]]),
    )
    order = np.argsort(starts)
    starts = starts[order]
    at_waypoints = np.searchsorted(starts, knots)
    return BlendedCurve(parts.of(order), at_waypoints, np.searchsorted(starts, np.union1d(begins, ends)))
