"""Poses: a position and, unless only the position matters, a rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose in the base frame.

    Attributes:
        position: (3,), m.
        rotation: (3, 3), in SO(3); None: any orientation will do.
    """

    position: FloatArray
    rotation: FloatArray | None = None


def rotation_x(angle: float) -> FloatArray:
    """Rotation (3, 3) about x by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> FloatArray:
    """Rotation (3, 3) about y by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> FloatArray:
    """Rotation (3, 3) about z by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Rotation about the fixed axes x, then y, then z (URDF): Rz(yaw) Ry(pitch) Rx(roll)."""
    return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


def rotation_from_quaternion(xyzw: FloatArray) -> FloatArray:
    """Rotation (3, 3) of the quaternion (4,) x, y, z, w, which is normalised first."""
    x, y, z, w = xyzw / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def project_to_rotation(matrix: FloatArray) -> FloatArray:
    """The rotation (3, 3) nearest to `matrix` in the Frobenius norm (orthogonal Procrustes)."""
    u, _, vt = np.linalg.svd(matrix)
    nearest: FloatArray = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return nearest


def quaternions(rotations: FloatArray) -> FloatArray:
    """Quaternions (N, 4) x, y, z, w with w >= 0 of rotations (N, 3, 3).

    Shepperd's method: of the four equivalent formulas each rotation takes the one that divides by the
    largest number.
    """
    R = rotations
    trace = R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2]
    choice = np.argmax(np.stack([R[:, 0, 0], R[:, 1, 1], R[:, 2, 2], trace], axis=1), axis=1)
    i = np.where(choice == 3, 0, choice)
    j, k, rows = (i + 1) % 3, (i + 2) % 3, np.arange(len(R))
    q = np.empty((len(R), 4))
    q[rows, i] = 1.0 - trace + 2.0 * R[rows, i, i]
    q[rows, j] = R[rows, j, i] + R[rows, i, j]
    q[rows, k] = R[rows, k, i] + R[rows, i, k]
    q[:, 3] = R[rows, k, j] - R[rows, j, k]
    vector = choice == 3
    q[vector, 0] = R[vector, 2, 1] - R[vector, 1, 2]
    q[vector, 1] = R[vector, 0, 2] - R[vector, 2, 0]
    q[vector, 2] = R[vector, 1, 0] - R[vector, 0, 1]
    q[vector, 3] = 1.0 + trace[vector]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(q[:, 3:] < 0.0, -q, q)


def poses_as_dicts(poses: Sequence[Pose]) -> list[dict[str, Any]]:
    """Poses in the form that requests and answers use: quaternions, or null where any orientation will do."""
    identity = np.eye(3)
    xyzw = quaternions(np.array([identity if pose.rotation is None else pose.rotation for pose in poses])).tolist()
    return [
        {
            "position": pose.position.tolist(),
            "orientation": None if pose.rotation is None else {"kind": "quaternion", "xyzw": quaternion},
        }
        for pose, quaternion in zip(poses, xyzw, strict=True)
    ]
