"""Joint limits of MoveIt and calibrations of Universal Robots: YAML files, put into a URDF document."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import SubElement, tostring

from defusedxml.ElementTree import fromstring

from planner.robots.files.documents import invalid_file

UNITS = {"!radians": 1.0, "!degrees": math.pi / 180.0, "!meters": 1.0, "!millimeters": 1e-3}
"""The units that xacro knows in YAML, in rad or m."""


def read_yaml(path: Path) -> Mapping[str, Any]:
    """Read a YAML file that is a mapping.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: It is no such file, or PyYAML is not installed.
    """
    try:
        import yaml
    except ModuleNotFoundError:
        message = f"{path.name} is a YAML file; install `pyyaml`, or the extra `models`"
        raise invalid_file("missing_package", message) from None

    loader: Any = type("Loader", (yaml.SafeLoader,), {})  # units are not for all users of PyYAML

    for tag, unit in UNITS.items():
        loader.add_constructor(tag, lambda own, node, unit=unit: float(own.construct_scalar(node)) * unit)
    try:
        document = yaml.load(path.read_text(encoding="utf-8"), loader)  # noqa: S506 - a safe loader
    except (yaml.YAMLError, ValueError) as error:
        raise invalid_file("not_yaml", f"{path.name} is not YAML: {error}") from error
    if not isinstance(document, dict):
        raise invalid_file("not_yaml", f"{path.name} has no fields")
    return document


def mapping_in(values: Mapping[str, Any], key: str, path: Path) -> Mapping[str, Any]:
    """Return a field that is a mapping.

    Raises:
        InvalidRobotModel: There is none.
    """
    value = values.get(key)
    if not isinstance(value, dict):
        raise invalid_file("missing_field", f"{path.name} must have the field {key} with fields of its own")
    return value


def number_in(values: Mapping[str, Any], key: str, path: Path) -> float:
    """Return a field that is a finite number.

    Raises:
        InvalidRobotModel: There is none.
    """
    value = values.get(key)
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise invalid_file("not_a_number", f"{path.name}: `{key}` must be a number; got {value!r}")
    return float(value)


JOINTS = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
"""The joints of the URDF by the links that a calibration has, without a prefix."""


def with_calibration(urdf: str, path: Path) -> str:
    """Return a URDF document with the joint origins of a calibration file.

    Args:
        urdf: The document of an arm of Universal Robots; names of joints may have a prefix.
        path: A file with `kinematics`: for each link `x`, `y`, `z`, m, and `roll`, `pitch`, `yaw`, rad.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: It is no such file, or the document does not have these joints.
    """
    kinematics = mapping_in(read_yaml(path), "kinematics", path)
    document = fromstring(urdf)
    for link, name in JOINTS.items():
        values = mapping_in(kinematics, link, path)
        xyz, rpy = (
            " ".join(repr(number_in(values, key, path)) for key in keys)
            for keys in (("x", "y", "z"), ("roll", "pitch", "yaw"))
        )
        joints = [joint for joint in document.iterfind("joint") if (joint.get("name") or "").endswith(name)]
        if len(joints) != 1:
            message = f"{path.name} is for an arm with one joint {name}; the model has {len(joints)}"
            raise invalid_file("other_calibration", message)
        (joint,) = joints
        for origin in joint.findall("origin"):
            joint.remove(origin)
        joint.append(joint.makeelement("origin", {"xyz": xyz, "rpy": rpy}))
    return tostring(document, encoding="unicode")


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
    return tostring(document, encoding="unicode")
