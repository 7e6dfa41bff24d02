"""An arm as screws: its poses, Jacobians and rates at many joint positions."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np
import pinocchio as pin

from planner.kernels.kinematics import Arm, tip_jacobians, tip_poses, tip_rates
from planner.last_used import LastUsed, bytes_of_arrays
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_with_z_along

SCREW_CACHE_BYTES = 2**20
"""Memory of the screws that a process keeps, those last used, bytes: some hundred robots with about 2 kB each."""


class Screws:
    """The arm's tip as a product of exponentials, T(q) = exp(S1 q1) ... exp(Sn qn) T(0) (Brockett 1984).

    Attributes:
        axes: (joints, 3): unit vectors along which the joints turn or slide.
        points: (joints, 3), m: on each axis the point nearest to the base; 0 where the joint slides.
        is_angle: (joints,), bool.
        position: (3,), m: of the tip at joint position 0.
        rotation: (3, 3), of the tip at joint position 0.
        frames: (joints + 1, numbers): the frames of joints and tip, as the kernels read them.
    """

    def __init__(
        self,
        axes: FloatArray,
        points: FloatArray,
        is_angle: np.ndarray,
        position: FloatArray,
        rotation: FloatArray,
    ) -> None:
        self.axes, self.points, self.is_angle = axes, points, is_angle
        self.position, self.rotation = position, rotation
        # Frames along the arm whose z is the joint's axis.
        frames = [np.eye(3), *map(rotation_with_z_along, axes), rotation]
        origins = [np.zeros(3), *points, position]
        rows = zip(pairwise(frames), pairwise(origins), [*is_angle.tolist(), False], strict=True)
        self.frames = np.array([[*(a.T @ b).ravel(), *((q - p) @ a), turns] for (a, b), (p, q), turns in rows])

    @classmethod
    def of(cls, robot: Robot) -> Screws:
        """Read the robot's screws from its Pinocchio model at joint position 0, in the base's axes."""
        model, data, is_angle = robot.model, robot.data, robot.is_angle
        twists = pin.computeJointJacobians(model, data, np.zeros(robot.dof)).reshape(6, robot.dof).T
        axes = np.where(is_angle[:, None], twists[:, 3:], twists[:, :3])
        points = np.where(is_angle[:, None], np.cross(twists[:, 3:], twists[:, :3]), 0.0)
        placement = pin.updateFramePlacement(model, data, robot.tip_frame_id)
        return cls(axes, points, is_angle, placement.translation.copy(), placement.rotation.copy())

    @cached_property
    def cross(self) -> FloatArray:
        """The matrices (joints, 3, 3) of the cross products with the axes: cross @ v = axis x v."""
        return np.cross(self.axes[:, None], np.eye(3)).transpose(0, 2, 1)

    def levers(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Bound the distances (joints,), m, of the tip from each axis; infinite where a later joint may slide for ever.

        Args:
            lower: (joints,), position limits.
            upper: (joints,).
        """
        slides = np.where(self.is_angle, 0.0, np.maximum(np.abs(lower), np.abs(upper)))
        lengths = np.linalg.norm(self.frames[1:, 9:12], axis=1) + np.append(slides[1:], 0.0)
        return np.cumsum(lengths[::-1])[::-1]

    def reversed(self) -> Screws:
        """Return the same arm from its tip to its base: T(q)^-1 = exp(S'n qn) ... exp(S'1 q1) T(0)^-1."""
        back, axes = self.rotation.T, -self.axes[::-1] @ self.rotation
        points = (self.points[::-1] - self.position) @ self.rotation
        points = np.where(self.is_angle[::-1, None], points - (points * axes).sum(axis=1, keepdims=True) * axes, 0.0)
        return Screws(axes, points, self.is_angle[::-1], -back @ self.position, back)

    def of_first(self, count: int) -> Screws:
        """Return so many of its first joints alone, with the base frame as their tip at position 0."""
        return Screws(self.axes[:count], self.points[:count], self.is_angle[:count], np.zeros(3), np.eye(3))

    def without_first(self, count: int) -> Screws:
        """Return the same arm with so many of its first joints held at 0."""
        return Screws(self.axes[count:], self.points[count:], self.is_angle[count:], self.position, self.rotation)

    def poses(self, positions: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the positions (N, 3) of a point of the tip and its rotations (N, 3, 3), in base axes.

        Args:
            positions: (N, joints).
            point: (3,), in the tip frame.
        """
        return tip_poses(Arm(self.frames, point), positions)

    def reach(self, positions: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Compute where a point of the tip frame is, how the tip is turned, and the Jacobian of both.

        Args:
            positions: (N, joints).
            point: (3,), in the tip frame.

        Returns:
            (N, 3), (N, 3, 3) and (N, 6, joints), linear over angular, all in the base's axes.
        """
        return tip_jacobians(Arm(self.frames, point), positions)

    def rates(self, point: FloatArray, positions: FloatArray, *motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute how a point of the tip frame moves and the tip turns (N, 3), in the base's axes.

        Args:
            point: (3,), in the tip frame.
            positions: (N, joints).
            motion: (N, joints) each: velocities for the velocities of the tip; accelerations and jerks, too, for those.

        Returns:
            Linear (m by s) and angular (rad by s).
        """
        return tip_rates(Arm(self.frames, point), positions, *motion)


def meeting_point(axes: FloatArray, points: FloatArray) -> FloatArray:
    """Return the point (3,) nearest to all lines along axes (N, 3) through points (N, 3), by least squares."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    return np.asarray(np.linalg.lstsq(across.reshape(-1, 3), (across @ points[:, :, None]).ravel(), rcond=None)[0])


def screws_of(robot: Robot) -> Screws:
    """Return the robot's screws from a cache; robots with equal kinematics share them."""
    return _known.get(robot.kinematic_content, lambda: Screws.of(robot))


_known: LastUsed[Screws] = LastUsed(SCREW_CACHE_BYTES, bytes_of_arrays)
