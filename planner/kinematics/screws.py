"""An arm as screws: its poses, Jacobians and twists at many joint positions in a few array operations."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from planner.last_used import LastUsed, bytes_of_arrays

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray


MOST_BYTES = 2**20
"""Memory of the screws that a process keeps, those last used, bytes: some hundred robots with about 2 kB each."""


class Screws:
    """The arm's tip as a product of exponentials, T(q) = exp(S1 q1) ... exp(Sn qn) T(0) (Brockett 1984).

    Attributes:
        axes: (joints, 3): unit vectors along which the joints turn or slide.
        points: (joints, 3), m: on each axis the point nearest to the base; 0 where the joint slides.
        is_angle: (joints,), bool.
        position: (3,), m: of the tip at joint position 0.
        rotation: (3, 3), of the tip at joint position 0.
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
        # Frames along the arm whose z is the joint's axis: a turn mixes two columns, all else is constant.
        frames = [np.eye(3), *(_with_z(axis) for axis in axes), rotation]
        origins = [np.zeros(3), *points, position]
        self._turns = [after.T @ before for before, after in pairwise(frames)]
        self._shifts = [(b - a) @ frame for frame, (a, b) in zip(frames, pairwise(origins), strict=False)]

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
        lengths = np.array([np.linalg.norm(shift) for shift in self._shifts[1:]]) + np.append(slides[1:], 0.0)
        levers: FloatArray = np.cumsum(lengths[::-1])[::-1]
        return levers

    def without_first(self, count: int = 1) -> Screws:
        """Return the same arm with its first joints held at 0, as many as are said."""
        return Screws(self.axes[count:], self.points[count:], self.is_angle[count:], self.position, self.rotation)

    def backwards(self) -> Screws:
        """Return arm seen from its tip: with joint positions -q in reverse order it takes T(0) T(q)^-1 for its pose."""
        return Screws(self.axes[::-1], self.points[::-1], self.is_angle[::-1], np.zeros(3), np.eye(3))

    def poses(self, positions: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute where a point of the tip frame is (N, 3), and how the tip is turned (N, 3, 3), in the base's axes.

        Args:
            positions: (N, joints).
            point: (3,), in the tip frame.
        """
        reached, turned = self._frames(positions, point).tip(len(positions))
        return reached.T, turned

    def reach(self, positions: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Compute where a point of the tip frame is, how the tip is turned, and the Jacobian of both.

        Args:
            positions: (N, joints).
            point: (3,), in the tip frame.

        Returns:
            (N, 3), (N, 3, 3) and (N, 6, joints), linear over angular, all in the base's axes.
        """
        chain = self._along(positions, point)
        count, joints = positions.shape
        J = np.empty((6, joints, count))
        J[:3] = chain.linear.transpose(1, 0, 2)
        J[3:] = np.where(self.is_angle[:, None], chain.axes.transpose(1, 0, 2), 0.0)
        return chain.reached.T, chain.turned, np.ascontiguousarray(J.transpose(2, 0, 1))

    def twists(self, positions: FloatArray, velocities: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute how fast a point of the tip frame moves and the tip turns (N, 3), m/s and rad/s, in the base's axes.

        Args:
            positions: (N, joints).
            velocities: (N, joints).
            point: (3,), in the tip frame.
        """
        chain, rates = self._along(positions, point), velocities.T[:, None]
        turning = np.where(self.is_angle[:, None, None], rates, 0.0)
        return (chain.linear * rates).sum(axis=0).T, (chain.axes * turning).sum(axis=0).T

    def accelerations(
        self, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray, point: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the accelerations (N, 3) of a point of the tip frame and of the tip's turn, in the base's axes.

        What a joint adds to the velocity turns with the joints before it, and the lever of a joint that turns changes
        as it and those behind it move. So J' q' is the sum over the joints of w x c + s x v: w is the angular velocity
        before the joint, s and c what the joint adds to the angular and the linear velocity, v what it and those behind
        it add to the linear one.

        Args:
            positions: (N, joints).
            velocities: (N, joints).
            accelerations: (N, joints).
            point: (3,), in the tip frame.

        Returns:
            Linear (m/s^2) and angular (rad/s^2).
        """
        chain, rates, gains = self._along(positions, point), velocities.T[:, None], accelerations.T[:, None]
        turns = self.is_angle[:, None, None]
        added, turning = chain.linear * rates, np.where(turns, chain.axes * rates, 0.0)
        before = np.cumsum(turning, axis=0) - turning
        behind = np.cumsum(added[::-1], axis=0)[::-1]
        linear = chain.linear * gains + np.cross(before, added, axis=1) + np.cross(turning, behind, axis=1)
        angular = np.where(turns, chain.axes * gains, 0.0) + np.cross(before, turning, axis=1)
        return linear.sum(axis=0).T, angular.sum(axis=0).T

    def jerks(
        self,
        positions: FloatArray,
        velocities: FloatArray,
        accelerations: FloatArray,
        jerks: FloatArray,
        point: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the jerks (N, 3) of a point of the tip frame and of the tip's turn, in the base's axes.

        From link to link: an axis, or the arm from one axis to the next, is carried along by the link that it is fixed
        to, and what the joint does along it is differentiated as a product.

        Args:
            positions: (N, joints).
            velocities: (N, joints).
            accelerations: (N, joints).
            jerks: (N, joints).
            point: (3,), in the tip frame.

        Returns:
            Linear (m/s^3) and angular (rad/s^3).
        """
        frames = self._frames(positions, point)
        marks = np.array([*frames.anchors, frames.reached]).reshape(len(frames.axes) + 1, 3, -1)
        turning, linear = np.zeros((3, *marks.shape[1:])), np.zeros(marks.shape[1:])
        rates = zip(positions.T, velocities.T, accelerations.T, jerks.T, strict=True)
        for i, (q, v, a, j) in enumerate(rates):
            axis, arm = frames.axes[i].reshape(3, -1), marks[i + 1] - marks[i]
            first, second, third = _carried(axis, turning)
            if self.is_angle[i]:
                turning = turning + np.array([axis * v, first * v + axis * a, second * v + 2.0 * first * a + axis * j])
            else:
                linear += third * q + 3.0 * (second * v + first * a) + axis * j
                arm = arm - axis * q
            linear += _carried(arm, turning)[2]
        return linear.T, turning[2].T

    def _along(self, positions: FloatArray, point: FloatArray) -> _Chain:
        """Return the axes and what they do to a point of the tip frame, all of N configurations at once."""
        frames = self._frames(positions, point)
        count, joints = positions.shape
        axes, arms = (np.array(rows).reshape(joints, 3, count) for rows in (frames.axes, frames.anchors))
        np.subtract(frames.reached.reshape(3, count), arms, out=arms)
        linear = np.empty((joints, 3, count))
        for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            linear[:, k] = axes[:, a] * arms[:, b] - axes[:, b] * arms[:, a]
        slide = ~self.is_angle
        linear[slide] = axes[slide]
        return _Chain(axes, linear, *frames.tip(count))

    def _frames(self, positions: FloatArray, point: FloatArray) -> _Frames:
        """Return the frames along the arm, all of N configurations at once."""
        count = len(positions)
        slides = np.tile(positions.T, 3)
        cosine, sine = (np.tile(function(positions.T), 3) for function in (np.cos, np.sin))
        columns = np.repeat(np.eye(3), count, axis=1)  # (3, 3 N): x, y and z of the frame in every configuration
        origin = np.zeros(3 * count)
        axes, anchors = [], []
        for i, is_angle in enumerate(self.is_angle.tolist()):
            origin = origin + self._shifts[i] @ columns
            columns = self._turns[i] @ columns
            x, y, axis = columns
            axes.append(axis)
            anchors.append(origin)
            if is_angle:
                columns = np.array([cosine[i] * x + sine[i] * y, cosine[i] * y - sine[i] * x, axis])
            else:
                origin = origin + slides[i] * axis
        origin = origin + self._shifts[-1] @ columns
        columns = self._turns[-1] @ columns
        return _Frames(axes, anchors, origin + point @ columns, columns)


class _Frames(NamedTuple):
    """The frames along an arm in N configurations, in the base's axes: x, y and z of all configurations in a row.

    Attributes:
        axes: (3 N,) each: the axes of the joints.
        anchors: (3 N,) each, m: a point on each axis.
        reached: (3 N,), m: where the point of the tip frame is.
        columns: (3, 3 N): the axes of the tip frame.
    """

    axes: list[FloatArray]
    anchors: list[FloatArray]
    reached: FloatArray
    columns: FloatArray

    def tip(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Return where the point is (3, N), and how the tip is turned (N, 3, 3)."""
        return self.reached.reshape(3, count), self.columns.reshape(3, 3, count).transpose(2, 1, 0)


class _Chain(NamedTuple):
    """What joints do to a point of the tip frame in N configurations, in the base's axes.

    Attributes:
        axes: (joints, 3, N): unit vectors along the joints' axes.
        linear: (joints, 3, N): velocity of the point by velocity of each joint.
        reached: (3, N), m: where the point is.
        turned: (N, 3, 3): how the tip is turned.
    """

    axes: FloatArray
    linear: FloatArray
    reached: FloatArray
    turned: FloatArray


def _carried(vector: FloatArray, turning: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Differentiate vectors (3, N) three times, each fixed to a body with angular velocity w = turning[0].

    dr = w x r, and so ddr = dw x r + w x dr and dddr = ddw x r + 2 dw x dr + w x ddr.

    Args:
        vector: (3, N).
        turning: (3, 3, N): the angular velocity and its derivatives.
    """
    speed, gain, jerk = turning
    first = np.cross(speed, vector, axis=0)
    second = np.cross(gain, vector, axis=0) + np.cross(speed, first, axis=0)
    third = np.cross(jerk, vector, axis=0) + 2.0 * np.cross(gain, first, axis=0) + np.cross(speed, second, axis=0)
    return first, second, third


def screws_of(robot: Robot) -> Screws:
    """Return the robot's screws, read when they are first asked for; robots with equal kinematics share them."""
    return _known.get(robot.kinematic_content, lambda: Screws.of(robot))


def _with_z(axis: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose third column is `axis`."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(axis, x), axis]).T


_known: LastUsed[Screws] = LastUsed(MOST_BYTES, bytes_of_arrays)
