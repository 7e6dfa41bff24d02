"""The inverse of the Jacobian, with care near singularities, and its null space."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import POSITION_TOLERANCE

NEAR_SINGULARITY = 1e-3
"""The smallest singular value of the Jacobian, as a share of the largest, below which it is inverted with care."""

RANK = 1e-6
"""Singular values of the Jacobian below this share of the largest are zero: that direction of the tool is lost. By
inverting a larger one, rounding moves a joint by less than 1e-8 rad."""


def inverse_step(J: FloatArray, change: FloatArray, zero: float) -> tuple[FloatArray, bool]:
    """Return the smallest joint step (joints,) for a small change of the tool, and whether J is nearly singular.

    The joint step for another change, with components in every direction, shows whether J is nearly singular. Singular
    values below the fraction `zero` of the largest count as zero.
    """
    rows, joints = J.shape
    if rows == joints:
        try:
            step, probe = np.linalg.solve(J, np.array([change, np.cos(np.arange(joints))]).T).T
        except np.linalg.LinAlgError:
            probe = np.array([np.inf])
        if np.abs(probe).max() < 1.0 / NEAR_SINGULARITY:
            return step, False
    step, _, rank, _ = np.linalg.lstsq(J, change, rcond=zero)
    return np.asarray(step, dtype=np.float64), bool(rows == joints or rank < joints)


def handedness(J: FloatArray) -> float:
    """Return the sign of the determinant, which changes from branch to branch; 0 where J is singular or not square."""
    if J.shape[0] != J.shape[1]:
        return 0.0
    return float(np.linalg.slogdet(J)[0])


def null_space(J: FloatArray) -> FloatArray:
    """Return an orthonormal basis (n, joints) of the null space; empty where the joints can only move the tool."""
    _, values, directions = np.linalg.svd(J)
    return directions[np.count_nonzero(values >= RANK * values[0]) :]


def kept_motions(robot: Robot, J: FloatArray, still: Collection[str] = ()) -> FloatArray:
    """Return the unit joint motions (n, joints) that a redundant arm can keep.

    They are the motions of joints that stand still or have no range, as many as possible, and the null space of J and
    these.
    """
    has_no_room = robot.limit("upper") - robot.limit("lower") <= POSITION_TOLERANCE
    is_still = np.array([name in still for name in robot.joint_names])
    held = np.eye(robot.dof)[has_no_room | is_still][: max(0, robot.dof - len(J))]
    return np.vstack([held, null_space(np.vstack([J, held]))])
