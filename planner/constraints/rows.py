"""Rows of limited quantities: limits along a path that are linear in s'' and s'^2.

On a path the linear acceleration of the tool is (speed s'' + along s'^2, across s'^2). The plane is that of its
velocity and of its acceleration at a constant path velocity. The same holds for the angular acceleration. Its magnitude
is within a limit if it is within a polygon in the circle of that radius. Corners of the polygon are where it is all
along or all across: there nothing is lost, between them up to 2 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.constraints.bounds import Bounds
from planner.constraints.constraint import Constraint, Rows
from planner.kinematics.forward import AccelerationOnPath, JointStates
from planner.spatial import FloatArray

PAIRS = 8
"""Number of pairs of parallel sides of the polygon: 16 sides lose 2 % at most."""

ANGLES = (np.arange(PAIRS) + 0.5) * np.pi / PAIRS
"""Directions of the normals of the sides, rad from that of the velocity."""

INSCRIBED = float(np.cos(np.pi / (2 * PAIRS)))
"""Distance of the sides from the middle, as a share of that of the corners."""


def tool_acceleration_rows(motion: AccelerationOnPath) -> Rows:
    """Return the rows of the linear or the angular acceleration of the tool at N points of a path."""
    onward, sideways = np.cos(ANGLES) / INSCRIBED, np.sin(ANGLES) / INSCRIBED
    by_u = motion.speed[:, None] * onward
    return Rows(by_u, motion.along[:, None] * onward + motion.across[:, None] * sideways, np.zeros_like(by_u))


def path_speed_shares(limited: Sequence[tuple[Constraint, Bounds]], path: JointStates, at: np.ndarray) -> FloatArray:
    """Return a path velocity of 1 as a share (N,) of the highest that the constraints on path speed allow.

    Args:
        limited: The constraints and their limits.
        path: The states at N points of a path.
        at: The rows (N,) of the limits there.
    """
    shares = np.zeros(len(path.q))
    for constraint, bounds in limited:
        if constraint.follows_path_speed and constraint.is_known(path.robot):
            used = (constraint.values(path) / bounds.upper[at]).max(axis=1)
            shares = np.maximum(shares, used ** (1.0 / constraint.order))
    return shares
