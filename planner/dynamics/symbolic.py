"""Joint torques as a CasADi expression: the recursive Newton-Euler algorithm over a Pinocchio model.

Luh, Walker and Paul, On-line computational scheme for mechanical manipulators (1980), with three-vectors in the frame
of each joint. The wheel of Pinocchio has no CasADi interface, but has placements and inertias. The models of this
library have only two kinds of joint: revolute about, and prismatic along, the z axis of its frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planner.robots import Robot
from planner.robots.description import Joint
from planner.spatial import FloatArray

ZERO_ELEMENT = 1e-15
"""Magnitude below which an element of a rotation is zero: each one left in is carried through the whole expression."""

ROUNDED_SHARE = 1e-2
"""Share of a joint's velocity limit below which the Coulomb friction of the expression is rounded."""


class SymbolicMotion(NamedTuple):
    """The torques that a motion needs, and the velocity of the tool that it makes.

    Attributes:
        torques: Torques (joints,), N m or N.
        tool_velocity: Velocity (3,) of the tool, m/s, in the axes of the last joint.
        tool_spin: Angular velocity (3,) of the tool, rad/s, in the axes of the last joint.
    """

    torques: ca.SX
    tool_velocity: ca.SX
    tool_spin: ca.SX


class _Moving(NamedTuple):
    """A body on its way: the recursion's state in the frame of its joint."""

    rotation: ca.SX
    offset: ca.SX
    spin: ca.SX
    spin_rate: ca.SX
    velocity: ca.SX
    acceleration: ca.SX


def symbolic_motion(robot: Robot, q: ca.SX, v: ca.SX, a: ca.SX) -> SymbolicMotion:
    """Build the torques, including gravity and payload, and the velocity of the tool.

    Args:
        robot: A serial chain, with its tool and payload.
        q: (joints,), rad or m.
        v: (joints,).
        a: (joints,).
    """
    model, z = robot.model, ca.DM([0.0, 0.0, 1.0])
    still = ca.SX(3, 1)
    first, lift = len(robot.positioner), ca.SX(-robot.chain.load[:3])
    at_rest = _Moving(ca.SX.eye(3), still, still, still, still, lift)
    bodies = [_Moving(ca.SX.eye(3), still, still, still, still, ca.SX(3, 1) if first else lift)]
    for i in range(robot.dof):
        bodies.append(_next_body(bodies[-1], model.jointPlacements[i + 1], robot.is_angle[i], q[i], v[i], a[i]))
    tool = model.frames[robot.tool_frame_id]
    tip = bodies[tool.parentJoint]
    tool_velocity = tip.velocity + ca.cross(tip.spin, _constant(tool.placement.translation))
    pushing = _process_wrench(robot, bodies)
    if first:
        bodies[first] = at_rest._replace(rotation=bodies[first].rotation, offset=bodies[first].offset)
        for i in range(first, robot.dof):
            bodies[i + 1] = _next_body(bodies[i], model.jointPlacements[i + 1], robot.is_angle[i], q[i], v[i], a[i])
    torques: list[Any] = []
    force, moment = still, still
    for i in range(robot.dof, first, -1):
        own_force, own_moment = _inertial_wrench(bodies[i], model.inertias[i])
        force, moment = force + own_force, moment + own_moment
        if pushing is not None and i == tool.parentJoint:
            force, moment = force + pushing[0], moment + pushing[1]
        of_body = ca.dot(z, moment if robot.is_angle[i - 1] else force)
        torques.append(of_body + _of_drive(robot.joints[i - 1], v[i - 1], a[i - 1]))
        moment = bodies[i].rotation @ moment
        force = bodies[i].rotation @ force
        moment = moment + ca.cross(bodies[i].offset, force)
    carrying = _torques_of_positioner(robot, at_rest, q, v, a)
    if pushing is not None:
        force, moment = pushing  # between tool and workpiece: it goes on through the positioner
        for i in range(tool.parentJoint, 0, -1):
            if i <= first:
                carrying[i - 1] += ca.dot(z, moment if robot.is_angle[i - 1] else force)
            moment, force = bodies[i].rotation @ moment, bodies[i].rotation @ force
            moment = moment + ca.cross(bodies[i].offset, force)
    return SymbolicMotion(ca.vertcat(*carrying, *reversed(torques)), tool_velocity, tip.spin)


def _torques_of_positioner(robot: Robot, at_rest: _Moving, q: ca.SX, v: ca.SX, a: ca.SX) -> list[ca.SX]:
    """Return the torques of a positioner, from the link that stands still to the workpiece, as the kernels do."""
    model, z, moving, steps = robot.model, ca.DM([0.0, 0.0, 1.0]), at_rest, list[tuple[ca.SX, ca.SX, ca.SX, ca.SX]]()
    for i in reversed(range(len(robot.positioner))):
        rotation, offset = _placed(model.jointPlacements[i + 1], robot.is_angle[i], q[i])
        spin, spin_rate, acceleration = moving.spin, moving.spin_rate, moving.acceleration
        if robot.is_angle[i]:
            spin_rate = spin_rate - ca.cross(spin, z * v[i]) - z * a[i]
            spin = spin - z * v[i]
        else:
            acceleration = acceleration - 2.0 * ca.cross(spin, z * v[i]) - z * a[i]
        spin, spin_rate, acceleration = (rotation @ vector for vector in (spin, spin_rate, acceleration))
        swing = ca.cross(spin_rate, offset) + ca.cross(spin, ca.cross(spin, offset))
        moving = _Moving(rotation, offset, spin, spin_rate, moving.velocity, acceleration - swing)
        steps.append((rotation, offset, *_inertial_wrench(moving, model.inertias[i])))
    torques, force, moment = list[ca.SX](), ca.SX(3, 1), ca.SX(3, 1)
    for i, (rotation, offset, own_force, own_moment) in enumerate(reversed(steps)):
        force, moment = force + own_force, moment + own_moment
        moment, force = rotation.T @ (moment + ca.cross(force, offset)), rotation.T @ force
        torques.append(-ca.dot(z, moment if robot.is_angle[i] else force) + _of_drive(robot.joints[i], v[i], a[i]))
    return torques


def symbolic_tool_position(robot: Robot, q: ca.SX) -> ca.SX:
    """Return the position (3,) of the tool, m, in the base frame, at joint positions (joints,)."""
    model, tool = robot.model, robot.model.frames[robot.tool_frame_id]
    rotation, position = ca.SX.eye(3), ca.SX(3, 1)
    for i in range(robot.dof):
        own_rotation, offset = _placed(model.jointPlacements[i + 1], robot.is_angle[i], q[i])
        rotation, position = rotation @ own_rotation, position + rotation @ offset
    return position + rotation @ _constant(tool.placement.translation)


def _placed(placement: Any, turns: bool, q: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the rotation (3, 3) and offset (3,) of a joint's frame relative to the joint before."""
    rotation, offset = _constant(placement.rotation), _constant(placement.translation)
    if not turns:
        return rotation, offset + rotation[:, 2] * q
    s, c = ca.sin(q), ca.cos(q)
    return rotation @ ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1)), offset


def _next_body(before: _Moving, placement: Any, turns: bool, q: ca.SX, v: ca.SX, a: ca.SX) -> _Moving:
    """Return the body behind a joint, from the one before it."""
    z = ca.DM([0.0, 0.0, 1.0])
    rotation, offset = _placed(placement, turns, q)
    carried = rotation.T @ before.spin
    velocity = rotation.T @ (before.velocity + ca.cross(before.spin, offset))
    centripetal = ca.cross(before.spin, ca.cross(before.spin, offset))
    acceleration = rotation.T @ (before.acceleration + ca.cross(before.spin_rate, offset) + centripetal)
    spin_rate = rotation.T @ before.spin_rate
    if turns:
        spin_rate = spin_rate + ca.cross(carried, z * v) + z * a
        return _Moving(rotation, offset, carried + z * v, spin_rate, velocity, acceleration)
    acceleration = acceleration + 2.0 * ca.cross(carried, z * v) + z * a
    return _Moving(rotation, offset, carried, spin_rate, velocity + z * v, acceleration)


def _inertial_wrench(body: _Moving, inertia: Any) -> tuple[ca.SX, ca.SX]:
    """Force, and moment about the joint's origin, that move a body as it moves."""
    lever, moments = _constant(inertia.lever), _constant(inertia.inertia)
    swing = ca.cross(body.spin_rate, lever) + ca.cross(body.spin, ca.cross(body.spin, lever))
    force = inertia.mass * (body.acceleration + swing)
    moment = moments @ body.spin_rate + ca.cross(body.spin, moments @ body.spin) + ca.cross(lever, force)
    return force, moment


def _of_drive(joint: Joint, v: ca.SX, a: ca.SX) -> ca.SX:
    """Return the torque of a rotor and of friction, whose Coulomb part is rounded about the velocity 0."""
    torque = joint.rotor_inertia * a + joint.damping * v
    if joint.friction == 0.0:
        return torque
    return torque + joint.friction * v / (v**2 + _rounded_speed(joint) ** 2) ** 0.5


def _rounded_speed(joint: Joint) -> float:
    """Return the speed, rad/s or m/s, about which the Coulomb friction of a joint is rounded."""
    return ROUNDED_SHARE * (joint.velocity if np.isfinite(joint.velocity) else 1.0)


def _process_wrench(robot: Robot, bodies: Sequence[_Moving]) -> tuple[ca.SX, ca.SX] | None:
    """Return the process force, and its moment about the origin of the joint that moves the tool, in its axes."""
    if robot.process_force is None:
        return None
    tool = robot.model.frames[robot.tool_frame_id]
    in_base = robot.process_force.frame == "base"
    axes = _constant(np.eye(3) if in_base else tool.placement.rotation)
    force, moment = (axes @ _constant(np.array(v)) for v in (robot.process_force.force, robot.process_force.moment))
    for body in bodies[1 : tool.parentJoint + 1] if in_base else ():
        force, moment = body.rotation.T @ force, body.rotation.T @ moment
    return force, moment + ca.cross(_constant(tool.placement.translation), force)


def _constant(values: FloatArray) -> ca.SX:
    return ca.sparsify(ca.SX(np.where(np.abs(values) < ZERO_ELEMENT, 0.0, values)))


def dynamics_content(robot: Robot) -> bytes:
    """Return bytes that are equal for robots with equal expressions, as the key of a cache."""
    model, tool = robot.model, robot.model.frames[robot.tool_frame_id]
    drives = [(j.rotor_inertia, j.damping, j.friction, _rounded_speed(j) if j.friction else 0.0) for j in robot.joints]
    arrays = [robot.chain.load, robot.is_angle, tool.placement.homogeneous, np.array(drives)]
    for placement, inertia in zip(model.jointPlacements.tolist(), model.inertias.tolist(), strict=True):
        arrays += [placement.homogeneous, np.array([inertia.mass]), inertia.lever, inertia.inertia]
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
