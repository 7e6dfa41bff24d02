"""From the poses of requests to the library's values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from api.contract.parts import common
from planner.spatial import Pose, rotation_from_quaternion, rotation_from_rpy

if TYPE_CHECKING:
    from planner.spatial import FloatArray


def to_pose(pose: common.Pose) -> Pose:
    """Make a pose; without an orientation the position alone counts."""
    return Pose(np.array(pose.position), to_rotation(pose.orientation))


def with_axes(pose: Pose) -> Pose:
    """Return the pose of a frame; without a rotation, it has the axes of its parent."""
    return pose if pose.rotation is not None else replace(pose, rotation=np.eye(3))


def to_rotation(orientation: common.Orientation | None) -> FloatArray | None:
    """Make a rotation (3, 3); None where any orientation will do."""
    match orientation:
        case None:
            return None
        case common.QuaternionOrientation():
            return rotation_from_quaternion(np.array(orientation.xyzw))
        case common.RpyOrientation():
            return rotation_from_rpy(*orientation.rpy)
        case common.MatrixOrientation():
            return nearest_rotation(np.array(orientation.matrix))


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) nearest to `matrix` in the Frobenius norm (orthogonal Procrustes)."""
    u, _, vt = np.linalg.svd(matrix)
    nearest: FloatArray = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return nearest
