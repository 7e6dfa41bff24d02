"""The limits in force on each segment: the robot's, narrowed by the request's and the waypoint's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.errors import InvalidProblem
from planner.guarantees import TCP_ORDERS
from planner.robots.description import RANGED_QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from planner.fields import FieldPath
    from planner.robots import Robot
    from planner.spatial import FloatArray

JOINT_QUANTITIES = ("velocity", "acceleration", "jerk", "torque")
"""Names of the quantities of each joint whose limits a caller may narrow."""

TCP_QUANTITIES = tuple(TCP_ORDERS)
"""Names of the quantities of the tool that a caller may limit."""


SMALLEST = 1e-9
"""The smallest limit, scale or mass of a payload, in its SI unit or without: less is a slip, and the squares and
reciprocals of the smallest numbers that a computer has are none."""

TOO_SMALL = f"must be greater than 0, and no less than {SMALLEST:g}"
"""The message of a fault where a number is smaller."""

SCALES = ("velocity_scale", "acceleration_scale")
"""Names of the fields of `Limits` that are factors on others."""


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
        tcp_linear_acceleration: Magnitude of the acceleration of the tool centre point, m/s^2, without gravity.
        tcp_angular_acceleration: Magnitude of the angular acceleration of the tool, rad/s^2.
        tcp_centripetal_acceleration: The part of the acceleration of the tool centre point across its path, m/s^2;
            bends tighter than 0.1 mm count as if they were that wide.
        tcp_linear_jerk: Magnitude of the jerk of the tool centre point, m/s^3.
        tcp_angular_jerk: Magnitude of the angular jerk of the tool, rad/s^3: the second derivative of its angular
            velocity.
        velocity_scale: Factor in (0, 1] on the velocity limits.
        acceleration_scale: Factor in (0, 1] on the acceleration limits.
        velocity_range: Lower and upper velocity of each joint, the lower one negative, where they differ.
        acceleration_range: The same of the acceleration.
        torque_range: The same of the torque or force.
    """

    velocity: tuple[float, ...] | None = None
    acceleration: tuple[float, ...] | None = None
    jerk: tuple[float, ...] | None = None
    torque: tuple[float, ...] | None = None
    tcp_linear_velocity: float | None = None
    tcp_angular_velocity: float | None = None
    tcp_linear_acceleration: float | None = None
    tcp_angular_acceleration: float | None = None
    tcp_centripetal_acceleration: float | None = None
    tcp_linear_jerk: float | None = None
    tcp_angular_jerk: float | None = None
    velocity_scale: float = 1.0
    acceleration_scale: float = 1.0
    velocity_range: tuple[tuple[float, float], ...] | None = None
    acceleration_range: tuple[tuple[float, float], ...] | None = None
    torque_range: tuple[tuple[float, float], ...] | None = None


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
        tcp_linear_acceleration: Limits of the tool's acceleration (segments,), m/s^2.
        tcp_angular_acceleration: Limits of the tool's angular acceleration (segments,), rad/s^2.
        tcp_centripetal_acceleration: Limits of the tool's acceleration across its path (segments,), m/s^2.
        tcp_linear_jerk: Limits of the tool's jerk (segments,), m/s^3.
        tcp_angular_jerk: Limits of the tool's angular jerk (segments,), rad/s^3.
        wider: Factors (segments, 2, joints), 1 or more, by which the lower and the upper limits of a quantity are wider
            than the array of its name, which holds the narrower of both; quantities whose limits are the same in both
            directions are left out.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    tcp_linear_velocity: FloatArray
    tcp_angular_velocity: FloatArray
    tcp_linear_acceleration: FloatArray
    tcp_angular_acceleration: FloatArray
    tcp_centripetal_acceleration: FloatArray
    tcp_linear_jerk: FloatArray
    tcp_angular_jerk: FloatArray
    wider: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def of_tool(self) -> dict[str, FloatArray]:
        """The limits (segments,) of those of `TCP_ORDERS` that are limited anywhere."""
        each = {quantity: getattr(self, quantity) for quantity in TCP_QUANTITIES}
        return {quantity: limit for quantity, limit in each.items() if np.isfinite(limit).any()}

    def without_sampled(self) -> SegmentLimits:
        """Return the limits without those of torque and of the tool."""
        none: Any = dict.fromkeys(TCP_QUANTITIES, np.full(len(self.torque), np.inf))
        return replace(self, torque=np.full_like(self.torque, np.inf), **none)

    def of_tool_among(self, quantities: Collection[str]) -> SegmentLimits:
        """Return the limits without those of the tool that are not among some quantities."""
        none: Any = {quantity: np.full(len(self.torque), np.inf) for quantity in self.of_tool.keys() - set(quantities)}
        return replace(self, **none) if none else self

    def bounds(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper limits of a quantity of the joints, each (segments, joints)."""
        narrower: FloatArray = getattr(self, quantity)
        if quantity not in self.wider:
            return -narrower, narrower
        lower, upper = np.moveaxis(self.wider[quantity], 1, 0)
        return -narrower * lower, narrower * upper

    def weights(self, quantity: str) -> FloatArray:
        """Return shares (2, segments, joints) that the narrower limit is of the lower and of the upper one, up to 1."""
        if quantity not in self.wider:
            return np.ones((2, *getattr(self, quantity).shape))
        weights: FloatArray = 1.0 / np.moveaxis(self.wider[quantity], 1, 0)
        return weights

    def used(self, quantity: str, segments: np.ndarray, values: FloatArray) -> FloatArray:
        """Return the shares (..., joints) of their limits that values (..., joints) on segments (...) use."""
        shares: FloatArray = np.abs(values) / getattr(self, quantity)[segments]
        if quantity in self.wider:
            shares = shares * np.where(values < 0.0, *self.weights(quantity)[:, segments])
        return shares

    def centred(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return the middle between the limits of a quantity and their distance from there, each (segments, joints)."""
        lower, upper = self.bounds(quantity)
        if quantity not in self.wider:
            return np.zeros_like(upper), upper
        middle = np.add(lower, upper, out=np.zeros_like(upper), where=np.isfinite(upper)) / 2.0
        return middle, (upper - lower) / 2.0

    def along(self, travels: FloatArray) -> SegmentLimits:
        """Return the limits of motions that go straight (segments, joints): of velocities those in their direction."""
        if "velocity" not in self.wider:
            return self
        lower, upper = self.bounds("velocity")
        wider = {quantity: factors for quantity, factors in self.wider.items() if quantity != "velocity"}
        return replace(self, velocity=np.where(travels < 0.0, -lower, upper), wider=wider)

    def of(self, segments: np.ndarray) -> SegmentLimits:
        """Return the limits of some segments, in that order."""
        rows = {quantity: getattr(self, quantity)[segments] for quantity in (*JOINT_QUANTITIES, *TCP_QUANTITIES)}
        wider = {quantity: factors[segments] for quantity, factors in self.wider.items()}
        return SegmentLimits(lower=self.lower, upper=self.upper, **rows, wider=wider)


def counted_velocity(limit: FloatArray) -> FloatArray:
    """Velocity limits to measure motions of joints by: a joint without one counts as if its were 1 rad/s or m/s."""
    return np.where(np.isfinite(limit), limit, 1.0)


def limit_faults(robot: Robot, limits: Limits, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of limits asked by a caller: their length, or being wider than the robot's.

    Args:
        robot: Its limits are the widest there are.
        limits: What is asked.
        field: Path of the field that has the limits.
    """
    for name in (*TCP_QUANTITIES, *SCALES):
        number = getattr(limits, name)
        if number is not None and not number >= SMALLEST:
            yield (*field, name), TOO_SMALL
        elif name in SCALES and number > 1.0:
            yield (*field, name), f"must be no more than 1: {number:g} times the robot's limits is beyond them"
    for quantity in RANGED_QUANTITIES:
        name = f"{quantity}_range"
        asked = getattr(limits, name)
        if asked is not None and len(asked) != robot.dof:
            yield (*field, name), f"{len(asked)} values for the {robot.dof} joints of {robot.id}"
            continue
        for i, ((lower, upper), own) in enumerate(zip(asked or (), robot.bounds(quantity).T.tolist(), strict=False)):
            if not (SMALLEST <= -lower < np.inf and SMALLEST <= upper < np.inf):
                yield (
                    (*field, name, i),
                    f"needs a lower limit below 0 and an upper one above, no less than {SMALLEST:g}",
                )
            elif lower < own[0] or upper > own[1]:
                text = f"limits of {robot.joint_names[i]}, {own[0]:.10g} to {own[1]:.10g}"
                yield (*field, name, i), f"wider than the robot's own {quantity} {text}"
    for quantity in JOINT_QUANTITIES:
        asked = getattr(limits, quantity)
        if asked is None:
            continue
        if len(asked) != robot.dof:
            yield (*field, quantity), f"{len(asked)} values for the {robot.dof} joints of {robot.id}"
            continue
        for i, (value, own) in enumerate(zip(asked, robot.limit(quantity), strict=True)):
            if not value >= SMALLEST:
                yield (*field, quantity, i), TOO_SMALL
            elif value > own:
                yield (
                    (*field, quantity, i),
                    f"{value:g} is wider than the robot's own {quantity} limit of {robot.joint_names[i]}, {own:.10g}",
                )


def segment_limits(robot: Robot, common: Limits, own: tuple[Limits | None, ...]) -> SegmentLimits:
    """Resolve the limits of each segment.

    Args:
        robot: The robot, whose limits are the widest there are.
        common: Limits of the whole trajectory.
        own: Limits of each segment; where both give one, the narrower holds. The scales multiply.

    Raises:
        InvalidProblem: Limits wider than the robot's, or a scale above 1: whoever asks for them, none are resolved.
    """
    asked_of_all = {("limits",): common} | {("waypoints", i, "limits"): each for i, each in enumerate(own, 1) if each}
    faults = [fault for field, limits in asked_of_all.items() for fault in limit_faults(robot, limits, field)]
    if faults:
        raise InvalidProblem(faults)

    def joint_limits(quantity: str) -> FloatArray:
        """Return the limits (segments, joints) of a quantity of the joints."""
        scale = getattr(common, f"{quantity}_scale", 1.0)
        asked = getattr(common, quantity)
        rows = np.tile(robot.limit(quantity) if asked is None else np.array(asked), (len(own), 1))
        for i, narrower in enumerate(own):
            if narrower is not None:
                asked = getattr(narrower, quantity)
                rows[i] = rows[i] if asked is None else np.minimum(rows[i], asked)
                rows[i] *= getattr(narrower, f"{quantity}_scale", 1.0)
        return rows * scale

    def tool_limits(quantity: str) -> FloatArray:
        """Return the limits (segments,) of a quantity of the tool."""
        each = ((getattr(limits, quantity, None) or np.inf for limits in (common, narrower)) for narrower in own)
        return np.array([min(asked) for asked in each])

    of_joints = {quantity: joint_limits(quantity) for quantity in JOINT_QUANTITIES}
    wider = {}
    for quantity in RANGED_QUANTITIES:
        ranges = _ranges(robot, quantity, common, own)
        if ranges is not None:
            bounds = np.minimum(of_joints[quantity][:, None], ranges)
            of_joints[quantity] = bounds.min(axis=1)
            with np.errstate(invalid="ignore"):
                factors = bounds / of_joints[quantity][:, None]
            wider[quantity] = np.where(np.isnan(factors), 1.0, factors)
    return SegmentLimits(
        lower=robot.limit("lower"),
        upper=robot.limit("upper"),
        **of_joints,
        **{quantity: tool_limits(quantity) for quantity in TCP_QUANTITIES},
        wider=wider,
    )


def _ranges(robot: Robot, quantity: str, common: Limits, own: tuple[Limits | None, ...]) -> FloatArray | None:
    """Return the magnitudes (segments, 2, joints) of lower and upper limits; None: they are the same everywhere."""
    name, scale_name = f"{quantity}_range", f"{quantity}_scale"
    asked = [[getattr(limits, name, None) for limits in (common, narrower)] for narrower in own]
    if not any(map(any, asked)) and not any(quantity in joint.ranges for joint in robot.joints):
        return None
    ranges = np.tile(np.abs(robot.bounds(quantity)), (len(own), 1, 1))
    for row, narrower, both in zip(ranges, own, asked, strict=True):
        for pairs in both:
            if pairs is not None:
                row[:] = np.minimum(row, np.abs(pairs).T)
        row *= getattr(common, scale_name, 1.0) * getattr(narrower, scale_name, 1.0)
    return ranges
