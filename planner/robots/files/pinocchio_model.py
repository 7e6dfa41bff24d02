"""Writes a model of Pinocchio as a URDF document."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from planner.robots.files.documents import RobotFiles, invalid_file
from planner.robots.files.urdf_writer import add_drive, add_inertial, add_joint, text_of
from planner.spatial import FloatArray

BASE_LINK = "base_link"
"""The link that Pinocchio's `universe` becomes."""

AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
"""The axes that the last letters of Pinocchio's kinds of joints name."""

LINKS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
"""The kinds of frames that become links."""


def files_of_model(model: pin.Model) -> RobotFiles:
    """Write a model of Pinocchio as the documents of a robot, for `Robot.from_urdf(files_of_model(model).urdf)`.

    Joints, inertias, body frames and operational frames become joints and links. Limits of position, velocity and
    effort, friction and the inertia of rotors are the model's. Of limits that differ by direction the narrower one
    counts. Gravity is not part of it: `Robot.derived(mounting=...)` tilts the base.

    Args:
        model: The model. Its joints are revolute, continuous or prismatic.

    Raises:
        InvalidRobotModel: A joint is of another kind.
    """
    return RobotFiles(tostring(urdf_of_model(model), encoding="unicode"))


def urdf_of_model(model: pin.Model) -> Element:
    """Return the root of the URDF document of a model; see `files_of_model`.

    Raises:
        InvalidRobotModel: A joint is of another kind.
    """
    robot = Element("robot", name=model.name or "robot")
    names = [BASE_LINK, *(f"{name}_link" for name in list(model.names)[1:])]
    SubElement(robot, "link", name=BASE_LINK)
    for number in range(1, model.njoints):
        kind, axis = _kind_and_axis(model, number)
        ends = names[model.parents[number]], names[number]
        joint = add_joint(robot, model.names[number], kind, ends, model.jointPlacements[number], axis)
        limit = SubElement(joint, "limit")
        v = model.joints[number].idx_v
        if kind != "continuous":
            q = model.joints[number].idx_q
            sides = {"lower": model.lowerPositionLimit[q], "upper": model.upperPositionLimit[q]}
            limit.attrib |= {side: text_of(value) for side, value in sides.items()}
        # Pinocchio states lower limits with either sign.
        velocity = min(abs(model.lowerVelocityLimit[v]), model.upperVelocityLimit[v])
        effort = min(abs(model.lowerEffortLimit[v]), model.upperEffortLimit[v])
        for name, value in (("velocity", velocity), ("effort", effort)):
            if np.isfinite(value):
                limit.set(name, text_of(value))
        add_drive(robot, joint, *_drive(model, v))
        link = SubElement(robot, "link", name=names[number])
        inertia = model.inertias[number]
        if inertia.mass > 0.0:
            add_inertial(link, inertia.mass, pin.SE3(np.eye(3), inertia.lever), inertia.inertia)
    for frame in model.frames:
        if frame.type in LINKS and frame.name not in names:
            names.append(frame.name)
            SubElement(robot, "link", name=frame.name)
            ends = names[frame.parentJoint], frame.name
            add_joint(robot, f"{frame.name}_fixed", "fixed", ends, frame.placement)
    return robot


def _drive(model: pin.Model, v: int) -> tuple[float, float, float]:
    """Return Coulomb friction, viscous friction and rotor inertia of a joint by its index among velocities."""
    friction = max(-model.lowerDryFrictionLimit[v], model.upperDryFrictionLimit[v])
    rotor = model.armature[v] + model.rotorInertia[v] * model.rotorGearRatio[v] ** 2
    return float(friction), float(model.damping[v]), float(rotor)


def _kind_and_axis(model: pin.Model, number: int) -> tuple[str, FloatArray]:
    """Return URDF's kind of a joint and its axis.

    Raises:
        InvalidRobotModel: URDF has no such joint.
    """
    joint = model.joints[number]
    name = joint.shortname().removeprefix("JointModel")
    for kind, stem in (("continuous", "RUB"), ("revolute", "R"), ("prismatic", "P")):
        if name in (f"{stem}{axis}" for axis in AXES):
            return kind, np.array(AXES[name[-1]])
    unaligned = {"RevoluteUnaligned": "revolute", "RevoluteUnboundedUnaligned": "continuous"}
    kinds = unaligned | {"PrismaticUnaligned": "prismatic"}
    if name not in kinds:
        raise invalid_file("unsupported_joint_kind", f"{model.names[number]} is a joint of the kind {name}")
    return kinds[name], np.array(joint.extract().axis)
