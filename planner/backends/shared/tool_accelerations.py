"""Limits of the tool's acceleration along a path as limits that are linear in s'' and s'^2.

On a path the linear acceleration of the tool is (speed s'' + along s'^2, across s'^2), in the plane of its velocity and
the acceleration at an even path velocity, and so is the angular one. Its magnitude is within a limit if it is within a
polygon in the circle of that radius. Corners of the polygon are where it is all along or all across: there nothing is
lost, between them up to 2 %.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import ACCELERATIONS, accelerations_on_path

if TYPE_CHECKING:
    from collections.abc import Container, Mapping

    from planner.robots import Robot
    from planner.spatial import FloatArray

PAIRS = 8
"""Number of pairs of parallel sides of the polygon: 16 sides lose 2 % at most."""

ANGLES = (np.arange(PAIRS) + 0.5) * np.pi / PAIRS
"""Directions of the normals of the sides, rad from that of the velocity."""

INSCRIBED = float(np.cos(np.pi / (2 * PAIRS)))
"""Distance of the sides from the middle, as a share of that of the corners."""


class AccelerationRows(NamedTuple):
    """Limits |per_u s'' + per_x s'^2| <= limit, in rows.

    Attributes:
        per_u: (N, rows).
        per_x: (N, rows).
        quantities: (rows,), the name of the quantity whose limit it is.
    """

    per_u: FloatArray
    per_x: FloatArray
    quantities: list[str]


def limited_accelerations(limited: Container[str]) -> list[str]:
    """Return the names (rows,) of the quantities whose limits the rows are, some of those that are limited."""
    return [quantity for quantity in ACCELERATIONS if quantity in limited for _ in range(PAIRS)]


def acceleration_rows(
    robot: Robot, limited: Mapping[str, FloatArray], q: FloatArray, first: FloatArray, second: FloatArray
) -> AccelerationRows:
    """Compute the rows at N points of a path, with its derivatives by the path position s, each (N, joints).

    Args:
        robot: The robot, with its tool.
        limited: The quantities of the tool that are limited; others than its accelerations are not looked at.
        q: rad or m.
        first: First derivative.
        second: Second derivative.
    """
    by_u, by_x = [np.empty((len(q), 0))], [np.empty((len(q), 0))]
    quantities = limited_accelerations(limited)
    if quantities:
        onward, sideways = np.cos(ANGLES) / INSCRIBED, np.sin(ANGLES) / INSCRIBED
        for quantity, part in zip(ACCELERATIONS, accelerations_on_path(robot, q, first, second), strict=True):
            if quantity in limited:
                by_u.append(part.speed[:, None] * onward)
                by_x.append(part.along[:, None] * onward + part.across[:, None] * sideways)
    return AccelerationRows(np.hstack(by_u), np.hstack(by_x), quantities)
