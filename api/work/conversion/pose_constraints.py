"""From the constraints of requests on the pose of the tool to the library's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import planner
from api.contract.parts import free_motions
from api.work.conversion.poses import to_pose, to_rotation
from planner.spatial import quaternion

if TYPE_CHECKING:
    from collections.abc import Sequence


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
