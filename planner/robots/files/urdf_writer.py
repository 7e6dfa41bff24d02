"""Writes links and joints of a URDF document, with numbers that are read again without rounding."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import pinocchio as pin

from planner.robots.urdf.elements import ROTOR
from planner.spatial import FloatArray


def text_of(*values: float) -> str:
    """Write numbers so that they are read again without rounding."""
    return " ".join(repr(float(value)) for value in values)


def add_origin(element: Element, pose: pin.SE3) -> None:
    """Write where an element is."""
    rpy = pin.rpy.matrixToRpy(pose.rotation)
    SubElement(element, "origin", xyz=text_of(*pose.translation), rpy=text_of(*rpy))


def add_inertial(link: Element, mass: float, pose: pin.SE3, inertia: FloatArray) -> None:
    """Write the inertial element of a link.

    Args:
        link: The link.
        mass: kg.
        pose: Pose of the center of mass in the link, whose axes the inertia is in.
        inertia: (3, 3), about the center of mass, kg m^2.
    """
    inertial = SubElement(link, "inertial")
    add_origin(inertial, pose)
    SubElement(inertial, "mass", value=text_of(mass))
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    SubElement(inertial, "inertia", {name: text_of(inertia[entry]) for name, entry in entries.items()})


def add_drive(robot: Element, joint: Element, friction: float, damping: float, rotor_inertia: float) -> None:
    """Write the friction of a joint, and its rotor in a transmission with the ratio 1.

    Args:
        robot: The root of the document.
        joint: The joint.
        friction: Coulomb friction, N m or N.
        damping: Viscous friction by the speed, N m s/rad or N s/m.
        rotor_inertia: Seen from the joint, kg m^2 or kg.
    """
    if friction or damping:
        SubElement(joint, "dynamics", friction=text_of(friction), damping=text_of(damping))
    if rotor_inertia:
        name = joint.get("name", "")
        transmission = SubElement(robot, "transmission", name=f"{name}_transmission")
        SubElement(transmission, "joint", name=name)
        SubElement(
            SubElement(transmission, "actuator", name=f"{name}_actuator"), ROTOR[0], value=text_of(rotor_inertia)
        )


def add_joint(
    robot: Element, name: str, kind: str, ends: tuple[str, str], placement: pin.SE3, axis: FloatArray | None = None
) -> Element:
    """Write a joint between a parent and a child link, and return it.

    Args:
        robot: The root of the document.
        name: The name of the joint.
        kind: The value of URDF's attribute `type`.
        ends: The names of the parent and of the child link.
        placement: The placement of the child link in the parent link, at zero.
        axis: (3,), in the frame of the child link; None: it does not move.
    """
    joint = SubElement(robot, "joint", name=name, type=kind)
    add_origin(joint, placement)
    SubElement(joint, "parent", link=ends[0])
    SubElement(joint, "child", link=ends[1])
    if axis is not None:
        SubElement(joint, "axis", xyz=text_of(*axis))
    return joint
