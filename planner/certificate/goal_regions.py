"""Distances of tool poses from a tolerance region, with geometry of the certificate's own."""

from __future__ import annotations

import numpy as np

from planner.certificate.lines_and_circles import angles_of
from planner.problems.regions import Region
from planner.spatial import FloatArray

NAMES = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
"""The coordinates of a region, shifts before turns."""


def misses_of_region(
    region: Region, points: FloatArray, axes: FloatArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute distances (N,), m, and angles (N,), rad, of the tool from the poses of a region.

    Angles of R = Rx(a) Ry(b) Rz(c) outside their ranges are clipped to the ends; the result is the remaining angle.

    It takes the arguments of `nearest_in_region`.
    """
    nearest, turned = nearest_in_region(region, points, axes, positions, rotations)
    return np.linalg.norm(positions - nearest, axis=1), angles_of(turned.transpose(0, 2, 1) @ rotations)


def nearest_in_region(
    region: Region, points: FloatArray, axes: FloatArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the positions (N, 3), m, and rotations (N, 3, 3) in a region that are nearest to the tool.

    Args:
        region: The tolerance region.
        points: Requested positions (N, 3), m.
        axes: Requested rotations (N, 3, 3).
        positions: Positions (N, 3) of the tool, m.
        rotations: Rotations (N, 3, 3) of the tool.
    """
    lower, upper = np.array([region.ranges.get(name, (0.0, 0.0)) for name in NAMES]).T
    shifts = np.einsum("nji,nj->ni", axes, positions - points)
    nearest = points + np.einsum("nij,nj->ni", axes, np.clip(shifts, lower[:3], upper[:3]))
    turns = axes.transpose(0, 2, 1) @ rotations
    angles = np.stack(
        [
            np.arctan2(-turns[:, 1, 2], turns[:, 2, 2]),
            np.arcsin(np.clip(turns[:, 0, 2], -1.0, 1.0)),
            np.arctan2(-turns[:, 0, 1], turns[:, 0, 0]),
        ],
        axis=1,
    )
    inside = np.clip(angles, lower[3:], upper[3:])
    # Near a quarter of a turn about y the first and the last angle turn about one axis: what one may not do, the other
    # does, as far as its range allows.
    last, first = inside.copy(), inside.copy()
    left = (_turned(np.column_stack([inside[:, :2], np.zeros(len(inside))]))).transpose(0, 2, 1) @ turns
    last[:, 2] = np.clip(np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1]), lower[5], upper[5])
    left = turns @ _turned(np.column_stack([np.zeros(len(inside)), inside[:, 1:]])).transpose(0, 2, 1)
    first[:, 0] = np.clip(np.arctan2(left[:, 2, 1] - left[:, 1, 2], left[:, 1, 1] + left[:, 2, 2]), lower[3], upper[3])
    candidates = np.array([_turned(each) for each in (inside, last, first)])
    away = np.array([angles_of(each.transpose(0, 2, 1) @ turns) for each in candidates])
    return nearest, axes @ candidates[away.argmin(axis=0), np.arange(len(inside))]


def _turned(angles: FloatArray) -> FloatArray:
    """Return the rotations Rx(a) Ry(b) Rz(c) (N, 3, 3) of angles (N, 3), written out."""
    (a, b, c), (d, e, f) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [b * c, -b * f, e],
        [a * f + d * e * c, a * c - d * e * f, -d * b],
        [d * f - a * e * c, d * c + a * e * f, a * b],
    ]
    rotations: FloatArray = np.array(rows).transpose(2, 0, 1)
    return rotations
