"""From the poses of requests, and the constraints on them, to the library's values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from api.contract.parts import common, free_motions
from planner.spatial import Pose, quaternion, rotation_from_quaternion, rotation_from_rpy

if TYPE_CHECKING:
    from collections.abc import Sequence

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


def to_pose_constraint(constraint: free_motions.PoseConstraint) -> planner.PoseConstraint:
    """Make a constraint on the pose of the tool."""
    match constraint:
        case free_motions.ToolAxis():
            return planner.ToolAxis(_three(constraint.direction), constraint.angle, _three(constraint.axis))
        case free_motions.ToolOrientation():
            rotation = to_rotation(constraint.orientation)
            x, y, z, w = (0.0, 0.0, 0.0, 1.0) if rotation is None else quaternion(rotation).tolist()
            return planner.ToolOrientation((x, y, z, w), constraint.angle)
        case free_motions.ToolNearPlane():
            return planner.ToolNearPlane(_three(constraint.point), _three(constraint.normal), constraint.distance)
        case free_motions.ToolNearLine():
            return planner.ToolNearLine(_three(constraint.point), _three(constraint.direction), constraint.distance)
        case free_motions.ToolInBox():
            return planner.ToolInBox(to_pose(constraint.pose), _three(constraint.size))
        case free_motions.ToolInHalfSpace():
            return planner.ToolInHalfSpace(_three(constraint.normal), constraint.offset)


def _three(numbers: Sequence[float]) -> tuple[float, float, float]:
    """Return three numbers as the library has them."""
    x, y, z = numbers
    return x, y, z


def with_tuples(values: dict[str, Any]) -> dict[str, Any]:
    """Return values whose lists are tuples, as immutable values have them."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
