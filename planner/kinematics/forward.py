"""Forward kinematics: poses and Jacobians of the tool at joint positions, and how it moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple, overload

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from planner.dynamics import SegmentDynamics
from planner.kinematics.screws import screws_of
from planner.robots import Robot
from planner.spatial import FloatArray, Pose

AT_REST = 1e-9
"""Speed of the tool, m/s, up to which its path has no direction that an acceleration could be across."""

TIGHTEST_BEND = 1e-4
"""Least radius, m, of a bend of the tool's path for the limit on centripetal acceleration.

It is the accuracy of lines and circles. A tighter bend, almost at rest, is too short for any sample, and the tool
hardly moves.
"""

VELOCITIES = ("tcp_linear_velocity", "tcp_angular_velocity")
"""The quantities that are velocities of the tool, the linear one first."""

ACCELERATIONS = ("tcp_linear_acceleration", "tcp_angular_acceleration")
"""The quantities that are accelerations of the tool, the linear one first."""

JERKS = ("tcp_linear_jerk", "tcp_angular_jerk")
"""The quantities that are jerks of the tool, the linear one first."""

CENTRIPETAL = "tcp_centripetal_acceleration"
"""The quantity that is the acceleration of the tool across its path."""

OF_BENDS = (VELOCITIES[0], ACCELERATIONS[0])
"""The quantities that bound the centripetal acceleration between samples."""

OF_PATH_SPEED = (*VELOCITIES, CENTRIPETAL)
"""The quantities that follow from the speed along a path alone."""

LEAST_MANIPULABILITY = 1e-12
"""Manipulability, in its own unit, below which a joint position counts as singular."""


@overload
def forward_kinematics(robot: Robot, positions: Sequence[float]) -> Pose: ...
@overload
def forward_kinematics(robot: Robot, positions: Sequence[Sequence[float]]) -> list[Pose]: ...
@overload
def forward_kinematics(robot: Robot, positions: ArrayLike) -> Any: ...
def forward_kinematics(robot: Robot, positions: ArrayLike) -> Pose | list[Pose]:
    """Compute the pose of the tool at one joint position or at many.

    Args:
        robot: The robot, with its tool.
        positions: One joint position (joints,), or N of them (N, joints), rad or m.

    Returns:
        The pose of the tool in the base frame, or N of them.

    Raises:
        ValueError: The array has another shape.
    """
    rows = np.asarray(positions, dtype=np.float64)
    if rows.ndim not in (1, 2) or (rows.size and rows.shape[-1] != robot.dof):
        raise ValueError(f"`positions` must have shape ({robot.dof},) or (N, {robot.dof}); got {rows.shape}")
    return tool_pose(robot, rows) if rows.ndim == 1 and rows.size else [tool_pose(robot, q) for q in rows]


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


def frame_poses(robot: Robot, position: ArrayLike) -> dict[str, Pose]:
    """Compute where all frames of a robot are at one joint position: its links, flange and tool.

    Args:
        robot: The robot, with its tool.
        position: (joints,), rad or m.

    Returns:
        The poses in the base frame, by the names of the frames, from the base to the tip. The frame of a link of a
        Denavit-Hartenberg table is the table's; the products of its A matrices are these poses.

    Raises:
        ValueError: The position has another shape.
    """
    q = np.asarray(position, dtype=np.float64)
    if q.shape != (robot.dof,):
        raise ValueError(f"`position` must have shape ({robot.dof},); got {q.shape}")
    pin.framesForwardKinematics(robot.model, robot.data, q)
    placements = zip(robot.model.frames, robot.data.oMf, strict=True)
    return {
        frame.name: Pose(placement.translation.copy(), placement.rotation.copy())
        for frame, placement in placements
        if frame.type != pin.FrameType.FIXED_JOINT
    }


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
    return screws_of(robot).reach(positions, robot.tool_in_tip.translation)[2][:, : 3 if robot.is_position_only else 6]


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
    return screws_of(robot).rates(robot.tool_in_tip.translation, q, v)


def tool_accelerations(
    robot: Robot, positions: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Compute the accelerations of the tool at many states of the joints.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.
        accelerations: (N, joints), rad/s^2 or m/s^2.

    Returns:
        The derivatives by time of the linear velocity (N, 3), m/s^2, of the tool's origin, and of its angular velocity
        (N, 3), rad/s^2. Both are in the base's axes, without gravity.
    """
    q, v, a = (np.asarray(values, dtype=np.float64) for values in (positions, velocities, accelerations))
    return screws_of(robot).rates(robot.tool_in_tip.translation, q, v, a)


def tool_jerks(
    robot: Robot, positions: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike, jerks: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Compute the jerks of the tool at many states of the joints.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.
        accelerations: (N, joints), rad/s^2 or m/s^2.
        jerks: (N, joints), rad/s^3 or m/s^3.

    Returns:
        The second derivatives by time of the linear velocity (N, 3), m/s^3, of the tool's origin, and of its angular
        velocity (N, 3), rad/s^3. Both are in the base's axes.
    """
    states = (positions, velocities, accelerations, jerks)
    q, v, a, j = (np.asarray(values, dtype=np.float64) for values in states)
    return screws_of(robot).rates(robot.tool_in_tip.translation, q, v, a, j)


def tool_speeds(robot: Robot, positions: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute how fast the tool moves at many states in a few array operations.

    Args:
        robot: The robot, with its tool.
        positions: (N, joints), rad or m.
        velocities: (N, joints), rad/s or m/s.

    Returns:
        The linear (m/s) and the angular (rad/s) speed (N,) of the tool.
    """
    linear, angular = screws_of(robot).rates(robot.tool_in_tip.translation, positions, velocities)
    return np.sqrt((linear * linear).sum(axis=1)), np.sqrt((angular * angular).sum(axis=1))


class JointStates:
    """States of the joints, and the motion of the tool in them, computed once it is used.

    The derivatives may also be derivatives of a path q(s) by s: then s' is 1 and s'' is 0.

    Attributes:
        robot: The robot, with its tool.
        q: Positions (N, joints), rad or m.
        v: Velocities (N, joints).
        a: Accelerations (N, joints).
        j: Jerks (N, joints); None: they are not known.
    """

    def __init__(self, robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray | None = None) -> None:
        self.robot, self.q, self.v, self.a, self.j = robot, q, v, a, j
        self._screws, self._point = screws_of(robot), robot.tool_in_tip.translation

    @cached_property
    def _velocities(self) -> tuple[FloatArray, FloatArray]:
        return self._screws.rates(self._point, self.q, self.v)

    @cached_property
    def _accelerations(self) -> tuple[FloatArray, FloatArray]:
        return self._screws.rates(self._point, self.q, self.v, self.a)

    @cached_property
    def _jerks(self) -> tuple[FloatArray, FloatArray]:
        assert self.j is not None  # noqa: S101 - jerks of the tool are asked only where those of the joints are known
        return self._screws.rates(self._point, self.q, self.v, self.a, self.j)

    @cached_property
    def tool_on_path(self) -> tuple[AccelerationOnPath, AccelerationOnPath]:
        """The linear and the angular acceleration of the tool along a path."""
        pairs = zip(self._velocities, self._accelerations, strict=True)
        linear, angular = (_along_and_across(velocity, acceleration) for velocity, acceleration in pairs)
        return linear, angular

    def tool_rate(self, quantity: str) -> FloatArray:
        """Return the magnitudes (N,) of one of `TCP_ORDERS`, m and rad by powers of s.

        The centripetal acceleration is the acceleration of the tool centre point across its path, |v x a| / |v|. It is
        at most v^2 divided by the radius `TIGHTEST_BEND`.
        """
        if quantity == CENTRIPETAL:
            on_path = self.tool_on_path[0]
            return np.minimum(on_path.across, on_path.speed**2 / TIGHTEST_BEND)
        for names, of in ((VELOCITIES, "_velocities"), (ACCELERATIONS, "_accelerations"), (JERKS, "_jerks")):
            if quantity in names:
                return _norms(getattr(self, of)[names.index(quantity)])
        raise KeyError(quantity)


def tool_poses_on(
    dynamics: SegmentDynamics, segments: np.ndarray, positions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute the positions (N, 3), m, and rotations (N, 3, 3) of the tool in the base frame.

    Args:
        dynamics: The robot on each segment.
        segments: (N,), index of the segment of each state.
        positions: (N, joints), rad or m.
    """
    points, rotations = dynamics.by_robot(tool_poses, segments, positions)
    return points, rotations


def bend_bounds(rates: Mapping[str, FloatArray], limits: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return what bounds the acceleration of the tool across its path between samples (N, 3), as `sampled_peaks` asks.

    Args:
        rates: Magnitudes (N,) of the tool's linear velocity and acceleration, m/s and m/s^2.
        limits: Limits (N,) of the acceleration across the path, m/s^2.
        lengths: Units of time (N,) of the samples' pieces, s.
    """
    gain, fastest = rates[ACCELERATIONS[0]], np.sqrt(limits * TIGHTEST_BEND)
    return np.stack([rates[VELOCITIES[0]] / fastest, gain / limits, gain * lengths / fastest], axis=1)


class AccelerationOnPath(NamedTuple):
    """The acceleration of the tool by a motion along a path: (speed s'' + along s'^2, across s'^2), both in one plane.

    Attributes:
        speed: (N,), of the tool by that of the path.
        along: (N,), the part in the direction of the path of the derivative of its velocity by the path position.
        across: (N,), the other part; it is not negative.
    """

    speed: FloatArray
    along: FloatArray
    across: FloatArray


def _along_and_across(velocity: FloatArray, acceleration: FloatArray) -> AccelerationOnPath:
    """Split accelerations (N, 3) by the direction of velocities (N, 3); without one all of it is along."""
    speed, size = _norms(velocity), _norms(acceleration)
    moving = speed > AT_REST
    direction = np.divide(velocity, speed[:, None], out=np.zeros_like(velocity), where=moving[:, None])
    along = np.einsum("ij,ij->i", acceleration, direction)
    across = _norms(acceleration - along[:, None] * direction)
    return AccelerationOnPath(speed, np.where(moving, along, size), np.where(moving, across, 0.0))


def _norms(vectors: FloatArray) -> FloatArray:
    norms: FloatArray = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return norms
