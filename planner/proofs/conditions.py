"""Conditions on the pose of the tool: weights and squares of its coordinates with a limit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.constraints.pose_constraints import (
    POSE_CONSTRAINT_TOLERANCE,
    PoseConstraint,
    ToolAxis,
    ToolInBox,
    ToolInHalfSpace,
    ToolNearLine,
    ToolNearPlane,
    ToolOrientation,
)
from planner.problems.regions import TURNS, Region
from planner.spatial import FloatArray, Pose

Condition = list[object]
"""Weights, rows of weights whose values are squared, and the limit of the sum.

Each has 13 weights, of the number 1, the tool's position and its rotation matrix, row by row.
"""

WEIGHTS = 13
"""Number of weights of a row."""

ROUNDED_POSE = 1e-9
"""Distance, m, and angle, rad, beyond the tolerance of a pose that count as rounding."""

LARGEST_TILT = 1.4
"""Largest turn about y, rad, of a tolerance region with conditions: at a quarter turn, those about x and z are one."""

LARGEST_SECTOR = 3.1417
"""Largest range of turns about z, rad, that two half planes describe: half a turn, as requests round it up."""

LARGEST_ANGLE = 1.0
"""Largest tolerance of an angle, rad, for which the distance of the rotation matrices is used."""

KINDS = (ToolAxis, ToolOrientation, ToolInHalfSpace, ToolNearPlane, ToolNearLine, ToolInBox)
"""Kinds of constraints that have conditions; the gauges of the first three are linear in position and rotation."""


def squared_tolerance(tolerance: Sequence[float]) -> list[float]:
    """Return the largest squared distances of positions and of rotation matrices.

    Args:
        tolerance: The distance, m, and the angle, rad; without the angle any orientation will do.
    """
    distance, *angles = tolerance
    widened = [min(abs(angle), LARGEST_ANGLE) + ROUNDED_POSE for angle in angles[:1]]
    # |A - B|^2 = 8 sin^2(angle / 2) >= 2 angle^2 - angle^4 / 6
    return [(abs(distance) + ROUNDED_POSE) ** 2, *(2.0 * angle**2 - angle**4 / 6.0 for angle in widened)]


def conditions_at(pose: Pose, tolerance: Sequence[float]) -> list[Condition]:
    """Return the conditions that the tool is at a pose; without a rotation, with any orientation."""
    limits = squared_tolerance([float(x) for x in tolerance])
    near, turned = np.zeros((3, WEIGHTS)), np.zeros((9, WEIGHTS))
    near[:, 1:4], turned[:, 4:] = np.eye(3), np.eye(9)
    near[:, 0] = -pose.position
    found = [_condition(near, limits[0])]
    if pose.rotation is not None:
        turned[:, 0] = -pose.rotation.ravel()
        found.append(_condition(turned, limits[1]))
    return found


def conditions_in(region: Region, pose: Pose, tolerance: Sequence[float]) -> list[Condition] | None:
    """Return the conditions that the tool is in a tolerance region, each coordinate within the tolerance.

    The turn from the pose is M = Rx(a) Ry(b) Rz(c). Its third column is sin b, -sin a cos b, cos a cos b. Its first row
    begins with cos b cos c, -cos b sin c. So limits of b, and half planes for a and c, are linear in M.

    Args:
        region: The tolerance region.
        pose: The requested pose.
        tolerance: The distance, m, and the angle, rad.

    Returns:
        None where no such conditions describe the region: b comes near a quarter turn, or c leaves a gap of less than
        half a turn.
    """
    assert pose.rotation is not None  # noqa: S101 - the check of the problem refuses others
    axes = pose.rotation
    far, off = tolerance[0] + ROUNDED_POSE, tolerance[1] + ROUNDED_POSE
    ranges = {name: region.ranges.get(name, (0.0, 0.0)) for name in ("x", "y", "z", *TURNS)}
    tilts, turns = ranges["rotation_y"], ranges["rotation_z"]
    is_whole = turns[1] - turns[0] >= 2.0 * np.pi - off
    if np.abs(tilts).max() > LARGEST_TILT or (turns[1] - turns[0] > LARGEST_SECTOR and not is_whole):
        return None
    bounds: list[tuple[FloatArray, float]] = []
    for axis, name in enumerate("xyz"):
        row = np.zeros(WEIGHTS)
        row[0], row[1:4] = -axes[:, axis] @ pose.position, axes[:, axis]
        bounds += [(-row, far - ranges[name][0]), (row, far + ranges[name][1])]

    def entry(row: int, column: int) -> FloatArray:
        """Return the weights (13,) of an entry of M."""
        weights = np.zeros((3, 3))
        weights[:, column] = axes[:, row]
        return np.concatenate([np.zeros(4), weights.ravel()])

    bounds += [(-entry(0, 2), -np.sin(tilts[0] - off)), (entry(0, 2), np.sin(tilts[1] + off))]
    sectors = [(entry(2, 2), -entry(1, 2), ranges["rotation_x"])]
    sectors += [] if is_whole else [(entry(0, 0), -entry(0, 1), turns)]
    for cosine, sine, (low, high) in sectors:
        bounds += [(np.sin(low) * cosine - np.cos(low) * sine, np.sin(off))]
        bounds += [(np.cos(high) * sine - np.sin(high) * cosine, np.sin(off))]
        middle, half = (low + high) / 2.0, (high - low) / 2.0 + off
        if half < LARGEST_SECTOR / 2.0:  # a narrow sector is not the opposite one
            least = np.cos(LARGEST_TILT + off) * np.cos(half)
            bounds += [(-np.cos(middle) * cosine - np.sin(middle) * sine, -least)]
    return [[row.tolist(), [], float(limit)] for row, limit in bounds]


def conditions_of(kept: PoseConstraint) -> list[Condition] | None:
    """Return the conditions of a constraint, with its tolerance for rounding; None: its kind has none."""
    if type(kept) not in KINDS:
        return None
    match kept:
        case ToolNearPlane():
            return [_within(_unit(kept.normal)[None], np.array(kept.point), kept.distance)]
        case ToolNearLine():
            across = np.eye(3) - np.outer(_unit(kept.direction), _unit(kept.direction))
            return [_within(across, np.array(kept.point), kept.distance)]
        case ToolInBox():
            axes = np.eye(3) if kept.pose.rotation is None else kept.pose.rotation
            pairs = zip(axes.T, kept.size, strict=True)
            return [_within(axis[None], kept.pose.position, length / 2.0) for axis, length in pairs]
    positions, rotations = np.zeros((WEIGHTS, 3)), np.zeros((WEIGHTS, 9))
    positions[1:4], rotations[4:] = np.eye(3), np.eye(9)
    constant, *values = kept.gauges(positions, rotations.reshape(-1, 3, 3)).tolist()
    return [[[constant, *(value - constant for value in values)], [], kept.largest_gauge]]


def _within(across: FloatArray, center: FloatArray, distance: float) -> Condition:
    """Return the condition that a projection of the tool's position is within a distance of that of a centre."""
    rows = np.zeros((len(across), WEIGHTS))
    rows[:, 0], rows[:, 1:4] = -across @ center, across
    return _condition(rows, (distance + POSE_CONSTRAINT_TOLERANCE) ** 2)


def _condition(squared: FloatArray, limit: float) -> Condition:
    return [[0.0] * WEIGHTS, squared.tolist(), float(limit)]


def _unit(vector: Sequence[float]) -> FloatArray:
    values: FloatArray = np.array(vector, dtype=np.float64)
    return values / np.linalg.norm(values)
