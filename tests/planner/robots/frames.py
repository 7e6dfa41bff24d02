"""Plain homogeneous matrices, the independent truth of the tests of robots."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pinocchio as pin

from planner.robots import Robot


def rot(axis: str, angle: float) -> np.ndarray:
    """Return a 4 x 4 rotation about x, y or z."""
    T = np.eye(4)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T[i, i] = T[j, j] = np.cos(angle)
    T[i, j], T[j, i] = -np.sin(angle), np.sin(angle)
    return T


def trans(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """Return the 4 x 4 translation."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def product(*factors: np.ndarray) -> np.ndarray:
    """Multiply matrices from left to right."""
    return reduce(np.matmul, factors, np.eye(4))


def frame_pose(robot: Robot, q: np.ndarray, frame: str | None = None) -> np.ndarray:
    """Return the 4 x 4 pose of a frame of the robot, by default of its tip, by Pinocchio."""
    pin.framesForwardKinematics(robot.model, robot.data, np.asarray(q, dtype=float))
    frame_id = robot.tip_frame_id if frame is None else robot.model.getFrameId(frame, pin.FrameType.BODY)
    return np.array(robot.data.oMf[frame_id].homogeneous)


def numeric_jacobian(robot: Robot, q: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Compute the Jacobian (6, n) by central differences: linear, then angular velocity, in the base frame."""
    columns = []
    R = frame_pose(robot, q)[:3, :3]
    for j in range(robot.dof):
        h = step * np.eye(robot.dof)[j]
        change = (frame_pose(robot, q + h) - frame_pose(robot, q - h)) / (2.0 * step)
        omega = change[:3, :3] @ R.T
        columns.append([*change[:3, 3], omega[2, 1], omega[0, 2], omega[1, 0]])
    return np.array(columns).T


def pinocchio_configuration(model: pin.Model, robot: Robot, q: np.ndarray) -> np.ndarray:
    """Convert q to Pinocchio's configuration: cosine and sine of continuous joints; joints outside the arm at 0."""
    full = pin.neutral(model)
    for name, value in zip(robot.joint_names, q, strict=True):
        its = model.joints[model.getJointId(name)]
        full[its.idx_q : its.idx_q + its.nq] = (np.cos(value), np.sin(value)) if its.nq == 2 else value
    return full
