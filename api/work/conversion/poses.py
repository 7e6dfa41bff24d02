"""From the poses of requests to the library's values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from api.contract.parts import common
from planner.spatial import Pose, project_to_rotation, rotation_from_quaternion, rotation_from_rpy

if TYPE_CHECKING:
    from planner.spatial import FloatArray


def to_pose(pose: common.Pose) -> Pose:
    """Make a pose; without an orientation the position alone counts."""
    return Pose(np.array(pose.position), to_rotation(pose.orientation))


def with_axes(pose: Pose) -> Pose:
    """Return the pose of a frame, which has axes: without a rotation, those of the frame that it is in."""
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
            return project_to_rotation(np.array(orientation.matrix))
