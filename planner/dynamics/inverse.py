"""Joint torques of a motion, by Pinocchio's recursive Newton-Euler algorithm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.errors import MissingDynamics

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray


def inverse_dynamics(
    robot: Robot, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray
) -> FloatArray:
    """Torques (N m; forces in N for prismatic joints) at N states, gravity and payload included.

    Args:
        robot: With its payload, if any.
        positions: (N, joints).
        velocities: (N, joints).
        accelerations: (N, joints).

    Raises:
        MissingDynamics: The robot has neither inertias nor a payload.
    """
    if not robot.has_dynamics:
        raise MissingDynamics(f"{robot.id} has no link inertias and carries no payload: torques are unknown")
    torques = np.empty(positions.shape)
    # All states in one call, on one thread: a call each costs more than the algorithm.
    pin.rneaInParallel(1, robot.pool, positions.T, velocities.T, accelerations.T, torques.T)
    return torques
