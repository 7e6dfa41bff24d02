"""External axes: rails, gantries and turntables that carry an arm's base, or positioners that carry the workpiece."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from planner.robots.build import Body, Link, MovingJoint, build_model
from planner.robots.checks import (
    MAX_JOINTS,
    MAX_NUMBER,
    check_body,
    check_length,
    check_limits,
    check_names,
    check_position_limits,
)
from planner.robots.description import Joint, JointKind
from planner.robots.findings import Findings, shown
from planner.spatial import FloatArray, Pose, is_rotation, rotation_with_z_along

BASE_SUFFIX = "_base"
"""Suffix of the link that the first external axis stands on, after the name of the axis.

The link is the robot's base frame, which does not move.
"""

LINK_SUFFIX = "_link"
"""What follows the name of an external axis in the name of the link that it moves: its carriage or its table."""

LIMITS = ("lower", "upper", "velocity", "acceleration", "jerk", "torque")
"""Names of the limits that an external axis may have."""

LEAST_AXIS = 1e-9
"""Length of a direction, without unit, up to which it is rounding and none."""


@dataclass(frozen=True, eq=False)
class ExternalAxis:
    """A linear or rotary axis that carries the base of an arm, a workpiece, or the next axis; None: an unknown limit.

    Attributes:
        name: The joint's name.
        kind: `prismatic` (a rail), `revolute` or `continuous` (a turntable).
        axis: (3,), direction of the slide or rotation, in the frame of the axis. Its length is irrelevant within 1e-9
            to 1e9.
        origin: Where the axis stands at position 0: its frame in the base frame, or in the link of the axis before it;
            None: the same.
        lower: Lower position limit, rad or m.
        upper: Upper position limit, rad or m.
        velocity: Velocity limit, rad/s or m/s.
        acceleration: Acceleration limit, rad/s^2 or m/s^2.
        jerk: Jerk limit, rad/s^3 or m/s^3.
        torque: Torque or force limit, N m or N.
        mass: Mass moved by the axis, without the arm and the axes behind it, but with the workpiece, kg; None: no mass.
        center_of_mass: (3,), of that, in the frame of the axis, m.
        inertia: Inertia of that about its center of mass, in the directions of that frame, kg m^2: ixx, ixy, ixz, iyy,
            iyz, izz.

    Examples:
        >>> import planner
        >>> rail = planner.ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0)
        >>> planner.load_robot("kuka_kr16_2").derived(id="on_rail", external_axes=[rail]).joint_names[:2]
        ('rail', 'joint_a1')
    """

    name: str
    kind: JointKind
    axis: Sequence[float]
    origin: Pose | None = None
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    torque: float | None = None
    mass: float | None = None
    center_of_mass: Sequence[float] = (0.0, 0.0, 0.0)
    inertia: Sequence[float] | None = None


def external_chain(
    axes: Sequence[ExternalAxis], model: pin.Model, findings: Findings
) -> tuple[tuple[Joint, ...], list[MovingJoint]]:
    """Return the joints of external axes with their limits, and the chain that they make.

    Args:
        axes: One or more, from the base to the arm.
        model: The arm, whose names the axes cannot have.
        findings: The findings, which are added to.

    Raises:
        InvalidRobotModel: An axis cannot be used.
    """
    if len(axes) + model.njoints - 1 > MAX_JOINTS:
        findings.error("too_many_joints", None, f"a robot has {MAX_JOINTS} joints at most, with its external axes")
    check_names("joint", [*(axis.name for axis in axes), *model.names[1:]], findings)
    links = [axes[0].name + BASE_SUFFIX, *(axis.name + LINK_SUFFIX for axis in axes)]
    check_names("link", [*links, *(frame.name for frame in model.frames.tolist()[1:])], findings)
    joints = tuple(_joint(axis, findings) for axis in axes)
    directions = [_direction(axis, findings) for axis in axes]
    origins = [placement_of(axis.name, axis.origin, findings) for axis in axes]
    findings.raise_errors()
    bodies = [_body(axis, findings) for axis in axes]
    findings.raise_errors()
    chain = []
    before = pin.SE3.Identity()  # of the link before in the frame of its joint, whose z axis is the one that moves
    for joint, direction, origin, body, link in zip(joints, directions, origins, bodies, links[1:], strict=True):
        turned = pin.SE3(rotation_with_z_along(direction), np.zeros(3))
        chain.append(MovingJoint(joint, before * origin * turned, [Link(link, turned.inverse(), body)]))
        before = turned.inverse()
    return joints, chain


def model_on_axes(model: pin.Model, chain: Sequence[MovingJoint], arm_origin: pin.SE3) -> pin.Model:
    """Return the model of an arm that stands on external axes.

    `arm_origin` is the placement of the arm's base in the link of the last axis.
    """
    base_link = Link(chain[0].joint.name + BASE_SUFFIX, pin.SE3.Identity())
    carried = build_model(model.name, [base_link], chain)
    append_arm(carried, model, chain[-1].links[0].placement * arm_origin)
    return carried


def append_arm(carried: pin.Model, model: pin.Model, base: pin.SE3, moves_base: bool = True) -> None:
    """Add the joints, bodies and frames of an arm to the last joint of a chain.

    Args:
        carried: The chain, which is changed.
        model: The arm.
        base: Placement of the arm's base in the frame of that joint.
        moves_base: Whether the bodies at the arm's base move with that joint; otherwise they stand still.
    """
    carrier = carried.njoints - 1
    for number in range(1, model.njoints):
        parent, placement = model.parents[number] + carrier, model.jointPlacements[number]
        placement = base * placement if model.parents[number] == 0 else placement
        carried.addJoint(parent, model.joints[number], placement, model.names[number])
    for number, inertia in enumerate(model.inertias.tolist()):
        if number or moves_base:
            carried.appendBodyToJoint(number + carrier, inertia, pin.SE3.Identity() if number else base)
    for frame in model.frames.tolist()[1:]:
        placement = frame.placement if frame.parentJoint else base * frame.placement
        carried.addFrame(
            pin.Frame(frame.name, frame.parentJoint + carrier, 0, placement, frame.type, frame.inertia), False
        )


def placement_of(name: str, pose: Pose | None, findings: Findings) -> pin.SE3:
    """Return the placement that a pose is; one that is none becomes a finding."""
    if pose is None:
        return pin.SE3.Identity()
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    if not is_rotation(rotation) or not np.abs(pose.position).max() <= MAX_NUMBER:
        text = f"where {shown(name)} stands is not made of numbers up to {MAX_NUMBER:g} and a rotation"
        findings.error("invalid_pose", shown(name), text)
        return pin.SE3.Identity()
    check_length(shown(name), pose.position.tolist(), findings)
    return pin.SE3(rotation, pose.position)


def _joint(axis: ExternalAxis, findings: Findings) -> Joint:
    """Return the joint of an external axis, with plausible limits; given limits have the provenance `owner`."""
    name = shown(axis.name)
    given: dict[str, Any] = {limit: float(value) for limit in LIMITS if (value := getattr(axis, limit)) is not None}
    if any(math.isnan(value) for value in given.values()):
        findings.error("non_finite_number", name, f"a limit of {name} is not a number")
        return Joint(axis.name, axis.kind)
    if axis.kind != "continuous" and not {"lower", "upper"} <= given.keys():
        text = f"{name} needs lower and upper position limits; only a continuous axis has none"
        findings.error("missing_position_limit", name, text)
        return Joint(axis.name, axis.kind)
    joint = check_limits(check_position_limits(Joint(axis.name, axis.kind, **given), findings), findings)
    sources = {quantity: "owner" if source == "published" else source for quantity, source in joint.provenance.items()}
    return replace(joint, provenance=sources)


def _direction(axis: ExternalAxis, findings: Findings) -> FloatArray:
    """Return the direction of an axis, of length 1."""
    direction = np.asarray(axis.axis, dtype=np.float64)
    length = float(np.linalg.norm(direction)) if direction.shape == (3,) else 0.0
    if not LEAST_AXIS < length <= MAX_NUMBER:
        name = shown(axis.name)
        text = f"the axis of {name} is no direction: three numbers, together longer than {LEAST_AXIS:g}"
        findings.error("zero_axis", name, text)
        return np.array([0.0, 0.0, 1.0])
    return direction / length


def _body(axis: ExternalAxis, findings: Findings) -> Body | None:
    """Return what an axis moves besides the arm; None: it weighs nothing."""
    if axis.mass is None and axis.inertia is None:
        return None
    name = shown(axis.name)
    numbers = np.array([axis.mass or 0.0, *axis.center_of_mass, *(axis.inertia or (0.0,) * 6)], dtype=np.float64)
    if len(numbers) != 10 or not np.abs(numbers).max() <= MAX_NUMBER:
        findings.error("non_finite_number", name, f"mass, center of mass and inertia of {name} are no such numbers")
        return None
    xx, xy, xz, yy, yz, zz = numbers[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return check_body(name, Body(float(numbers[0]), numbers[1:4], inertia), findings)
