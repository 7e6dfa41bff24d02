"""The limits in force on each segment: the robot's, narrowed by the request's and the waypoint's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray

JOINT_QUANTITIES = ("velocity", "acceleration", "jerk", "torque")
"""Names of the quantities of each joint whose limits a caller may narrow."""

TCP_QUANTITIES = ("tcp_linear_velocity", "tcp_angular_velocity")
"""Names of the quantities of the tool that a caller may limit."""


@dataclass(frozen=True)
class Limits:
    """Limits that are asked, none wider than the robot's; None: the robot's own, and none on the tool.

    Attributes:
        velocity: Velocity of each joint, rad/s or m/s.
        acceleration: Acceleration of each joint, rad/s^2 or m/s^2.
        jerk: Jerk of each joint, rad/s^3 or m/s^3.
        torque: Torque or force of each joint, N m or N.
        tcp_linear_velocity: Speed of the tool centre point, m/s.
        tcp_angular_velocity: Angular speed of the tool, rad/s.
        velocity_scale: Factor in (0, 1] on the velocity limits.
        acceleration_scale: Factor in (0, 1] on the acceleration limits.
    """

    velocity: tuple[float, ...] | None = None
    acceleration: tuple[float, ...] | None = None
    jerk: tuple[float, ...] | None = None
    torque: tuple[float, ...] | None = None
    tcp_linear_velocity: float | None = None
    tcp_angular_velocity: float | None = None
    velocity_scale: float = 1.0
    acceleration_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class SegmentLimits:
    """The limits in force on each segment; infinite: none.

    Attributes:
        lower: Lower position limits (joints,), rad or m.
        upper: Upper position limits (joints,), rad or m.
        velocity: Velocity limits (segments, joints), rad/s or m/s.
        acceleration: Acceleration limits (segments, joints), rad/s^2 or m/s^2.
        jerk: Jerk limits (segments, joints), rad/s^3 or m/s^3.
        torque: Torque or force limits (segments, joints), N m or N.
        tcp_linear_velocity: Limits of the tool's speed (segments,), m/s.
        tcp_angular_velocity: Limits of the tool's angular speed (segments,), rad/s.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    tcp_linear_velocity: FloatArray
    tcp_angular_velocity: FloatArray

    def of(self, segments: np.ndarray) -> SegmentLimits:
        """Return the limits of some segments, in that order."""
        rows = {quantity: getattr(self, quantity)[segments] for quantity in (*JOINT_QUANTITIES, *TCP_QUANTITIES)}
        return SegmentLimits(lower=self.lower, upper=self.upper, **rows)


def counted_velocity(limit: FloatArray) -> FloatArray:
    """Velocity limits to measure motions of joints by: a joint without one counts as if its were 1 rad/s or m/s."""
    return np.where(np.isfinite(limit), limit, 1.0)


def segment_limits(robot: Robot, common: Limits, own: tuple[Limits | None, ...]) -> SegmentLimits:
    """Resolve the limits of each segment.

    Args:
        robot: The robot, whose limits are the widest there are.
        common: Limits of the whole trajectory.
        own: Limits of each segment; what is given there goes before `common`. The scales multiply.
    """

    def joint_limits(quantity: str) -> FloatArray:
        """Return the limits (segments, joints) of a quantity of the joints."""
        scale = getattr(common, f"{quantity}_scale", 1.0)
        asked = getattr(common, quantity)
        rows = np.tile(robot.limit(quantity) if asked is None else np.array(asked), (len(own), 1))
        for i, narrower in enumerate(own):
            if narrower is not None:
                asked = getattr(narrower, quantity)
                rows[i] = rows[i] if asked is None else asked
                rows[i] *= getattr(narrower, f"{quantity}_scale", 1.0)
        return rows * scale

    def tool_limits(quantity: str) -> FloatArray:
        """Return the limits (segments,) of a quantity of the tool."""
        asked = [getattr(narrower, quantity, None) or getattr(common, quantity) for narrower in own]
        return np.array([np.inf if limit is None else limit for limit in asked])

    return SegmentLimits(
        lower=robot.limit("lower"),
        upper=robot.limit("upper"),
        **{quantity: joint_limits(quantity) for quantity in JOINT_QUANTITIES},
        **{quantity: tool_limits(quantity) for quantity in TCP_QUANTITIES},
    )
