"""Joint motions that follow tool poses, found by Newton's method from Pinocchio's Jacobians alone: the reference for
the planner's own kinematics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.spatial import FloatArray, Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.robots import Robot

REACHED = 1e-10
"""m and rad: a pose met this well is met."""

MOST_STEPS = 60
"""Newton steps towards one pose."""

DAMPING = 1e-5
"""Of the least squares of a step, m and rad: keeps rounding from turning the axes of a stretched wrist round."""

MARGIN = 0.02
"""rad or m that a traced joint keeps from its position limits, unless it is fixed."""

TRACE_STEP = 0.01
"""m or rad of tool motion from one traced pose to the next; an arm of 0.3 m takes a fifth of it."""

LARGEST_JUMP = 0.3
"""rad or m that a joint may move from one traced pose to the next; more is a change of branch."""


def tool_at(robot: Robot, position: FloatArray) -> Pose:
    """Return the tool's pose at a joint position (joints,)."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, position)
    placement = pin.updateFramePlacement(robot.model, data, robot.tool_frame_id)
    return Pose(placement.translation.copy(), placement.rotation.copy())


def reach(robot: Robot, pose: Pose, start: FloatArray) -> FloatArray | None:
    """Return the joint position (joints,) near `start` that meets a pose; None: Newton's method does not find one."""
    model, data, q = robot.model, robot.data, start.copy()
    rows = 3 if pose.rotation is None else 6
    free = robot.limit("upper") > robot.limit("lower")
    for _ in range(MOST_STEPS):
        J = pin.computeFrameJacobian(model, data, q, robot.tool_frame_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        tool = pin.updateFramePlacement(model, data, robot.tool_frame_id)
        error = pose.position - tool.translation
        if pose.rotation is not None:
            error = np.concatenate([error, pin.log3(pose.rotation @ tool.rotation.T)])
        if np.abs(error).max() < REACHED:
            return q
        J = J.reshape(6, -1)[:rows] * free
        step = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(rows), error)
        q = q + step / max(1.0, float(np.abs(step).max()) / LARGEST_JUMP)
    return None


def trace(robot: Robot, poses: Sequence[Pose], start: FloatArray) -> FloatArray | None:
    """Return joint positions (poses, joints) along dense poses, each near the one before, or None."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    margin = np.minimum(MARGIN, (upper - lower) / 2.0)
    chain, q = [], start
    for pose in poses:
        near = reach(robot, pose, q)
        if near is None or np.abs(near - q).max() > LARGEST_JUMP:
            return None
        if (near < lower + margin - 1e-9).any() or (near > upper - margin + 1e-9).any():
            return None
        chain.append(near)
        q = near
    return np.array(chain)


def on_line(start: Pose, end: Pose, step: float = TRACE_STEP) -> list[Pose]:
    """Return poses from `start` (not counted) to `end` on a straight line, turning about one axis."""
    distance = float(np.linalg.norm(end.position - start.position))
    turn = np.zeros(3)
    if start.rotation is not None and end.rotation is not None:
        turn = pin.log3(end.rotation @ start.rotation.T)
    count = max(1, int(np.ceil(max(distance, float(np.linalg.norm(turn))) / step)))
    return [
        Pose(
            start.position + share * (end.position - start.position),
            end.rotation if start.rotation is None or share == 1.0 else pin.exp3(share * turn) @ start.rotation,
        )
        for share in np.arange(1, count + 1) / count
    ]


def on_circle(start: Pose, via: FloatArray, end: Pose, step: float = TRACE_STEP) -> list[Pose]:
    """Return poses from `start` (not counted) to `end` on the arc by way of `via` (3,), turning about one axis."""
    center, radius, axes, angle = circle(start.position, via, end.position)
    turn = np.zeros(3)
    if start.rotation is not None and end.rotation is not None:
        turn = pin.log3(end.rotation @ start.rotation.T)
    count = max(8, int(np.ceil(max(radius * angle, float(np.linalg.norm(turn))) / step)))
    return [
        Pose(
            center + radius * (np.cos(share * angle) * axes[0] + np.sin(share * angle) * axes[1]),
            None if start.rotation is None else pin.exp3(share * turn) @ start.rotation,
        )
        for share in np.arange(1, count + 1) / count
    ]


def circle(start: FloatArray, via: FloatArray, end: FloatArray) -> tuple[FloatArray, float, FloatArray, float]:
    """Return center (3,), radius, axes (2, 3) and angle of the arc from `start` through `via` to `end`."""
    a, b = via - start, end - start
    normal = np.cross(a, b)
    center = start + (a @ a * np.cross(b, normal) - b @ b * np.cross(a, normal)) / (2.0 * normal @ normal)
    radius = float(np.linalg.norm(start - center))
    first = (start - center) / radius
    second = np.cross(normal / np.linalg.norm(normal), first)
    angle = float(np.arctan2((end - center) @ second, (end - center) @ first)) % (2.0 * np.pi)
    return center, radius, np.array([first, second]), angle


def holds_still(robot: Robot, positions: FloatArray, share: float = 0.8) -> bool:
    """Tell whether the arm's own weight takes at most a share of every torque limit at joint positions (N, joints)."""
    if not robot.has_dynamics:
        return True
    data, rest, limit = robot.model.createData(), np.zeros(robot.dof), robot.limit("torque")
    return all((np.abs(pin.rnea(robot.model, data, q, rest, rest)) <= share * limit).all() for q in positions)
