"""Where the tool is, and how fast it moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.spatial import FloatArray, Pose

if TYPE_CHECKING:
    from planner.robots import Robot


def forward_kinematics(robot: Robot, positions: FloatArray) -> list[Pose]:
    """Poses of the tool in the base frame at joint positions (N, joints)."""
    return [tool_pose(robot, q) for q in positions]


def tool_pose(robot: Robot, position: FloatArray) -> Pose:
    """Pose of the tool in the base frame at one joint position (joints,)."""
    pin.forwardKinematics(robot.model, robot.data, position)
    placement = pin.updateFramePlacement(robot.model, robot.data, robot.tool_frame_id)
    return Pose(placement.translation.copy(), placement.rotation.copy())


def jacobian(robot: Robot, position: FloatArray) -> FloatArray:
    """(6, joints): linear over angular velocity of the tool, in the base's axes, per joint velocity."""
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    J: FloatArray = pin.computeFrameJacobian(robot.model, robot.data, position, robot.tool_frame_id, axes)
    return J.reshape(6, robot.dof)  # of one joint Pinocchio gives a vector


def singular_values(robot: Robot, positions: FloatArray) -> FloatArray:
    """Of the Jacobian (m and rad alike), largest first (N, min(6, joints)), at positions (N, joints)."""
    J = np.array([jacobian(robot, position) for position in positions])
    result: FloatArray = np.linalg.svd(J, compute_uv=False)
    return result


def manipulability(robot: Robot, positions: FloatArray) -> FloatArray:
    """sqrt(det(J J^T)) (N,) at positions (N, joints), as the product of the singular values; 0 where singular.

    Yoshikawa 1985. With fewer than six joints it is sqrt(det(J^T J)), the same product.
    """
    result: FloatArray = singular_values(robot, positions).prod(axis=1)
    return result


def tool_speeds(robot: Robot, positions: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Linear (m/s) and angular (rad/s) speed (N,) of the tool.

    Args:
        robot: With its tool.
        positions: (N, joints).
        velocities: (N, joints).
    """
    model, data, frame = robot.model, robot.data, robot.tool_frame_id
    twists = np.empty((len(positions), 6))
    for row, (q, v) in enumerate(zip(positions, velocities, strict=True)):
        pin.forwardKinematics(model, data, q, v)
        twists[row] = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL).vector
    return np.linalg.norm(twists[:, :3], axis=1), np.linalg.norm(twists[:, 3:], axis=1)
