"""Forward kinematics: poses, Jacobians and speeds of the tool at joint positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.kinematics.screws import screws_of
from planner.spatial import FloatArray, Pose

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from planner.robots import Robot


def forward_kinematics(robot: Robot, positions: ArrayLike) -> list[Pose]:
    """Compute where the tool is at joint positions.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.

    Returns:
        N poses of the tool in the base frame.
    """
    return [tool_pose(robot, q) for q in np.asarray(positions, dtype=np.float64)]


def tool_pose(robot: Robot, position: ArrayLike) -> Pose:
    """Compute where the tool is at one joint position.

    Args:
        robot: The robot, with its tool.
        position: (joints,), rad or m.

    Returns:
        The pose of the tool in the base frame.
    """
    pin.forwardKinematics(robot.model, robot.data, np.asarray(position, dtype=np.float64))
    placement = pin.updateFramePlacement(robot.model, robot.data, robot.tool_frame_id)
    return Pose(placement.translation.copy(), placement.rotation.copy())


def jacobian(robot: Robot, position: ArrayLike) -> FloatArray:
    """Compute the Jacobian of the tool's position and orientation.

    Args:
        robot: The robot, with its tool.
        position: (joints,), rad or m.

    Returns:
        The linear over the angular velocity of the tool, in the base's axes, per joint velocity, (6, joints).
    """
    axes, q = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED, np.asarray(position, dtype=np.float64)
    J: FloatArray = pin.computeFrameJacobian(robot.model, robot.data, q, robot.tool_frame_id, axes)
    return J.reshape(6, robot.dof)  # of one joint Pinocchio gives a vector


def singular_values(robot: Robot, positions: FloatArray) -> FloatArray:
    """Compute the singular values of the Jacobian, m and rad alike, largest first.

    Of an arm that cannot choose its orientation (`Robot.is_position_only`) the rows of the position alone count.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.

    Returns:
        (N, min(rows, joints)).
    """
    return np.asarray(np.linalg.svd(_jacobians(robot, positions), compute_uv=False), dtype=np.float64)


def _jacobians(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the Jacobians (N, rows, joints) at joint positions (N, joints), of the rows that count."""
    rows = 3 if robot.is_position_only else 6
    return np.array([jacobian(robot, position)[:rows] for position in positions], dtype=np.float64)


def manipulability(robot: Robot, positions: ArrayLike) -> FloatArray:
    """Compute how well the tool can be moved in all directions: sqrt(det(J J^T)), Yoshikawa 1985; 0 where singular.

    It is the product of the `singular_values`. With fewer joints than rows sqrt(det(J^T J)) is the same product, with
    as many it is |det(J)|, which is ten times as fast.

    Args:
        robot: The robot, with its tool.
        positions: One joint position (joints,), or N of them (N, joints), rad or m.

    Returns:
        A number of one position, (N,) of N.
    """
    rows = np.asarray(positions, dtype=np.float64)
    J = _jacobians(robot, np.atleast_2d(rows))
    square = J.shape[1] == J.shape[2]
    volumes = np.abs(np.linalg.det(J)) if square else np.linalg.svd(J, compute_uv=False).prod(axis=1)
    result = np.asarray(volumes, dtype=np.float64)
    return result if rows.ndim > 1 else result[0]


def tool_poses(robot: Robot, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute where the tool is at many joint positions in a few array operations.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.

    Returns:
        Positions (N, 3), m, and rotations (N, 3, 3) of the tool in the base frame.
    """
    tool = robot.tool_in_tip
    reached, turned = screws_of(robot).poses(positions, tool.translation)
    return reached, turned @ tool.rotation


def tool_velocities(robot: Robot, positions: ArrayLike, velocities: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Compute how the tool moves at many states of the joints.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.

    Returns:
        The linear velocity (N, 3), m/s, of the tool's origin, and the angular velocity (N, 3), rad/s, of the tool, both
        in the base's axes.
    """
    q, v = (np.asarray(values, dtype=np.float64) for values in (positions, velocities))
    linear, angular = screws_of(robot).twists(q, v, robot.tool_in_tip.translation)
    return np.ascontiguousarray(linear), np.ascontiguousarray(angular)


def tool_accelerations(
    robot: Robot, positions: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Compute how the velocity of the tool changes at many states of the joints.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.
        accelerations: (N, joints), rad/s^2 or m/s^2.

    Returns:
        The derivatives by time of the linear velocity (N, 3), m/s^2, of the tool's origin, and of the angular velocity
        (N, 3), rad/s^2, of the tool, both in the base's axes. Gravity is not in them.
    """
    q, v, a = (np.asarray(values, dtype=np.float64) for values in (positions, velocities, accelerations))
    linear, angular = screws_of(robot).accelerations(q, v, a, robot.tool_in_tip.translation)
    return np.ascontiguousarray(linear), np.ascontiguousarray(angular)


def tool_speeds(robot: Robot, positions: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute how fast the tool moves at many states in a few array operations.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.

    Returns:
        The linear (m/s) and the angular (rad/s) speed (N,) of the tool.
    """
    linear, angular = screws_of(robot).twists(positions, velocities, robot.tool_in_tip.translation)
    return np.sqrt((linear * linear).sum(axis=1)), np.sqrt((angular * angular).sum(axis=1))
