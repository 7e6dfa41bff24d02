"""Corners cut: from one curve over to the next, near the waypoint where they meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.forward import tool_pose
from planner.polynomials import PiecewisePolynomial, quintic_hermite

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray

MOST = 0.48
"""Share of a segment that the blend at one of its ends may take; as much is for the other end, a little stays."""

SAMPLES = 48
"""Points on a curve at which the tool's distance from the waypoint is looked at."""

LOOKS = 3
"""At the points, finer each time; more where the radius is tiny."""

SHRINK = 0.8
"""What the way to the waypoint is cut by while the blend swings out beyond its radius."""

WITHIN = 0.999
"""The share of the radius that a blend uses: the rest is for what lies between the points looked at."""


@dataclass(frozen=True, eq=False)
class Blend:
    """A quintic in joint space that leaves one curve and joins the next, with their first and second derivatives.

    Attributes:
        start: Where on the arriving curve it begins.
        end: Where on the leaving curve it ends.
        arriving: Its first half.
        leaving: Its second half.
    """

    start: float
    end: float
    arriving: PiecewisePolynomial
    leaving: PiecewisePolynomial


def ways_within(
    robot: Robot, before: PiecewisePolynomial, after: PiecewisePolynomial, corner: FloatArray, radius: float
) -> tuple[float, float]:
    """How far before and after their common waypoint two curves stay within its radius; at most nearly half of each.

    Args:
        robot: With its tool.
        before: Joint path to the waypoint.
        after: Joint path from it.
        corner: (3,), m: position of the tool at the waypoint.
        radius: m.
    """
    radius *= WITHIN
    return _way_within(robot, before, -1.0, corner, radius), _way_within(robot, after, 1.0, corner, radius)


def blend(
    robot: Robot, before: PiecewisePolynomial, after: PiecewisePolynomial, way: float, corner: FloatArray, radius: float
) -> Blend:
    """The blend from one curve to the next that keeps the tool within the radius of the waypoint where they meet.

    Args:
        robot: With its tool.
        before: Joint path to the waypoint.
        after: Joint path from it.
        way: Over which the blend begins before and ends after the waypoint; less where it would swing out.
        corner: (3,), m: position of the tool at the waypoint.
        radius: m.
    """
    length = float(before.breakpoints[-1])
    while True:
        start, end = np.array([length - way]), np.array([way])
        ends = before.evaluate(start), after.evaluate(end)
        span = np.array([2.0 * way])
        whole = PiecewisePolynomial(span, quintic_hermite(span, tuple(ends[0]), tuple(ends[1])))
        at = np.linspace(0.0, span[0], SAMPLES)
        if _distances(robot, whole.evaluate(at, [0])[0], corner).max() <= radius * WITHIN:
            return Blend(float(start[0]), way, whole.between(0.0, way), whole.between(way, span[0]))
        way *= SHRINK


def _way_within(robot: Robot, curve: PiecewisePolynomial, direction: float, corner: FloatArray, radius: float) -> float:
    """How far from its end (`direction` -1) or start (1) the curve stays within the radius of the corner."""
    length = float(curve.breakpoints[-1])
    origin = 0.0 if direction > 0.0 else length

    def outside(ways: FloatArray) -> np.ndarray:
        at = np.clip(origin + direction * ways, 0.0, length)
        return _distances(robot, curve.evaluate(at, [0])[0], corner) > radius

    inside, beyond, looks = 0.0, MOST * length, 0
    while looks < LOOKS or inside == 0.0:  # each time finer, between the last point inside and the first outside
        looks += 1
        ways = np.linspace(inside, beyond, SAMPLES)
        out = np.flatnonzero(outside(ways))
        if not len(out):
            return beyond
        inside, beyond = float(ways[max(out[0] - 1, 0)]), float(ways[out[0]])
    return inside


def _distances(robot: Robot, positions: FloatArray, corner: FloatArray) -> FloatArray:
    """(N,), m, of the tool from the corner at joint positions (N, joints)."""
    tools = np.array([tool_pose(robot, q).position for q in positions])
    distances: FloatArray = np.linalg.norm(tools - corner, axis=1)
    return distances
