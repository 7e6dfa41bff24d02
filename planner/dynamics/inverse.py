"""Joint torques of a motion, by the recursive Newton-Euler algorithm."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import MissingDynamics
from planner.kernels import serial_chain
from planner.robots import Robot
from planner.spatial import FloatArray


def inverse_dynamics(robot: Robot, positions: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike) -> FloatArray:
    """Compute the joint torques of a motion, including gravity, payload, friction and the inertia of rotors.

    Args:
        robot: The robot, with its payload, if any.
        positions: One state (joints,), or many (..., joints), rad or m.
        velocities: Velocities of the same shape, rad/s or m/s.
        accelerations: Accelerations of the same shape, rad/s^2 or m/s^2.

    Returns:
        Torques of the same shape, N m; forces in N for prismatic joints.

    Raises:
        MissingDynamics: The robot has neither inertias nor a payload.
        ValueError: The shapes differ, or do not fit the robot.
    """
    check_dynamics(robot)
    q, v, a = (np.asarray(values, dtype=np.float64) for values in (positions, velocities, accelerations))
    if not q.shape == v.shape == a.shape or q.shape[-1:] != (robot.dof,):
        raise ValueError(f"states of shapes {q.shape}, {v.shape}, {a.shape}: the robot has {robot.dof} joints")
    rows = (values.reshape(-1, robot.dof) for values in (q, v, a))
    return serial_chain.inverse_dynamics(robot.chain, *rows).reshape(q.shape)


def torques_by_pace(
    robot: Robot, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the coefficients of 1, x and x^2, each (..., joints), of the torques of a motion at the pace x.

    The first are gravity and Coulomb friction, the second viscous friction.

    Args:
        robot: The robot.
        positions: (..., joints), rad or m.
        velocities: Velocities at the pace 1, of the same shape.
        accelerations: Accelerations at the pace 1.
    """
    still = np.zeros_like(positions)
    held = inverse_dynamics(robot, positions, still, still)
    moved = inverse_dynamics(robot, positions, velocities, accelerations) - held
    if robot.friction is None:
        return held, still, moved
    constant, linear = robot.friction.along(velocities, robot.dof)
    return held + constant, linear, moved - constant - linear


def check_dynamics(robot: Robot) -> None:
    """Check that the torques of a robot can be computed.

    Raises:
        MissingDynamics: The robot has neither inertias nor a payload.
    """
    if not robot.has_dynamics:
        raise MissingDynamics(f"{robot.id} has no link inertias and carries no payload: torques are unknown")
