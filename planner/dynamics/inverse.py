"""Joint torques of a motion, and along a path, by the recursive Newton-Euler algorithm, and the heaviest payload."""

from __future__ import annotations

from typing import NamedTuple

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


class PathDynamics(NamedTuple):
    """The torques m(s) s'' + h(s) s'^2 + g(s) of a motion along a path q(s).

    M, C and g are the terms of the robot's equation of motion: m = M q' and h = M q'' + C(q, q') q'. See (Verscheure et
    al., Time-optimal path tracking for robots: a convex optimization approach, IEEE Transactions on Automatic Control
    54, 2009, eq. 5).

    Attributes:
        inertia: m, (..., joints), N m (N) by the unit of path acceleration.
        centripetal: h, (..., joints), N m (N) by the unit of path velocity squared; Coriolis torques included.
        gravity: g, (..., joints), N m (N): the torques of standing still.
    """

    inertia: FloatArray
    centripetal: FloatArray
    gravity: FloatArray


def path_dynamics(robot: Robot, positions: FloatArray, first: FloatArray, second: FloatArray) -> PathDynamics:
    """Compute the path dynamics at points of a path, all of them at once.

    Args:
        robot: The robot, with its payload, if any.
        positions: q(s), (..., joints), rad or m.
        first: q'(s), of the same shape.
        second: q''(s), of the same shape.

    Raises:
        MissingDynamics: The robot has neither inertias nor a payload.
    """
    check_dynamics(robot)
    rows = (values.reshape(-1, robot.dof) for values in (positions, first, second))
    return PathDynamics(*serial_chain.path_dynamics(robot.chain, *rows).reshape(3, *positions.shape))


LEAST_LEVER = 1e-9
"""The torque by mass of the payload, N m/kg (N/kg), below which a joint does not feel the payload."""


def heaviest_mass(without: FloatArray, per_mass: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Return the largest mass of a payload, kg, with which torques keep their limits; infinite: no joint feels it.

    For a given center of mass torques are affine in the mass. A negative result means that a limit is broken without
    the payload.

    Args:
        without: Torques (..., joints) without the payload, N m or N.
        per_mass: The torques that each kilogram adds, of the same shape, N m/kg or N/kg.
        lower: Lower limits of the torques, of a shape that fits.
        upper: Upper limits.
    """
    headroom = np.where(per_mass > 0.0, upper - without, without - lower)
    felt = np.abs(per_mass) > LEAST_LEVER
    return float((headroom[felt] / np.abs(per_mass[felt])).min(initial=np.inf))
