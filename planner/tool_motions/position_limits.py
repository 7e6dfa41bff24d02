"""How near joint positions are to the position limits, and the point where a curve in joint space leaves them."""

from __future__ import annotations

import numpy as np

from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import BISECTIONS, LIMIT_TOLERANCE, POSITION_TOLERANCE
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.polynomials import PiecewisePolynomial


def first_beyond(robot: Robot, curve: PiecewisePolynomial) -> tuple[float, FloatArray, int] | None:
    """Return the first parameter, joint position and joint where a curve leaves the position limits; None: nowhere."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    limited = np.isfinite(lower) & np.isfinite(upper)
    if not len(curve.lengths) or not limited.any():
        return None
    lower, upper = np.where(limited, lower, 0.0), np.where(limited, upper, 0.0)
    # A joint without room to move in is where it is but for rounding.
    middle, half = (lower + upper) / 2.0, np.maximum((upper - lower) / 2.0, POSITION_TOLERANCE)
    half = np.where(limited, half, np.inf)
    polynomials = derivatives_on_unit_time(curve, 1)[0].minus(middle)
    if (np.abs(polynomials.bernstein).max(axis=2) <= half).all():  # these bound the curve: mostly they settle it
        return None
    count = len(curve.lengths)
    found = largest_magnitudes(polynomials, np.broadcast_to(half, (count, len(half))), np.arange(count))
    beyond = np.flatnonzero(np.abs(found.values) > half[found.joints] * (1.0 + LIMIT_TOLERANCE))
    if not len(beyond):
        return None
    piece, joint = int(beyond[0]), int(found.joints[beyond[0]])
    start = float(curve.breakpoints[piece])
    end = start + float(found.units[piece] * curve.lengths[piece])
    for _ in range(BISECTIONS):
        u = (start + end) / 2.0
        position = curve.evaluate(np.array([u]), [0])[0][0]
        start, end = (start, u) if (np.abs(position - middle) > half).any() else (u, end)
    position = curve.evaluate(np.array([end]), [0])[0][0]
    return end, position, joint


def shares_of_range(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return positions of joints relative to the middle and half range of their limits: -1 to 1.

    A joint without limits is never near one, and neither is a joint that has no room to move in: they count 0.

    Returns:
        (..., joints).
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    has_room = np.isfinite(upper - lower) & (upper - lower > POSITION_TOLERANCE)
    return (positions - robot.middle) / np.where(has_room, (upper - lower) / 2.0, np.inf)
