"""Applies the calibration of an arm of Universal Robots to its URDF document."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import tostring

from defusedxml.ElementTree import fromstring

from planner.robots.files.documents import invalid_file
from planner.robots.files.yaml_files import mapping_in, number_in, read_yaml

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
    text: str = tostring(document, encoding="unicode")
    return text
