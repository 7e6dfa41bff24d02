"""The description of a robot: joints, groups and the whole, as the readers produce them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import pinocchio as pin

from planner.errors import Finding
from planner.robots.collision.geometry import CollisionGeometry
from planner.robots.collision.pairs import DisabledCollision
from planner.robots.payload import Payload, PayloadTable, ProcessForce
from planner.robots.varying.torque_curves import TorqueCurve, TorqueCurves
from planner.robots.varying.velocity_curves import NO_CURVES, VelocityConditions, VelocityCurves
from planner.robots.visuals import VisualGeometry, VisualMesh
from planner.spatial import FloatArray, Pose

JointKind = Literal["revolute", "continuous", "prismatic"]
Provenance = Literal["published", "datasheet", "estimate", "default", "owner"]
LIMITED_QUANTITIES = ("position", "velocity", "acceleration", "jerk", "torque")
"""Names of the quantities of a joint that a document may limit."""

RANGED_QUANTITIES = ("velocity", "acceleration", "torque")
"""Names of those whose limits may differ by direction."""

RESISTANCES = ("friction", "damping")
"""The values of friction, by the names of the fields of `Joint`."""

TOLERANCES = tuple(f"{name}_tolerance" for name in RESISTANCES)
"""The largest differences from these values."""

DRIVE_VALUES = (*RESISTANCES, "rotor_inertia", *TOLERANCES, "following_error")
"""The values of a joint's drive, by the names of the fields of `Joint`."""

LEAST_FRICTION = 1e-200
"""A torque, N m or N, by which to divide in place of no friction."""


@dataclass(frozen=True)
class Joint:
    """One degree of freedom and its limits; an infinite limit is none.

    Attributes:
        name: The joint's name, as in `Robot.joint_names`.
        kind: `continuous` is a revolute joint without position limits that may turn for ever.
        lower: Lower position limit, rad or m.
        upper: Upper position limit, rad or m.
        velocity: Velocity limit, rad/s or m/s.
        acceleration: Acceleration limit, rad/s^2 or m/s^2.
        jerk: Jerk limit, rad/s^3 or m/s^3.
        torque: Torque or force limit, N m or N.
        ranges: Lower (negative) and upper limits that differ by direction, by quantity: velocity, acceleration or
            torque. Neither is wider than the limit of that quantity.
        provenance: Where each of `LIMITED_QUANTITIES` comes from; no entry where there is no limit.
        velocity_curves: Velocity limits that depend on the position, beside `velocity` and `ranges`.
        rms_torque: Limit of the continuous torque or force, the root of the mean of its square over a cycle, N m or N.
        torque_curve: The torque limit that depends on the speed, beside `torque` and `ranges`; None: none.
        friction: Coulomb friction of the moving joint, N m or N. At rest there is none.
        damping: Viscous friction by the speed, N m s/rad or N s/m.
        rotor_inertia: Inertia of the drive's rotor, times the square of the gear ratio, kg m^2 or kg.
        friction_tolerance: Largest difference of the Coulomb friction from `friction`, N m or N.
        damping_tolerance: Largest difference of the viscous friction from `damping`, N m s/rad or N s/m.
        following_error: Largest distance of the actual position from the planned one at any time, rad or m. Limits hold
            for all actual positions.
    """

    name: str
    kind: JointKind
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
    torque: float = np.inf
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    provenance: Mapping[str, Provenance] = field(default_factory=dict)
    velocity_curves: VelocityCurves = NO_CURVES
    rms_torque: float = np.inf
    torque_curve: TorqueCurve | None = None
    friction: float = 0.0
    damping: float = 0.0
    rotor_inertia: float = 0.0
    friction_tolerance: float = 0.0
    damping_tolerance: float = 0.0
    following_error: float = 0.0

    @property
    def is_angle(self) -> bool:
        """Whether the joint turns (rather than slides)."""
        return self.kind != "prismatic"

    @property
    def has_drive(self) -> bool:
        """Whether it has friction or a rotor inertia."""
        return any((self.friction, self.damping, self.rotor_inertia))

    @property
    def travel(self) -> float:
        """Largest extension of a prismatic joint, m; 0 for a revolute joint, or a prismatic one without a limit."""
        return 0.0 if self.is_angle or not np.isfinite(self.upper) else max(self.upper, 0.0)


@dataclass(frozen=True)
class JointGroup:
    """Joints that belong together, as an SRDF has them.

    Attributes:
        name: Name of the group.
        joints: Names of its moving joints, from the root to the tips; the other joints of the robot are locked.
        tip_frame: The link at the end of a group that is one chain; None: it is something else.
    """

    name: str
    joints: tuple[str, ...]
    tip_frame: str | None


class JointFriction(NamedTuple):
    """The friction of joints: coulomb sign(v) + viscous v, at velocities v.

    Attributes:
        coulomb: (joints,), N m or N.
        viscous: (joints,), N m s/rad or N s/m.
    """

    coulomb: FloatArray
    viscous: FloatArray

    def along(self, velocities: FloatArray, columns: int) -> tuple[FloatArray, FloatArray]:
        """Return Coulomb and viscous friction (..., columns) at velocities (..., joints), as often for each joint."""
        repeats = columns // velocities.shape[-1]
        constant, linear = self.coulomb * np.sign(velocities), self.viscous * velocities
        return np.repeat(constant, repeats, axis=-1), np.repeat(linear, repeats, axis=-1)


@dataclass(frozen=True, eq=False)
class Follower:
    """A mimic joint that follows a joint of the arm; the model has it where it is while that joint is at 0.

    Attributes:
        name: Name of the mimic joint.
        leader: Name of the arm's joint.
        multiplier: Its motion relative to the leader's.
        offset: Its position while the leader is at 0, rad or m.
        link: Name of the link that it moves.
        axis: (3,), unit vector in that link's frame.
        is_angle: Whether it turns (rather than slides).
        links: Names of `link` and of all links behind it.
    """

    name: str
    leader: str
    multiplier: float
    offset: float
    link: str
    axis: FloatArray
    is_angle: bool
    links: Collection[str]


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """The description of an arm by a document: it has the fields of `Robot`, where they are explained."""

    id: str
    source: str
    model: pin.Model
    joints: tuple[Joint, ...]
    tip_frame: str
    limit_sources: Mapping[str, str] = field(default_factory=dict)
    mounting: Pose | None = None
    named_positions: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    geometry: tuple[Mapping[str, Any], ...] = ()
    groups: tuple[JointGroup, ...] = ()
    disabled_collisions: tuple[DisabledCollision, ...] = ()
    collision: CollisionGeometry | None = None
    visuals: VisualGeometry | None = None
    external_axes: tuple[str, ...] = ()
    positioner: tuple[str, ...] = ()
    payload_frame: str | None = None
    rated_payload: float | None = None
    rated_payload_source: str | None = None
    payload_mass: float = 0.0
    payload_table: PayloadTable | None = None
    process_force: ProcessForce | None = None
    uncertain_payloads: tuple[Payload, ...] = ()
    notes: tuple[str, ...] = ()
    followers: tuple[Follower, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def holds_workpiece(self) -> bool:
        """Whether the arm holds the workpiece under a fixed tool: all of its joints carry the workpiece."""
        return bool(self.positioner) and not self.external_axes

    @cached_property
    def is_angle(self) -> np.ndarray:
        """Whether each joint turns rather than slides, (joints,)."""
        return np.array([joint.is_angle for joint in self.joints])

    @cached_property
    def is_continuous(self) -> np.ndarray:
        """Whether each joint turns without position limits, for ever, (joints,)."""
        return np.array([joint.kind == "continuous" for joint in self.joints])

    def limit(self, quantity: str) -> FloatArray:
        """Return one limit of all joints, (joints,), infinite without a limit.

        Position limits are limits of planned positions: `Joint.following_error` within the joint's own.
        """
        return self._limits[quantity]

    @cached_property
    def _limits(self) -> dict[str, FloatArray]:
        names = ("lower", "upper", "velocity", "acceleration", "jerk", "torque", "rms_torque")
        limits = {name: np.array([getattr(joint, name) for joint in self.joints]) for name in names}
        if self.following_errors is not None:
            limits["lower"] += self.following_errors
            limits["upper"] -= self.following_errors
        return limits

    def bounds(self, quantity: str) -> FloatArray:
        """Return the lower and upper limits (2, joints) of `velocity`, `acceleration` or `torque`; SI units."""
        return self._bounds[quantity]

    @cached_property
    def _bounds(self) -> dict[str, FloatArray]:
        bounds = {}
        for quantity in ("velocity", "acceleration", "jerk", "torque"):
            ranges = [joint.ranges.get(quantity, (-np.inf, np.inf)) for joint in self.joints]
            widest = self.limit(quantity)
            bounds[quantity] = np.clip(np.array(ranges).T, -widest, widest)
        return bounds

    @cached_property
    def middle(self) -> FloatArray:
        """The middle of the position limits, (joints,); 0 where a side is open."""
        lower, upper = self.limit("lower"), self.limit("upper")
        bounded = np.isfinite(lower) & np.isfinite(upper)
        middle = np.where(bounded, (np.where(bounded, lower, 0.0) + np.where(bounded, upper, 0.0)) / 2.0, 0.0)
        return np.clip(middle, lower, upper)

    @cached_property
    def visual_meshes(self) -> tuple[VisualMesh, ...]:
        """The visual meshes of the links with their colours, read at the first use; no proof reads them."""
        return () if self.visuals is None else self.visuals.on(self.model)

    @property
    def visual_findings(self) -> tuple[Finding, ...]:
        """The remarks about the visual meshes, such as one whose file is not there; the files are read for them."""
        return () if self.visuals is None else self.visuals.findings

    @cached_property
    def velocity_conditions(self) -> VelocityConditions | None:
        """The velocity limits of the joints by their positions; None: there are none."""
        curves = [joint.velocity_curves for joint in self.joints]
        if not any(curves):
            return None
        conditions, errors = VelocityConditions.of(curves), self.following_errors
        return conditions if errors is None else conditions.within(errors)

    @cached_property
    def torque_curves(self) -> TorqueCurves | None:
        """The torque limits of the joints by their speeds; None: there are none."""
        curves = [joint.torque_curve for joint in self.joints]
        return TorqueCurves.of(curves) if any(curves) else None

    @cached_property
    def rate_curves(self) -> Mapping[str, TorqueCurves | None]:
        """The limits of acceleration and jerk by the speeds of the joints, with this payload; None: there are none."""
        return {name: self._rate_curves(name) for name in ("acceleration", "jerk")}

    def _rate_curves(self, quantity: str) -> TorqueCurves | None:
        """Return the limits of a quantity by the speeds of the joints; None: there are none."""
        table = self.payload_table
        factors = None if table is None else table.at_speeds(quantity, self.payload_mass)
        if table is None or factors is None:
            return None
        factor, curves = table.factor(quantity, self.payload_mass), list[TorqueCurve | None]()
        for joint in self.joints:
            speeds, most = (
                np.array(table.speeds) * joint.velocity,
                factor * getattr(joint, quantity) * np.array(factors),
            )
            known = bool(np.isfinite(most).all() and np.isfinite(speeds).all())
            curves.append(TorqueCurve(tuple(speeds.tolist()), tuple(most.tolist())) if known else None)
        return TorqueCurves.of(curves) if any(curves) else None

    @cached_property
    def friction(self) -> JointFriction | None:
        """The friction of the joints; None: there is none."""
        return _friction([(joint.friction, joint.damping) for joint in self.joints])

    @cached_property
    def friction_tolerance(self) -> JointFriction | None:
        """The largest differences of the joints' friction from `friction`; None: there are none."""
        return _friction([(joint.friction_tolerance, joint.damping_tolerance) for joint in self.joints])

    @cached_property
    def following_errors(self) -> FloatArray | None:
        """The largest distances (joints,) of actual positions from planned ones, rad or m; None: all are 0."""
        errors = np.array([joint.following_error for joint in self.joints])
        return errors if errors.any() else None


def _friction(rows: Sequence[tuple[float, float]]) -> JointFriction | None:
    """Return the friction of joints with Coulomb and viscous friction in rows; None: all are 0."""
    friction = JointFriction(*np.array(rows).reshape(-1, 2).T)
    return friction if friction.coulomb.any() or friction.viscous.any() else None
