"""The stick model of a robot: straight lines from joint to joint, and on to the tool."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.spatial import FloatArray

SAME_JOINT_DISTANCE = 1e-9
"""Distance, m, up to which two points of a stick model are one: joints whose axes meet."""


def stick_model(robot: Robot, position: FloatArray) -> FloatArray:
    """Return the points (joints + 2, 3), m, of the model at a joint position: base, joints, tool."""
    pin.forwardKinematics(robot.model, robot.data, position)
    tool = pin.updateFramePlacement(robot.model, robot.data, robot.tool_frame_id).translation
    joint = int(robot.model.frames[robot.tool_frame_id].parentJoint)
    points = [tool.copy()]
    while joint > 0:
        points.append(robot.data.oMi[joint].translation.copy())
        joint = int(robot.model.parents[joint])
    return np.array([*points, np.zeros(3)])[::-1]


def distinct_points(points: FloatArray) -> FloatArray:
    """Return the points (N, 3) of a stick model without repetitions of the previous point."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > SAME_JOINT_DISTANCE
    kept: FloatArray = points[np.concatenate([[True], apart])]
    return kept
