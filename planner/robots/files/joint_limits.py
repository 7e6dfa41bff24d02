"""Puts the joint limits of MoveIt and of robot drivers into a URDF document."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import SubElement, tostring

from defusedxml.ElementTree import fromstring

from planner.robots.files.documents import invalid_file
from planner.robots.files.yaml_files import mapping_in, number_in, read_yaml

FIELDS = {
    "lower": ("has_position_limits", "min_position"),
    "upper": ("has_position_limits", "max_position"),
    "velocity": ("has_velocity_limits", "max_velocity"),
    "acceleration": ("has_acceleration_limits", "max_acceleration"),
    "deceleration": ("has_deceleration_limits", "max_deceleration"),
    "jerk": ("has_jerk_limits", "max_jerk"),
    "effort": ("has_effort_limits", "max_effort"),
}
"""The field that says whether there is a limit, and the one with the limit, by the attributes of URDF 1.2."""


def with_joint_limits(urdf: str, path: Path) -> str:
    """Return a URDF document with the limits of a `joint_limits.yaml`, which replace its own.

    A limit counts unless its `has_..._limits` is false.

    Args:
        urdf: The document.
        path: A file with `joint_limits`: for each joint `max_velocity` and others, rad or m, and s, N m or N.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: It is no such file, or the document does not have one of the joints.
    """
    limits = mapping_in(read_yaml(path), "joint_limits", path)
    document = fromstring(urdf)
    joints = {joint.get("name"): joint for joint in document.iterfind("joint")}
    for name in limits:
        values = mapping_in(limits, name, path)
        if name not in joints:
            raise invalid_file("unknown_joint", f"{path.name} limits a joint {name}, which the model does not have")
        limit = joints[name].find("limit")
        limit = SubElement(joints[name], "limit") if limit is None else limit
        for attribute, (has, key) in FIELDS.items():
            if key in values and values.get(has, True):
                value = number_in(values, key, path)
                limit.set(attribute, repr(abs(value) if attribute == "deceleration" else value))
    text: str = tostring(document, encoding="unicode")
    return text
