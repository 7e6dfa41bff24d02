"""The limited quantities that requests name: the joints' torques, and the motions of the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.constraints.constraint import Constraint, Rows
from planner.constraints.rows import tool_acceleration_rows
from planner.dynamics import inverse_dynamics, path_dynamics
from planner.guarantees import TCP_ORDERS
from planner.kinematics.forward import ACCELERATIONS, OF_PATH_SPEED
from planner.quantities import MEASURES

if TYPE_CHECKING:
    from planner.kinematics.forward import JointStates
    from planner.robots import Robot
    from planner.spatial import FloatArray

NAMED = {
    "tcp_linear_velocity": "the tool's speed",
    "tcp_angular_velocity": "the tool's angular speed",
    "tcp_linear_acceleration": "the tool's acceleration",
    "tcp_angular_acceleration": "the tool's angular acceleration",
    "tcp_centripetal_acceleration": "the tool's centripetal acceleration",
    "tcp_linear_jerk": "the tool's jerk",
    "tcp_angular_jerk": "the tool's angular jerk",
}
"""What the quantities of the tool are called in sentences."""


@dataclass(frozen=True)
class Torque(Constraint):
    """The torques or forces of the joints, those against gravity included."""

    name: str = "torque"
    unit: str = MEASURES["torque"].unit
    order: int = 2
    of_joints: bool = True
    counts_at_rest: bool = True
    follows_path_speed: bool = False
    has_rows: bool = True

    def is_known(self, robot: Robot) -> bool:
        """Return whether the robot or its payload has inertias."""
        return robot.has_dynamics

    def values(self, states: JointStates) -> FloatArray:
        """Return the torques (N, joints), N m or N."""
        return inverse_dynamics(states.robot, states.q, states.v, states.a)

    def rows(self, path: JointStates) -> Rows:
        """Return the path dynamics, a row for each joint; zero where they cannot be computed."""
        if not self.is_known(path.robot):
            return Rows(*np.zeros((3, *path.q.shape)))
        return Rows(*path_dynamics(path.robot, path.q, path.v, path.a))


@dataclass(frozen=True)
class ToolRate(Constraint):
    """The magnitude of a velocity, acceleration or jerk of the tool, one of `TCP_ORDERS`."""

    name: str
    unit: str
    order: int
    follows_path_speed: bool = False
    has_rows: bool = False

    def values(self, states: JointStates) -> FloatArray:
        """Return the magnitudes (N, 1)."""
        return states.tool_rate(self.name)[:, None]

    def rows(self, path: JointStates) -> Rows:
        """Return the rows of an acceleration."""
        return tool_acceleration_rows(path.tool_on_path[ACCELERATIONS.index(self.name)])


TORQUE = Torque()
"""The torques or forces of the joints."""

TOOL = {
    name: ToolRate(
        name, MEASURES[name].unit, order, follows_path_speed=name in OF_PATH_SPEED, has_rows=name in ACCELERATIONS
    )
    for name, order in TCP_ORDERS.items()
}
"""The quantities of the tool, by name."""
