"""An arm of joints one behind the other: where its tip is, and how it moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.library import call, doubles
from planner.spatial import FloatArray

ARM_FRAME_NUMBERS = 13
"""Numbers that describe a joint's frame: the size of the structure `ArmFrame` of the kernels."""


class Arm(NamedTuple):
    """An arm whose joints turn about, or slide along, the z axes of their frames, and a point of its tip.

    Attributes:
        frames: (joints + 1, `ARM_FRAME_NUMBERS`): rotation (9, row by row) and origin (3), m, of the joint's frame in
            the one before, at position 0. Then 1 for a revolute joint, 0 for a prismatic one. The last row is the tip's
            frame.
        point: (3,), m, in the tip's frame.
    """

    frames: FloatArray
    point: FloatArray

    @property
    def joints(self) -> int:
        """The number of joints."""
        return len(self.frames) - 1


def tip_poses(arm: Arm, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute tip positions (N, 3) and rotations (N, 3, 3) at joint positions (N, joints).

    Raises:
        ValueError: The positions have another shape.
    """
    return _reached(arm, positions, None)


def tip_jacobians(arm: Arm, positions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the `tip_poses`, and the Jacobians (N, 6, joints) of both, linear over angular, in the base's axes.

    Raises:
        ValueError: The positions have another shape.
    """
    jacobians = np.empty((len(positions), 6, arm.joints))
    return *_reached(arm, positions, jacobians), jacobians


def _reached(arm: Arm, positions: FloatArray, jacobians: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    states = len(positions)
    q = doubles(positions, states, arm.joints)
    points, rotations = np.empty((states, 3)), np.empty((states, 3, 3))
    call("reached", arm.joints, arm.frames, arm.point, states, q, points, rotations, jacobians)
    return points, rotations


def tip_rates(arm: Arm, positions: FloatArray, *motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the highest derivatives by time, (N, 3) each, of the point's position and of the tip's turn.

    Args:
        arm: The arm, and the point.
        positions: (N, joints), rad or m.
        motion: (N, joints) each: velocities, or velocities and accelerations, or these and jerks.

    Returns:
        Velocities, accelerations or jerks of the point and of the turn, in the base's axes.

    Raises:
        ValueError: The shapes differ.
    """
    states, order = len(positions), len(motion)
    q, *given = (doubles(values, states, arm.joints) for values in (positions, *motion))
    given += given[:1] * (3 - order)
    linear, angular = np.empty((2, states, 3))
    call("tip_rates", arm.joints, arm.frames, arm.point, states, order, q, *given, linear, angular)
    return linear, angular
