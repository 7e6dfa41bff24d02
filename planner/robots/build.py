"""The Pinocchio model of a chain of joints and links, in which every joint moves along its own z axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from planner.robots.description import Follower, Joint
from planner.spatial import FloatArray, rotation_z


@dataclass(frozen=True, eq=False)
class Body:
    """The mass and inertia of a link, in the axes of the link's frame.

    Attributes:
        mass: kg.
        center_of_mass: (3,), m.
        inertia: (3, 3), about the center of mass, kg m^2.
    """

    mass: float
    center_of_mass: FloatArray
    inertia: FloatArray


@dataclass(frozen=True, eq=False)
class Link:
    """A link, placed in the frame of the joint that carries it."""

    name: str
    placement: pin.SE3
    body: Body | None = None


@dataclass(frozen=True, eq=False)
class MovingJoint:
    """A degree of freedom and the links that it carries up to the next one.

    Attributes:
        joint: Name, kind and limits.
        placement: Pose of the joint's frame in the frame of the joint before it. The joint turns about, or slides
            along, the z axis of its frame.
        links: Carried by it.
    """

    joint: Joint
    placement: pin.SE3
    links: Sequence[Link]


def joint_motion(axis: FloatArray, is_angle: bool, position: float) -> pin.SE3:
    """Return the motion of a joint from 0 to `position`, rad or m, about or along a unit vector (3,)."""
    if is_angle:
        return pin.SE3(pin.exp3(axis * position), np.zeros(3))
    return pin.SE3(np.eye(3), axis * position)


def build_model(name: str, base: Sequence[Link], chain: Sequence[MovingJoint]) -> pin.Model:
    """Return the serial chain as a model with one configuration variable a joint and a frame for every link.

    A continuous joint is an ordinary revolute one: Pinocchio's own has two configuration variables, and
    its one value here is an angle like any other. With z as the only axis, whatever else is derived from
    the model (symbolic dynamics, closed forms) has two kinds of joint to know.
    """
    model = pin.Model()
    model.name = name
    _add_links(model, 0, base)
    parent = 0
    for moving in chain:
        joint_model = pin.JointModelRZ() if moving.joint.is_angle else pin.JointModelPZ()
        parent = model.addJoint(parent, joint_model, moving.placement, moving.joint.name)
        _add_links(model, parent, moving.links)
    return model


def _add_links(model: pin.Model, joint: int, links: Sequence[Link]) -> None:
    for link in links:
        inertia = pin.Inertia.Zero()
        if link.body is not None and link.body.mass > 0.0:
            inertia = pin.Inertia(link.body.mass, link.body.center_of_mass, link.body.inertia)
            model.appendBodyToJoint(joint, inertia, link.placement)
        model.addFrame(pin.Frame(link.name, joint, 0, link.placement, pin.FrameType.BODY, inertia), False)


def model_with_locked(model: pin.Model, held: Mapping[str, float]) -> pin.Model:
    """Return a model made by `build_model`, without its locked joints.

    Their links move with the joint before them.
    """
    locked = pin.Model()
    locked.name, locked.gravity = model.name, model.gravity
    carriers = [(0, pin.SE3.Identity())]  # of each joint: the one that it moves with now, and its placement there
    for number in range(1, model.njoints):
        name, (parent, placement) = model.names[number], carriers[model.parents[number]]
        placement = placement * model.jointPlacements[number]
        if name not in held:
            carriers.append((locked.addJoint(parent, model.joints[number], placement, name), pin.SE3.Identity()))
        elif model.joints[number].shortname() == pin.JointModelPZ().shortname():
            carriers.append((parent, placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, held[name]]))))
        else:
            carriers.append((parent, placement * pin.SE3(rotation_z(held[name]), np.zeros(3))))
    for (joint, placement), inertia in zip(carriers, model.inertias.tolist(), strict=True):
        locked.appendBodyToJoint(joint, inertia, placement)
    for frame in model.frames.tolist()[1:]:
        joint, placement = carriers[frame.parentJoint]
        locked.addFrame(pin.Frame(frame.name, joint, 0, placement * frame.placement, frame.type, frame.inertia), False)
    return locked


def model_with_follower(model: pin.Model, follower: Follower, position: float, tip_frame: str) -> pin.Model:
    """Return the model with a mimic joint where it is while its leader is at `position`.

    Args:
        model: A model made by `build_model`, whose frames have the inertias of their links.
        follower: The mimic joint.
        position: Position of the leader, rad or m.
        tip_frame: Name of the link that carries the tool.
    """
    moved = model.copy()
    link = model.frames[model.getFrameId(follower.link, pin.FrameType.BODY)]
    carrier, motion = link.parentJoint, joint_motion(follower.axis, follower.is_angle, follower.multiplier * position)
    motion = link.placement * motion * link.placement.inverse()
    joints = set()
    for number, frame in enumerate(model.frames.tolist()):
        name = frame.name if frame.type == pin.FrameType.BODY else tip_frame
        if number == 0 or name not in follower.links:
            continue
        joints.add(frame.parentJoint)
        if frame.parentJoint != carrier:
            continue
        placement = motion * frame.placement
        moved.frames[number].placement = placement
        if frame.inertia.mass > 0.0:
            there, here = placement.act(frame.inertia), frame.placement.act(frame.inertia)
            moved.inertias[carrier] = (moved.inertias[carrier] + there) - here
    for joint in joints - {carrier}:
        if model.parents[joint] == carrier:
            moved.jointPlacements[joint] = motion * model.jointPlacements[joint]
    return moved
