"""The limited quantities that requests name: the joints' torques, and the motions of the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.constraints.constraint import Constraint, Rows
from planner.constraints.excess import first_excess
from planner.constraints.rows import tool_acceleration_rows
from planner.constraints.speed_shares import largest_speed_shares
from planner.dynamics import inverse_dynamics, path_dynamics, torques_by_pace
from planner.guarantees import TCP_ORDERS
from planner.kinematics.following_errors import tool_rate_differences
from planner.kinematics.forward import ACCELERATIONS, OF_PATH_SPEED, JointStates
from planner.quantities import MEASURES
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials
from planner.trajectories.sampled_peaks import Peaks

NAMED = {
    "acceleration_at_speed": "acceleration (by speed)",
    "jerk_at_speed": "jerk (by speed)",
    "torque_at_speed": "torque (by speed)",
    "torque_with_tolerances": "torque (within tolerances)",
    "power": "power",
    "total_power": "the total power",
    "velocity_at_position": "velocity (by position)",
    "tcp_linear_velocity": "the tool's speed",
    "tcp_angular_velocity": "the tool's angular speed",
    "tcp_linear_acceleration": "the tool's acceleration",
    "tcp_angular_acceleration": "the tool's angular acceleration",
    "tcp_centripetal_acceleration": "the tool's centripetal acceleration",
    "tcp_linear_jerk": "the tool's jerk",
    "tcp_angular_jerk": "the tool's angular jerk",
}
"""The names of the tool's quantities in sentences."""


@dataclass(frozen=True)
class Torque(Constraint):
    """The torques or forces of the joints, those against gravity and friction included."""

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

    def has_factors(self, robot: Robot) -> bool:
        """Return whether the joints have friction."""
        return robot.friction is not None

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors; the torques are polynomials of the pace."""
        held, linear, square = torques_by_pace(states.robot, states.q, states.v, states.a)
        return 1.0 / first_excess(np.stack([held - middle, linear, square, np.zeros_like(square)]), limits)


@dataclass(frozen=True)
class Power(Constraint):
    """The mechanical power: torque times velocity of each joint, or the sum of these products over all joints.

    It is negative where a joint brakes, so that a joint that drives another one through the arm counts for nothing in
    the sum. Limits are limits of its magnitude. The joints' friction is in it, other losses are not.
    """

    name: str
    of_joints: bool
    unit: str = MEASURES["power"].unit
    order: int = 1
    follows_path_speed: bool = False

    def is_known(self, robot: Robot) -> bool:
        """Return whether the robot or its payload has inertias."""
        return robot.has_dynamics

    def has_factors(self, robot: Robot) -> bool:
        """Return that it has."""
        return True

    def values(self, states: JointStates) -> FloatArray:
        """Return the powers (N, columns), W."""
        return self.of(TORQUE.values(states), states.v)

    def of(self, torques: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the powers (..., columns), W, of torques and velocities (..., joints)."""
        powers = torques * velocities
        return powers if self.of_joints else powers.sum(axis=-1, keepdims=True)

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors: the power is a cubic of the pace."""
        torques = torques_by_pace(states.robot, states.q, states.v, states.a)
        by_pace = np.stack([-middle, *(self.of(part, states.v) for part in torques)])
        return 1.0 / first_excess(by_pace, limits)


@dataclass(frozen=True)
class ToolRate(Constraint):
    """The magnitude of a velocity, acceleration or jerk of the tool, one of `TCP_ORDERS`."""

    name: str
    unit: str
    order: int
    follows_path_speed: bool = False
    has_rows: bool = False

    def values(self, states: JointStates) -> FloatArray:
        """Return the magnitudes (N, 1), the largest at actual positions within following errors."""
        away = tool_rate_differences(states, self.name, self.order)
        return (states.tool_rate(self.name) + away)[:, None]

    def overestimates(self, states: JointStates) -> FloatArray:
        """Return the differences (N, 1) by following errors, which the tool may not reach."""
        return tool_rate_differences(states, self.name, self.order)[:, None]

    def rows(self, path: JointStates) -> Rows:
        """Return the rows of an acceleration."""
        return tool_acceleration_rows(path.tool_on_path[ACCELERATIONS.index(self.name)])


@dataclass(frozen=True)
class VelocityAtPosition(Constraint):
    """The shares of the velocities that velocity curves allow at the positions of the joints."""

    name: str = "velocity_at_position"
    unit: str = MEASURES["velocity_at_position"].unit
    order: int = 1
    of_joints: bool = True
    is_exact: bool = True

    def is_known(self, robot: Robot) -> bool:
        """Return whether a joint has velocity curves."""
        return robot.velocity_conditions is not None

    def values(self, states: JointStates) -> FloatArray:
        """Return the shares (N, joints) of the allowed velocities."""
        conditions = states.robot.velocity_conditions
        return np.zeros_like(states.v) if conditions is None else conditions.shares(states.q, states.v)

    def peaks(
        self,
        robot: Robot,
        motion: UnitPolynomials,
        limits: FloatArray,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
    ) -> Peaks:
        """Find the largest shares, by bounds on polynomials."""
        conditions = robot.velocity_conditions
        if conditions is None:
            none = np.zeros((int(groups.max()) + 1, 1))
            return Peaks(none, none.astype(int), none, none.astype(int))
        return largest_speed_shares(conditions, motion, limits, groups, above)

    def shown(self, states: JointStates, column: int, limit: float) -> tuple[float, float]:
        """Return the velocity of a joint and the largest one that is allowed where it is, both magnitudes."""
        share, speed = float(self.values(states)[0, column]), abs(float(states.v[0, column]))
        return speed, limit * speed / share if share > 0.0 else np.inf


TORQUE = Torque()
"""The torques or forces of the joints."""

POWER = Power("power", of_joints=True)
"""The mechanical power of each joint."""

TOTAL_POWER = Power("total_power", of_joints=False)
"""The mechanical power of all joints together."""

VELOCITY_AT_POSITION = VelocityAtPosition()
"""The velocities of the joints as shares of the allowed ones at their positions."""

TOOL = {
    name: ToolRate(
        name, MEASURES[name].unit, order, follows_path_speed=name in OF_PATH_SPEED, has_rows=name in ACCELERATIONS
    )
    for name, order in TCP_ORDERS.items()
}
"""The quantities of the tool, by name."""
