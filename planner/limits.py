"""The limits of each segment: the robot's, narrowed by the request's and the waypoint's."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from planner.constraints import (
    ACCELERATION_AT_SPEED,
    JERK_AT_SPEED,
    POWER,
    TOOL,
    TORQUE,
    TORQUE_AT_SPEED,
    TORQUE_WITH_TOLERANCES,
    TOTAL_POWER,
    VELOCITY_AT_POSITION,
    Bounds,
    Constraint,
)
from planner.constraints.rms_torque import RmsTorque
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.guarantees import TCP_ORDERS
from planner.robots import Robot
from planner.robots.description import RANGED_QUANTITIES
from planner.spatial import FloatArray

JOINT_QUANTITIES = ("velocity", "acceleration", "jerk", "torque")
"""Names of the quantities of each joint whose limits a caller may narrow."""

TCP_QUANTITIES = tuple(TCP_ORDERS)
"""Names of the quantities of the tool that a caller may limit."""


SMALLEST = 1e-9
"""The smallest limit, scale or payload mass, in SI units.

A smaller value is a mistake; its square or reciprocal can leave the range of floating-point numbers.
"""

TOO_SMALL = f"must be greater than 0, and at least {SMALLEST:g}"
"""The message of a fault where a number is smaller."""

SCALES = ("velocity_scale", "acceleration_scale", "torque_scale")
"""Names of the fields of `Limits` that are factors on others."""


@dataclass(frozen=True)
class Limits:
    """Requested limits, none wider than the robot's; None: the robot's own limit, and no limit on the tool.

    Attributes:
        velocity: Velocity of each joint, rad/s or m/s.
        acceleration: Acceleration of each joint, rad/s^2 or m/s^2.
        jerk: Jerk of each joint, rad/s^3 or m/s^3.
        torque: Torque or force of each joint, N m or N.
        tcp_linear_velocity: Speed of the tool centre point, m/s.
        tcp_angular_velocity: Angular speed of the tool, rad/s.
        tcp_linear_acceleration: Magnitude of the acceleration of the tool centre point, m/s^2, without gravity.
        tcp_angular_acceleration: Magnitude of the angular acceleration of the tool, rad/s^2.
        tcp_centripetal_acceleration: The component of the acceleration of the tool centre point across its path, m/s^2.
            A bend tighter than 0.1 mm counts as a bend of 0.1 mm.
        tcp_linear_jerk: Magnitude of the jerk of the tool centre point, m/s^3.
        tcp_angular_jerk: Magnitude of the angular jerk of the tool, rad/s^3: the second derivative of its angular
            velocity.
        velocity_scale: Factor in (0, 1] on the velocity limits.
        acceleration_scale: Factor in (0, 1] on the acceleration limits.
        torque_scale: Factor in (0, 1] on the torque limits, also on torque curves. It leaves a reserve to the
            controller.
        velocity_range: Lower and upper velocity of each joint, the lower one negative, where they differ.
        acceleration_range: The same of the acceleration.
        torque_range: The same of the torque or force.
        power: Mechanical power of each joint, W: the magnitude of its torque times its velocity.
        total_power: Mechanical power of all joints together, W: the magnitude of the sum of these products.
        rms_torque: Continuous torque or force of each joint, N m or N. It is the root of the mean of its square over
            the whole trajectory, or over `cycle_time`.
        cycle_time: Time from the start of the trajectory to its next start, s, with a rest after its end; None: the
            trajectory repeats at once.
        further: The largest magnitudes of further quantities, each a `Constraint`, in its unit.
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
    torque_scale: float = 1.0
    velocity_range: tuple[tuple[float, float], ...] | None = None
    acceleration_range: tuple[tuple[float, float], ...] | None = None
    torque_range: tuple[tuple[float, float], ...] | None = None
    power: tuple[float, ...] | None = None
    total_power: float | None = None
    rms_torque: tuple[float, ...] | None = None
    cycle_time: float | None = None
    further: Mapping[Constraint, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SegmentLimits:
    """The limits in force on each segment.

    Attributes:
        position: Position limits (joints,), rad or m.
        velocity: Velocity limits (segments, joints), rad/s or m/s.
        acceleration: Acceleration limits (segments, joints), rad/s^2 or m/s^2.
        jerk: Jerk limits (segments, joints), rad/s^3 or m/s^3, the same in both directions.
        torque: Torque or force limits (segments, joints), N m or N.
        of_tool: The limits (segments,) of the quantities of `TCP_ORDERS` that any segment limits, SI units.
        rms: The limits of the RMS torque over the whole trajectory; None: none.
        further: The limits (segments,) or (segments, columns) of further quantities, by their constraints.
    """

    position: Bounds
    velocity: Bounds
    acceleration: Bounds
    jerk: Bounds
    torque: Bounds
    of_tool: Mapping[str, FloatArray] = field(default_factory=dict)
    further: Mapping[Constraint, FloatArray] = field(default_factory=dict)
    rms: RmsTorque | None = None

    @cached_property
    def constraints(self) -> list[tuple[Constraint, Bounds]]:
        """The constraints that are limited anywhere, and their limits (segments, columns)."""
        one: dict[Constraint, FloatArray] = {TOOL[quantity]: limit for quantity, limit in self.of_tool.items()}
        one |= self.further
        of_joints: list[tuple[Constraint, Bounds]] = []
        if np.isfinite(self.torque.upper).any():
            narrower = Bounds.of_magnitudes(self.torque.narrower)
            of_joints = [(TORQUE, self.torque), (TORQUE_WITH_TOLERANCES, narrower)]
        joints = self.torque.upper.shape[1]
        counts = {own: joints if own.of_joints else 1 for own in one}
        columns = {own: np.broadcast_to(limit.T, (counts[own], len(limit))).T for own, limit in one.items()}
        return [*of_joints, *((own, Bounds.of_magnitudes(limit)) for own, limit in columns.items())]

    def without(self, quantities: Collection[str]) -> SegmentLimits:
        """Return a copy with no limits on the given quantities."""
        none = Bounds.of_magnitudes(np.full_like(self.torque.upper, np.inf))
        of_tool = {quantity: limit for quantity, limit in self.of_tool.items() if quantity not in quantities}
        of_joints: Any = dict.fromkeys(set(JOINT_QUANTITIES) & set(quantities), none)
        left = set(quantities)
        further = {own: limit for own, limit in self.further.items() if not left & {own.name, own.kept_with}}
        return replace(self, **of_joints, of_tool=of_tool, further=further)

    def bounds(self, quantity: str) -> Bounds:
        """Return the limits of a quantity of the joints."""
        bounds: Bounds = getattr(self, quantity)
        return bounds

    def magnitudes(self, quantity: str) -> FloatArray:
        """Return the narrower limits of a quantity of the joints (segments, joints), or the tool's (segments, 1)."""
        if quantity in TCP_ORDERS:
            return self.of_tool.get(quantity, np.full(len(self.torque.upper), np.inf))[:, None]
        return self.bounds(quantity).narrower

    def velocity_at(self, robot: Robot, segments: np.ndarray, positions: FloatArray) -> Bounds:
        """Return the velocity limits (N, joints) in force on segments (N,) at joint positions (N, joints)."""
        bounds = self.velocity.of(segments)
        if robot.velocity_conditions is None:
            return bounds
        scale = self.further[VELOCITY_AT_POSITION][segments, None]
        upper, lower = robot.velocity_conditions.allowed(positions)
        return Bounds(np.maximum(bounds.lower, -scale * lower), np.minimum(bounds.upper, scale * upper))

    def along(self, travels: FloatArray) -> SegmentLimits:
        """Return the limits with velocity and acceleration in the direction of straight motions (segments, joints)."""
        return replace(self, velocity=self.velocity.along(travels), acceleration=self.acceleration.along(travels))

    def of(self, segments: np.ndarray) -> SegmentLimits:
        """Return the limits of some segments, in that order."""
        of_joints: Any = {quantity: self.bounds(quantity).of(segments) for quantity in JOINT_QUANTITIES}
        of_tool = {quantity: limit[segments] for quantity, limit in self.of_tool.items()}
        further = {constraint: limit[segments] for constraint, limit in self.further.items()}
        return replace(self, **of_joints, of_tool=of_tool, further=further)


def limit_faults(robot: Robot, limits: Limits, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of requested limits: a wrong length, or wider than the robot's.

    Args:
        robot: The robot, whose limits are the widest allowed.
        limits: The requested limits.
        field: Path of the field that has the limits.
    """
    further = {constraint.name: number for constraint, number in limits.further.items()}
    yield from ((((*field, "further", name), TOO_SMALL)) for name, number in further.items() if not number >= SMALLEST)
    for name in ("rms_torque", "cycle_time") if field[0] == "waypoints" else ():
        if getattr(limits, name) is not None:
            yield (*field, name), "must stand in the limits of the whole trajectory; got it at a waypoint"
    for name in (*TCP_QUANTITIES, "total_power", "cycle_time", *SCALES):
        number = getattr(limits, name)
        if number is not None and not number >= SMALLEST:
            yield (*field, name), TOO_SMALL
        elif name in SCALES and number > 1.0:
            yield (*field, name), f"must be at most 1; got {number:g}, which exceeds the robot's limits"
    for quantity in RANGED_QUANTITIES:
        name = f"{quantity}_range"
        requested = getattr(limits, name)
        if requested is None:
            continue
        if len(requested) != robot.dof:
            yield (*field, name), f"{len(requested)} values for the {robot.dof} joints of {robot.id}"
            continue
        for i, ((lower, upper), own) in enumerate(zip(requested, robot.bounds(quantity).T.tolist(), strict=True)):
            if not (SMALLEST <= -lower < np.inf and SMALLEST <= upper < np.inf):
                yield (
                    (*field, name, i),
                    f"must have a lower limit below 0 and an upper limit above 0, of at least {SMALLEST:g}",
                )
            elif lower < own[0] or upper > own[1]:
                text = f"limits of {robot.joint_names[i]}, {own[0]:.10g} to {own[1]:.10g}"
                yield (*field, name, i), f"wider than the robot's own {quantity} {text}"
    for quantity in (*JOINT_QUANTITIES, "power", "rms_torque"):
        requested = getattr(limits, quantity)
        if requested is None:
            continue
        if len(requested) != robot.dof:
            yield (*field, quantity), f"{len(requested)} values for the {robot.dof} joints of {robot.id}"
            continue
        widest = np.full(robot.dof, np.inf) if quantity == "power" else robot.limit(quantity)
        for i, (value, own) in enumerate(zip(requested, widest, strict=True)):
            if not value >= SMALLEST:
                yield (*field, quantity, i), TOO_SMALL
            elif value > own:
                yield (
                    (*field, quantity, i),
                    f"{value:g} is wider than the robot's own {quantity} limit of {robot.joint_names[i]}, {own:.10g}",
                )


def segment_limits(
    robot: Robot, common: Limits, own: tuple[Limits | None, ...], masses: Sequence[float] | None = None
) -> SegmentLimits:
    """Resolve the limits of each segment.

    Args:
        robot: The robot, whose limits are the widest there are.
        common: Limits of the whole trajectory.
        own: Limits of each segment; where both give one, the narrower holds. The scales multiply.
        masses: The payload on each segment besides the robot's own, kg; None: none.

    Raises:
        InvalidProblem: Limits wider than the robot's, or a scale above 1: whoever asks for them, none are resolved.
    """
    requested_of_all = {("limits",): common} | {
        ("waypoints", i, "limits"): each for i, each in enumerate(own, 1) if each
    }
    faults = [fault for field, limits in requested_of_all.items() for fault in limit_faults(robot, limits, field)]
    if faults:
        raise InvalidProblem(faults)

    table, carried = robot.payload_table, [0.0] * len(own) if masses is None else masses

    def joint_bounds(quantity: str) -> Bounds:
        """Return the limits (segments, joints) of a quantity of the joints."""
        ranged = quantity in RANGED_QUANTITIES
        widest = np.abs(robot.bounds(quantity)) if ranged else np.array([robot.limit(quantity)] * 2)

        def within(factor: float, *each: Limits) -> FloatArray:
            """Return the limits (2, joints) within all of these, and within a factor on the robot's own."""
            row = widest * factor
            for requested in (getattr(limits, quantity) for limits in each):
                row = row if requested is None else np.minimum(row, requested)
            for requested in (getattr(limits, f"{quantity}_range") for limits in each if ranged):
                row = row if requested is None else np.minimum(row, np.abs(requested).T)
            for limits in each:
                row *= getattr(limits, f"{quantity}_scale", 1.0)
            return row

        factors = [1.0 if table is None else table.factor(quantity, robot.payload_mass + mass) for mass in carried]
        of_all = {factor: within(factor, common) for factor in set(factors)}
        each = [
            of_all[factor] if narrower is None else within(factor, narrower, common)
            for factor, narrower in zip(factors, own, strict=True)
        ]
        rows = np.array(each).reshape(-1, *widest.shape)
        return Bounds(-rows[:, 0], rows[:, 1])

    def tool_limits(quantity: str) -> FloatArray:
        """Return the limits (segments,) of a quantity of the tool."""
        of_all = getattr(common, quantity) or np.inf
        return np.array([min(of_all, getattr(narrower, quantity, None) or np.inf) for narrower in own])

    def scales(name: str) -> FloatArray:
        """Return the products (segments,) of a scale of the whole trajectory and of each segment."""
        of_all = getattr(common, name)
        return np.array([of_all * getattr(narrower, name, 1.0) for narrower in own])

    all_limits = [limits for limits in (common, *own) if limits is not None]
    of_tool = {
        quantity: tool_limits(quantity)
        for quantity in TCP_QUANTITIES
        if any(getattr(limits, quantity) is not None for limits in all_limits)
    }
    requested = [[limits.further for limits in (common, narrower) if limits is not None] for narrower in own]
    further = {
        constraint: np.array([min(limits.get(constraint, np.inf) for limits in each) for each in requested])
        for constraint in dict.fromkeys(constraint for each in requested for limits in each for constraint in limits)
    }
    for power in (POWER, TOTAL_POWER):
        row = np.full(robot.dof, np.inf) if power.of_joints else np.inf
        if any(getattr(limits, power.name) is not None for limits in all_limits):
            each = [
                [getattr(limits, power.name) for limits in (common, narrower) if limits is not None] for narrower in own
            ]
            further[power] = np.array([np.min([row, *(x for x in given if x is not None)], axis=0) for given in each])
    if VELOCITY_AT_POSITION.is_known(robot):
        further[VELOCITY_AT_POSITION] = scales("velocity_scale")
    rating = robot.limit("rms_torque") if common.rms_torque is None else np.array(common.rms_torque)
    rms = RmsTorque(rating, common.cycle_time or 0.0) if np.isfinite(rating).any() else None
    for constraint in (ACCELERATION_AT_SPEED, JERK_AT_SPEED):
        if constraint.is_known(robot):
            is_scaled = hasattr(common, f"{constraint.kept_with}_scale")
            further[constraint] = scales(f"{constraint.kept_with}_scale") if is_scaled else np.ones(len(own))
    if robot.torque_curves is not None:
        further[TORQUE_AT_SPEED] = scales("torque_scale")
    return SegmentLimits(
        Bounds(robot.limit("lower"), robot.limit("upper")),
        **{quantity: joint_bounds(quantity) for quantity in JOINT_QUANTITIES},
        of_tool={quantity: limit for quantity, limit in of_tool.items() if np.isfinite(limit).any()},
        further=further,
        rms=rms,
    )
