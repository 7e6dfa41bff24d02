"""Numbers of the documents, and reference kinematics that share no code with the planner."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.kinematics import FloatArray, Pose
from planner.robots import Robot
from tests.locations import DATA

if TYPE_CHECKING:
    from collections.abc import Sequence


def document(name: str) -> dict[str, Any]:
    """Return one document's numbers; keys that begin with `computed_` or `corrected_` are not as printed."""
    content: dict[str, Any] = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return content


def homogeneous(axis: str | None = None, angle: float = 0.0, shift: Sequence[float] = (0, 0, 0)) -> FloatArray:
    """Return the transform (4, 4) of a shift, m, then a rotation about `axis`, rad."""
    c, s = np.cos(angle), np.sin(angle)
    rotations: dict[str | None, list[list[float]]] = {
        None: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    T = np.eye(4)
    T[:3, :3] = rotations[axis]
    T[:3, 3] = shift
    return T


def standard_dh(rows: list[tuple[float, float, float]], q: FloatArray) -> FloatArray:
    """Multiply the standard Denavit-Hartenberg transforms (4, 4) of the rows of d, a and alpha.

    Each is Rot(z, q) Trans(0, 0, d) Trans(a, 0, 0) Rot(x, alpha).
    """
    T = np.eye(4)
    for (d, a, alpha), theta in zip(rows, q, strict=True):
        T = T @ homogeneous("z", theta) @ homogeneous(shift=(a, 0, d)) @ homogeneous("x", alpha)
    return T


def modified_dh(rows: list[tuple[float, float, float]], q: FloatArray) -> FloatArray:
    """Multiply the modified Denavit-Hartenberg transforms (4, 4) of the rows of a, alpha and d.

    Each is Rot(x, alpha) Trans(a, 0, 0) Rot(z, q) Trans(0, 0, d).
    """
    T = np.eye(4)
    for (a, alpha, d), theta in zip(rows, q, strict=True):
        T = T @ homogeneous("x", alpha) @ homogeneous(shift=(a, 0, 0)) @ homogeneous("z", theta, (0, 0, d))
    return T


def matrix(pose: Pose) -> FloatArray:
    """Return the transform (4, 4) of a pose with a rotation."""
    T = np.eye(4)
    T[:3, :3] = pose.rotation
    T[:3, 3] = pose.position
    return T


def pose_of(T: FloatArray) -> Pose:
    """Return the pose of a transform (4, 4)."""
    return Pose(T[:3, 3].copy(), T[:3, :3].copy())


def angle_between(R: FloatArray, S: FloatArray) -> float:
    """Return the angle between two rotations, rad, from the chord |R - S|, exact for small angles too."""
    return float(2.0 * np.arcsin(min(np.linalg.norm(R - S) / np.sqrt(8.0), 1.0)))


def gantry() -> Robot:
    """Return three prismatic axes x, y, z, m: its joint trajectories are straight Cartesian lines."""
    links, joints, parent = ['<link name="base"/>'], [], "base"
    for axis, xyz in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")):
        links.append(f'<link name="{axis}"/>')
        joints.append(
            f'<joint name="{axis}_axis" type="prismatic"><parent link="{parent}"/><child link="{axis}"/>'
            f'<axis xyz="{xyz}"/><limit lower="-2" upper="2" velocity="1" effort="100"/></joint>'
        )
        parent = axis
    return Robot.from_urdf(f'<robot name="gantry">{"".join(links + joints)}</robot>')
