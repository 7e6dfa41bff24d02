"""Joint torques along a path, by its path velocity and path acceleration."""

from __future__ import annotations

from typing import NamedTuple

from planner.dynamics.inverse import check_dynamics
from planner.kernels import serial_chain
from planner.robots import Robot
from planner.spatial import FloatArray


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
