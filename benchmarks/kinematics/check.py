"""Never a wrong success: random requests, half of them out of reach or at the border, every success checked again.

The check is a plain product of 4 x 4 matrices from the model's constants; it shares nothing with the planner's forward
kinematics.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from planner.kinematics import Pose, inverse_kinematics, solution_layers
from planner.kinematics.options import InverseKinematicsOptions

if TYPE_CHECKING:
    from planner.kinematics import FloatArray
    from planner.robots import Robot

TOLERANCE = 1e-6
"""m and rad."""

CLASSES = {"reachable": 0.5, "border": 0.2, "turned": 0.1, "singular": 0.1, "position alone": 0.1}
"""Shares of poses: of a random configuration; in a random direction at 0.9 to 1.2 of the reach, turned at random.
Then a reachable position, turned at random; joints at right angles or limits; a place at 0.5 to 1.2 of the reach."""

BATCH = 20
"""Number of poses solved together, for all solutions of each; as many again are solved one by one."""

SINGULAR_ANGLES = np.pi / 2.0 * np.arange(-2, 3)


def check(robot: Robot, count: int, seed: int) -> dict[str, dict[str, Any]]:
    """Count the requests of every class, the solved ones and the wrong answers; and the worst error."""
    product, rng = PlainProduct(robot), np.random.default_rng(seed)
    options, figures = InverseKinematicsOptions(TOLERANCE, TOLERANCE), {}
    for name, share in CLASSES.items():
        poses = random_poses(robot, product, name, round(share * count), rng)
        answers: list[tuple[Pose, FloatArray]] = []
        solved = 0
        for start in range(0, len(poses), 2 * BATCH):
            together, single = poses[start : start + BATCH], poses[start + BATCH : start + 2 * BATCH]
            for pose, solutions in zip(together, solution_layers(robot, together, options), strict=True):
                solved += bool(solutions)
                answers += [(pose, q) for q in solutions]
            for pose in single:
                result = inverse_kinematics(robot, pose, options)
                if result.status == "solved":
                    solved += 1
                    answers.append((pose, result.position))
        errors = product.errors(answers)
        figures[name] = {
            "requests": len(poses),
            "solved": solved,
            "answers": len(answers),
            "wrong": int((~(errors <= TOLERANCE)).sum()),
            "worst": float(errors.max(initial=0.0)),
        }
    return figures


def random_poses(robot: Robot, product: PlainProduct, name: str, count: int, rng: np.random.Generator) -> list[Pose]:
    """Return poses of one class of requests."""
    lower = np.maximum(robot.limit("lower"), -np.pi)
    upper = np.minimum(robot.limit("upper"), np.pi)
    q = rng.uniform(lower, upper, (count, robot.dof))
    if name == "singular":
        square = np.clip(rng.choice(SINGULAR_ANGLES, q.shape), lower, upper)
        q = np.where(rng.random(q.shape) < 0.5, square, q)
    placements = product(q)
    positions, rotations = placements[:, :3, 3], placements[:, :3, :3]
    if name in ("turned", "border"):
        rotations = np.array([pin.Quaternion(v / np.linalg.norm(v)).matrix() for v in rng.normal(size=(count, 4))])
    if name in ("position alone", "border"):
        reach = np.linalg.norm(product(rng.uniform(lower, upper, (5000, robot.dof)))[:, :3, 3], axis=1).max()
        directions = rng.normal(size=(count, 3))
        shares = rng.uniform(0.9 if name == "border" else 0.5, 1.2, (count, 1))
        positions = shares * reach * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    if name == "position alone":
        return [Pose(position) for position in positions]
    return [Pose(position, rotation) for position, rotation in zip(positions, rotations, strict=True)]


class PlainProduct:
    """The tool's placement as a product of 4 x 4 matrices: one constant and one of the joint's position for each."""

    def __init__(self, robot: Robot) -> None:
        model, data = robot.model, robot.data
        pin.computeJointJacobians(model, data, np.zeros(robot.dof))
        self.robot = robot
        self.constants = [placement.homogeneous for placement in model.jointPlacements.tolist()[1:]]
        self.tool = model.frames[robot.tool_frame_id].placement.homogeneous
        twists = [pin.getJointJacobian(model, data, i + 1, pin.LOCAL).reshape(6, -1)[:, i] for i in range(robot.dof)]
        self.axes = [t[3:] if joint.is_angle else t[:3] for t, joint in zip(twists, robot.joints, strict=True)]

    def __call__(self, positions: FloatArray) -> FloatArray:
        """Return transforms (N, 4, 4) at joint positions (N, joints)."""
        T = np.eye(4)
        for i, (constant, axis) in enumerate(zip(self.constants, self.axes, strict=True)):
            moved = np.tile(np.eye(4), (len(positions), 1, 1))
            if self.robot.joints[i].is_angle:
                K = np.cross(axis, np.eye(3)).T
                s, c = (f(positions[:, i])[:, None, None] for f in (np.sin, np.cos))
                moved[:, :3, :3] = c * np.eye(3) + s * K + (1.0 - c) * np.outer(axis, axis)
            else:
                moved[:, :3, 3] = positions[:, i, None] * axis
            T = T @ constant @ moved
        return np.asarray(T @ self.tool)

    def errors(self, answers: list[tuple[Pose, FloatArray]]) -> FloatArray:
        """Return (answers,): the larger of distance (m) and angle (rad) from the pose; infinite outside the limits."""
        if not answers:
            return np.empty(0)
        q = np.array([position for _, position in answers])
        T = self(q)
        errors = np.linalg.norm(T[:, :3, 3] - np.array([pose.position for pose, _ in answers]), axis=1)
        for i, (pose, _) in enumerate(answers):
            if pose.rotation is not None:
                # |R - R*| = 2 sqrt(2) sin(angle / 2) in the Frobenius norm
                half = np.linalg.norm(T[i, :3, :3] - pose.rotation) / np.sqrt(8.0)
                errors[i] = max(errors[i], 2.0 * np.arcsin(min(half, 1.0)))
        within = ((q >= self.robot.limit("lower")) & (q <= self.robot.limit("upper"))).all(axis=1)
        return np.where(within, errors, np.inf)
