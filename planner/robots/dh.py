"""Reads a robot from a Denavit-Hartenberg table, in the standard (distal) or in the modified (Craig's) convention."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

import numpy as np
import pinocchio as pin

from planner.robots.build import Body, Link, MovingJoint, build_model, joint_motion
from planner.robots.chain_checks import check_chain
from planner.robots.checks import (
    MAX_JOINTS,
    MAX_NUMBER,
    check_angles,
    check_body,
    check_length,
    check_limits,
    check_names,
    check_position_limits,
    held_joints,
    with_checked_drives,
    with_torque_curve,
    with_velocity_curves,
)
from planner.robots.collision.geometry import CollisionGeometry
from planner.robots.description import DRIVE_VALUES, Joint, JointKind, RobotDescription
from planner.robots.findings import Findings, shown
from planner.robots.varying.torque_curves import TorqueCurve
from planner.robots.varying.velocity_curves import NO_CURVES, VelocityCurves
from planner.spatial import Pose, is_rotation, rotation_x, rotation_z

Convention = Literal["standard", "modified"]

BASE_FRAME = "base"
"""Name of the frame in which the first row of a table stands."""

TIP_FRAME = "flange"
"""Name of the frame to which the last row of a table leads."""

Z_AXIS = np.array([0.0, 0.0, 1.0])
"""The axis of every joint in its own frame."""

LIMITS = ("lower", "upper", "velocity", "acceleration", "jerk", "torque", "rms_torque")
"""Names of the limits that a row of a table may have."""


@dataclass(frozen=True)
class DHJoint:
    """One row of a Denavit-Hartenberg table, with the limits of its joint; None: no such limit, or not known.

    Attributes:
        kind: Whether the joint adds its position to theta (revolute, continuous) or to d (prismatic).
        theta: Angle about z, rad.
        d: Offset along z, m.
        a: Length along x, m; in the modified convention a(i-1).
        alpha: Twist about x, rad; in the modified convention alpha(i-1).
        lower: Lower position limit, rad or m.
        upper: Upper position limit, rad or m.
        velocity: Velocity limit, rad/s or m/s.
        acceleration: Acceleration limit, rad/s^2 or m/s^2.
        jerk: Jerk limit, rad/s^3 or m/s^3.
        torque: Torque or force limit, N m or N.
        velocity_curves: Velocity limits that depend on the position.
        rms_torque: Limit of the continuous (RMS) torque or force over a cycle, N m or N.
        torque_curve: The torque limit that depends on the speed.
        friction: Coulomb friction of the moving joint, N m or N.
        damping: Viscous friction by the speed, N m s/rad or N s/m.
        rotor_inertia: Inertia of the drive's rotor, times the square of the gear ratio, kg m^2 or kg.
        friction_tolerance: Largest difference of the Coulomb friction from `friction`, N m or N.
        damping_tolerance: Largest difference of the viscous friction from `damping`, N m s/rad or N s/m.
        following_error: Largest distance of the actual position from the planned one at any time, rad or m.
        name: The joint's name; None: `joint_1`, `joint_2`, ...
        mass: Mass of link i, kg.
        center_of_mass: Center of mass of link i, m, in frame i of the table: the frame that this row ends in.
        inertia: Inertia of link i, kg m^2, about its center of mass in the axes of frame i: ixx, ixy, ixz, iyy, iyz,
            izz.
    """

    kind: JointKind
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    torque: float | None = None
    velocity_curves: VelocityCurves = NO_CURVES
    rms_torque: float | None = None
    torque_curve: TorqueCurve | None = None
    friction: float | None = None
    damping: float | None = None
    rotor_inertia: float | None = None
    friction_tolerance: float | None = None
    damping_tolerance: float | None = None
    following_error: float | None = None
    name: str | None = None
    mass: float | None = None
    center_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class DHModel:
    """A Denavit-Hartenberg table, with the transforms before and after it.

    Attributes:
        convention: `standard`: A(i) = Rz(theta) Tz(d) Tx(a) Rx(alpha). `modified`: A(i) = Rx(alpha(i-1)) Tx(a(i-1))
            Rz(theta(i)) Tz(d(i)), with alpha(i-1) and a(i-1) in row i.
        joints: The rows, from the base to the tip.
        base: Pose of frame 0 in the robot's base frame; None: the same.
        tip: Pose of the flange in the frame of the last row; None: the same.
    """

    convention: Convention
    joints: tuple[DHJoint, ...]
    base: Pose | None = None
    tip: Pose | None = None


def read_dh(model: DHModel, *, id: str, source: str) -> RobotDescription:
    """Return the robot of the table, with frames `base`, `link_1`, ... (the table's frames) and `flange`.

    Limits that the table leaves out come from the default rule of `planner.robots.checks`; torque limits have none.

    Raises:
        InvalidRobotModel: The model cannot be used; `findings` lists everything that was found.
    """
    findings = Findings()
    if not 1 <= len(model.joints) <= MAX_JOINTS:
        code = "too_many_joints" if model.joints else "no_joints"
        findings.error(code, None, f"a table needs 1 to {MAX_JOINTS} rows, this one has {len(model.joints)}")
        findings.raise_errors()
    if model.convention not in get_args(Convention):
        findings.error("unknown_convention", None, "the convention is standard or modified")
    names = [row.name if row.name is not None else f"joint_{i}" for i, row in enumerate(model.joints, 1)]
    check_names("joint", names, findings)
    for name, row in zip(names, model.joints, strict=True):
        _check_row(shown(name), row, findings)
    base = _placement(BASE_FRAME, model.base, findings)
    tip = _placement(TIP_FRAME, model.tip, findings)
    findings.raise_errors()
    bodies = [_body(shown(name), row, findings) for name, row in zip(names, model.joints, strict=True)]
    rows = list(zip(map(_joint, names, model.joints), model.joints, bodies, strict=True))
    fixed = held_joints((joint for joint, _, _ in rows), findings)
    moving = [_with_limits(joint, row, findings) for joint, row, _ in rows if joint.name not in fixed]
    if not moving:
        findings.error("no_joints", None, "no joint of the table moves")
    findings.raise_errors()
    joints = {joint.name: joint for joint in with_checked_drives(moving, findings)}
    findings.raise_errors()

    base_links, chain = [Link(BASE_FRAME, pin.SE3.Identity())], []
    before, carried = base, base_links  # from the frame that carries the joint to the frame of the row before
    for number, (joint, row, body) in enumerate(rows, 1):
        twist = pin.SE3(rotation_x(row.alpha), np.array([row.a, 0.0, 0.0]))
        screw = pin.SE3(rotation_z(row.theta), np.array([0.0, 0.0, row.d]))
        # The joint's own motion, about or along z, commutes with the constant part of the screw.
        placement, after = (before, screw * twist) if model.convention == "standard" else (before * twist, screw)
        if joint.name in fixed:
            after = placement * joint_motion(Z_AXIS, joint.is_angle, fixed[joint.name]) * after
        else:
            carried = []
            chain.append(MovingJoint(joints[joint.name], placement, carried))
        carried.append(Link(f"link_{number}", after, body))
        before = after
    carried.append(Link(TIP_FRAME, before * tip))
    check_chain(chain, TIP_FRAME, findings)
    pin_model = build_model(id, base_links, chain)
    collision = CollisionGeometry(pin_model, TIP_FRAME, [joint.travel for joint in joints.values()])
    remarks = tuple(findings.items)
    return RobotDescription(
        id, source, pin_model, tuple(joints.values()), TIP_FRAME, collision=collision, findings=remarks
    )


def _check_row(name: str, row: DHJoint, findings: Findings) -> None:
    """Check the kind and the numbers of a row."""
    if row.kind not in get_args(JointKind):
        findings.error("unknown_joint_kind", name, f"{name} is neither revolute nor continuous nor prismatic")
    for item in fields(row):
        value = getattr(row, item.name)
        if value is None or isinstance(value, str | VelocityCurves | TorqueCurve):
            continue
        numbers = np.atleast_1d(np.asarray(value, dtype=float))
        if not np.isfinite(numbers).all():
            findings.error("non_finite_number", name, f"{item.name} of {name} is not finite")
        elif item.name not in LIMITS and np.abs(numbers).max() > MAX_NUMBER:
            findings.error("number_out_of_range", name, f"{item.name} of {name} is beyond {MAX_NUMBER:g}")
    check_length(name, (row.a, row.d), findings)
    check_angles(name, (row.theta, row.alpha), findings)


def _joint(name: str, row: DHJoint) -> Joint:
    """Return the joint of a row, with the limits of the row."""
    names = (*LIMITS, *DRIVE_VALUES)
    given = {each: getattr(row, each) for each in names if getattr(row, each) is not None}
    return Joint(name, row.kind, **given)


def _with_limits(joint: Joint, row: DHJoint, findings: Findings) -> Joint:
    """Return the joint of a row with checked and completed limits."""
    joint = check_limits(check_position_limits(joint, findings), findings)
    joint = with_velocity_curves(joint, row.velocity_curves, findings)
    return joint if row.torque_curve is None else with_torque_curve(joint, row.torque_curve, findings)


def _body(name: str, row: DHJoint, findings: Findings) -> Body | None:
    """Return the link of a row; None: it weighs nothing."""
    if row.mass is None and row.inertia is None:
        return None
    xx, xy, xz, yy, yz, zz = row.inertia or (0.0,) * 6
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return check_body(name, Body(row.mass or 0.0, np.array(row.center_of_mass), inertia), findings)


def _placement(name: str, pose: Pose | None, findings: Findings) -> pin.SE3:
    """Return the transform of a pose."""
    if pose is None:
        return pin.SE3.Identity()
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    if not is_rotation(rotation) or not np.isfinite(pose.position).all():
        findings.error("invalid_pose", name, f"the pose of the {name} is not made of numbers and a rotation")
        return pin.SE3.Identity()
    check_length(name, pose.position.tolist(), findings)
    if np.abs(pose.position).max() > MAX_NUMBER:
        findings.error("number_out_of_range", name, f"the position of the {name} is beyond {MAX_NUMBER:g}")
    return pin.SE3(rotation, pose.position)
