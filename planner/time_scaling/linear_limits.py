"""The input of a retiming: its spline, and the limits that are linear in it.

A tool motion p(x) retimed by b(x), see `retiming.py`, has the jerk (p''' b + 3 p'' a + p' c) sqrt(b). Its magnitude is
within a limit if the jerk is within a polyhedron in the sphere of that radius. Corners of the polyhedron are along p',
along the part of p'' across that, across both, and halfway between these. The bound is exact in these directions;
between them it loses up to 11 % of the jerk, 4 % of the time.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from planner.kernels.retiming import largest_scales, spline_maps
from planner.kinematics.forward import JERKS, tool_accelerations, tool_jerks, tool_velocities
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

GRIDPOINTS = np.array([0.0, 0.5, 1.0])
"""Gridpoints of each interval, as fractions of it, at which its limits apply.

Next to rest, the middle shows violations that the ends do not.
"""

WEIGHTS = np.array([1.0, 4.0, 1.0]) / 6.0
"""Weights of Simpson's rule at these gridpoints."""


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """Limits of the form |by_b b + by_a a + by_c c + offset| <= constant + inverse / sqrt(b) at gridpoints.

    Attributes:
        by_b: Coefficients (limits, points) of b.
        by_a: Coefficients (limits, points) of a.
        by_c: Coefficients (limits, points) of c.
        offset: The value at rest, (limits, points).
        constant: The part of each bound (limits, points) that does not depend on b.
        inverse: The part of each bound (limits, points) that goes with 1 / sqrt(b): that of a jerk or a power.
    """

    by_b: FloatArray
    by_a: FloatArray
    by_c: FloatArray
    offset: FloatArray
    constant: FloatArray
    inverse: FloatArray

    def scales(self, states: FloatArray) -> FloatArray:
        """Return factors (points,) on b, each alone, with which the limits are kept at each point.

        They are the largest ones but for powers: of these half the limit is for holding the arm, half for the motion.
        """
        return largest_scales(self.arrays, states)

    def scale(self, states: FloatArray) -> float:
        """Return the largest factor on b with which the limits are kept."""
        return float(self.scales(states).min())

    @property
    def binds(self) -> bool:
        """Whether anything limits the factor on b."""
        return bool(np.isfinite(self.scale(np.array([[1.0], [0.0], [0.0]]))))

    def used(self) -> FloatArray:
        """Return the shares (limits, points) that are used of each limit when nothing is changed: b is 1."""
        return np.abs(self.by_b + self.offset) / (self.constant + self.inverse)

    def narrowed(self, margin: FloatArray | float) -> LinearLimits:
        """Narrow what each limit leaves beside gravity by a factor, of all or of each (limits, points)."""
        held = np.abs(self.offset)
        constant = np.where(self.inverse > 0.0, 0.0, held + (self.constant - held) / margin)
        return replace(self, constant=constant, inverse=self.inverse / margin)

    def of(self, rows: np.ndarray) -> LinearLimits:
        """Return some of the limits, by index or mask."""
        return LinearLimits(*(part[rows] for part in self.arrays))

    @property
    def arrays(self) -> tuple[FloatArray, ...]:
        """The coefficients and bounds, each (limits, points)."""
        return self.by_b, self.by_a, self.by_c, self.offset, self.constant, self.inverse


class QuadraticSpline:
    """The linear map from the unknowns of the spline to its states b, a and c at the gridpoints of all intervals.

    Attributes:
        maps: (3, 3, gridpoints, intervals): how b, a and c depend on the unknowns of the interval before, of the own
            and of the next.
    """

    def __init__(self, widths: FloatArray, *, begins_evenly: bool = False) -> None:
        self.maps = spline_maps(widths, begins_evenly=begins_evenly)
        self.count = len(widths)

    def states(self, x: FloatArray) -> FloatArray:
        """Return the states b, a and c (3, points) that belong to unknowns (intervals + 2,)."""
        n = self.count
        states = self.maps[:, 0] * x[:n] + self.maps[:, 1] * x[1 : n + 1] + self.maps[:, 2] * x[2:]
        return states.reshape(3, -1)

    def force(self, forces: FloatArray) -> FloatArray:
        """Transfer forces (3, points) on b, a and c to the unknowns (intervals + 2,)."""
        n = self.count
        own = np.einsum("yxpn,ypn->xn", self.maps, forces.reshape(3, -1, n))
        total = np.zeros(n + 2)
        for k in range(3):
            total[k : k + n] += own[k]
        return total


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
