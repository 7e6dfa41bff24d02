"""A robot as viewers of ROS 2 show it: a URDF document with simple shapes, and transforms of its links."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.robots.files.pinocchio_model import BASE_LINK, LINKS, urdf_of_model
from planner.robots.files.urdf_writer import add_origin, text_of
from planner.shapes import surface
from planner.spatial import FloatArray, rotation_from_rpy

SIZES = ("radius", "length", "size")
"""The sizes of URDF's simple shapes."""


def robot_description(robot: Robot) -> str:
    """Return a URDF document of an arm for viewers.

    A link is drawn by the simple shapes of its description. Without these a box surrounds each collision shape.
    """
    document = urdf_of_model(robot.model)
    links = {link.get("name"): link for link in document.findall("link")}
    for shape in robot.geometry:
        placement = pin.SE3(rotation_from_rpy(*shape["rpy"]), np.array(shape["position"]))
        sizes = {size: np.atleast_1d(shape[size]) for size in SIZES if size in shape}
        _add_visual(links[shape["frame"]], placement, shape["kind"], sizes)
    for collider in () if robot.geometry else robot.collision_shapes:
        corners = surface(collider.shape).vertices
        low, high = corners.min(axis=0), corners.max(axis=0)
        placement = collider.placement * pin.SE3(np.eye(3), 0.5 * (low + high))
        _add_visual(links[_joint_link(robot.model, collider.joint)], placement, "box", {"size": high - low})
    return tostring(document, encoding="unicode")


def _add_visual(link: Element, placement: pin.SE3, kind: str, sizes: dict[str, FloatArray]) -> None:
    visual = SubElement(link, "visual")
    add_origin(visual, placement)
    SubElement(SubElement(visual, "geometry"), kind, {name: text_of(*value) for name, value in sizes.items()})


def _joint_link(model: pin.Model, number: int) -> str:
    """Return the name of the link that a joint moves, by the joint's number; 0: the base."""
    return f"{model.names[number]}_link" if number else BASE_LINK


def link_transforms(model: pin.Model, position: FloatArray) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the name of each link but the base, and its `geometry_msgs/msg/Transform` in the base.

    Args:
        model: The model of the arm.
        position: The joint position (joints,), rad or m.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, position)
    poses = {_joint_link(model, number): data.oMi[number] for number in range(model.njoints)}
    frames = (number for number, frame in enumerate(model.frames) if frame.type in LINKS)
    poses = {model.frames[number].name: data.oMf[number] for number in frames} | poses
    for name, pose in poses.items():
        if name != BASE_LINK:
            rotation = pin.Quaternion(pose.rotation).coeffs().tolist()
            yield (
                name,
                {
                    "translation": dict(zip("xyz", pose.translation.tolist(), strict=True)),
                    "rotation": dict(zip("xyzw", rotation, strict=True)),
                },
            )
