"""Poses by Pinocchio alone and waypoints beside a home position, for the tests of pendant programs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from planner.problems.problem import JointWaypoint
from planner.robots import Robot
from planner.spatial import Pose


def pinocchio_pose(robot: Robot, position: np.ndarray) -> np.ndarray:
    """Return the transform of the tool, computed by Pinocchio alone."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.asarray(position))
    found: np.ndarray = data.oMf[robot.tool_frame_id].homogeneous
    return found


def pose_beside(robot: Robot, home: np.ndarray, *offset: float) -> Pose:
    """Return the pose of the tool beside its pose at a joint position near home."""
    base = pinocchio_pose(robot, home + 0.1)
    return Pose(base[:3, 3] + np.array(offset), base[:3, :3])


def joints(position: np.ndarray, **more: Any) -> JointWaypoint:
    """Make a waypoint at a joint position."""
    return JointWaypoint(position.tolist(), **more)
