"""Limits of the tool's jerk along a motion as limits that are linear in its retiming.

A tool motion p(x) retimed by b(x), see `retiming.py`, has the jerk (p''' b + 3 p'' a + p' c) sqrt(b). Its magnitude is
within a limit if the jerk is within a polyhedron in the sphere of that radius. Corners of the polyhedron are along p',
along the part of p'' across that, across both, and halfway between these. The bound is exact in these directions;
between them it loses up to 11 % of the jerk, 4 % of the time.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from planner.kinematics.forward import JERKS, tool_accelerations, tool_jerks, tool_velocities
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

NORMALS = np.array(
    [
        np.array(order) * (1.0, *signs)
        for order in permutations((1.0, np.sqrt(2.0) - 1.0, np.sqrt(3.0) - np.sqrt(2.0)))
        for signs in product((1.0, -1.0), repeat=2)
    ]
)
"""Normals (24, 3) of the pairs of parallel faces of the polyhedron, divided by their distance from the middle.

Its 26 corners have 1, 2 or 3 coordinates other than 0, and these are equal.
"""


class JerkRows(NamedTuple):
    """Limits |by_b b + by_a a + by_c c| <= limit / sqrt(b), in rows.

    Attributes:
        by_b: (N, rows).
        by_a: (N, rows).
        by_c: (N, rows).
        quantities: (rows,), the name of the quantity whose limit it is.
    """

    by_b: FloatArray
    by_a: FloatArray
    by_c: FloatArray
    quantities: list[str]


def jerk_rows(
    robot: Robot, limited: Collection[str], q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray
) -> JerkRows:
    """Compute the rows at N states of a motion before its retiming.

    Args:
        robot: The robot, with its tool.
        limited: The quantities of the tool that are limited; others than its jerks are not looked at.
        q: Positions (N, joints), rad or m.
        v: Velocities (N, joints).
        a: Accelerations (N, joints).
        j: Jerks (N, joints).
    """
    rows, quantities = [], []
    motions = zip(
        tool_velocities(robot, q, v), tool_accelerations(robot, q, v, a), tool_jerks(robot, q, v, a, j), strict=True
    )
    for quantity, motion in zip(JERKS, motions, strict=True):
        if quantity in limited:
            rows.append(_in_own_axes(*motion) @ NORMALS.T)
            quantities += [quantity] * len(NORMALS)
    by_c, by_a, by_b = np.concatenate(rows, axis=2)
    return JerkRows(by_b, 3.0 * by_a, by_c, quantities)


def _in_own_axes(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
    """Return vectors (N, 3) in their own axes (3, N, 3), by Gram-Schmidt orthogonalisation."""
    rest, axes = np.stack([first, second, third]), []
    parts = np.zeros_like(rest)
    least = ROUNDING * np.linalg.norm(rest, axis=2).max()
    for k in range(3):
        length = np.linalg.norm(rest[k], axis=1, keepdims=True)
        axes.append(np.divide(rest[k], length, out=np.zeros_like(rest[k]), where=length > least))
        parts[k:, :, k] = np.einsum("mni,ni->mn", rest[k:], axes[k])
        rest[k:] = rest[k:] - parts[k:, :, k, None] * axes[k]
    return parts
