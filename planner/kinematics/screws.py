"""An arm as screws: its poses and Jacobians at many joint positions in a few array operations."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray


class Screws:
    """The arm's tip as a product of exponentials, T(q) = exp(S1 q1) ... exp(Sn qn) T(0) (Brockett 1984).

    Read from the Pinocchio model at joint position 0, in the base's axes.

    Attributes:
        axes: (joints, 3): unit vectors along which the joints turn or slide.
        points: (joints, 3), m: on each axis the point nearest to the base; 0 where the joint slides.
        is_angle: (joints,), bool.
        position: (3,), m: of the tip.
        rotation: (3, 3), of the tip.
        cross: (joints, 3, 3), the matrices of the cross products with the axes: cross @ v = axis x v.
    """

    def __init__(self, robot: Robot) -> None:
        model, data = robot.model, robot.data
        twists = pin.computeJointJacobians(model, data, np.zeros(robot.dof)).reshape(6, robot.dof).T
        self.is_angle = robot.is_angle
        self.axes = np.where(self.is_angle[:, None], twists[:, 3:], twists[:, :3])
        self.points = np.where(self.is_angle[:, None], np.cross(twists[:, 3:], twists[:, :3]), 0.0)
        self.cross = np.cross(self.axes[:, None], np.eye(3)).transpose(0, 2, 1)
        placement = pin.updateFramePlacement(model, data, robot.tip_frame_id)
        self.position, self.rotation = placement.translation.copy(), placement.rotation.copy()
        # Frames along the arm whose z is the joint's axis: a turn mixes two columns, all else is constant.
        frames = [np.eye(3), *(_with_z(axis) for axis in self.axes), self.rotation]
        origins = [np.zeros(3), *self.points, self.position]
        self._turns = [after.T @ before for before, after in pairwise(frames)]
        self._shifts = [(b - a) @ frame for frame, (a, b) in zip(frames, pairwise(origins), strict=False)]

    def reach(self, positions: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where a point of the tip frame is, how the tip is turned, and the Jacobian of both.

        Args:
            positions: (N, joints).
            point: (3,), in the tip frame.

        Returns:
            (N, 3), (N, 3, 3) and (N, 6, joints), linear over angular, all in the base's axes.
        """
        count, joints = positions.shape
        slides = np.tile(positions.T, 3)
        cosine, sine = np.cos(slides), np.sin(slides)
        columns = np.repeat(np.eye(3), count, axis=1)  # (3, 3 N): x, y and z of the frame in every configuration
        origin = np.zeros(3 * count)
        axes, anchors = np.empty((joints, 3 * count)), np.empty((joints, 3 * count))
        for i in range(joints):
            origin = origin + self._shifts[i] @ columns
            columns = self._turns[i] @ columns
            x, y, axes[i] = columns
            anchors[i] = origin
            if self.is_angle[i]:
                columns = np.array([cosine[i] * x + sine[i] * y, cosine[i] * y - sine[i] * x, axes[i]])
            else:
                origin = origin + slides[i] * axes[i]
        origin = origin + self._shifts[-1] @ columns
        columns = self._turns[-1] @ columns
        reached = origin + point @ columns
        axes, arms = axes.reshape(joints, 3, count), (reached - anchors).reshape(joints, 3, count)
        J = np.empty((6, joints, count))
        for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            J[k] = axes[:, a] * arms[:, b] - axes[:, b] * arms[:, a]
            J[3 + k] = axes[:, k]
        slide = ~self.is_angle
        J[:3, slide], J[3:, slide] = axes[slide].transpose(1, 0, 2), 0.0
        turned = columns.reshape(3, 3, count).transpose(2, 1, 0)
        return reached.reshape(3, count).T, turned, np.ascontiguousarray(J.transpose(2, 0, 1))


def _with_z(axis: FloatArray) -> FloatArray:
    """A rotation (3, 3) whose third column is `axis`."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(axis, x), axis]).T
