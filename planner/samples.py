"""Samples of a trajectory: what joints and tool do at a row of times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics import quaternion, tool_accelerations, tool_velocities
from planner.kinematics.forward import tool_poses_on
from planner.spatial import rpy_from_rotations

if TYPE_CHECKING:
    from collections.abc import Collection

    from planner.dynamics import SegmentDynamics
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Samples:
    """A trajectory at regular times; rows are time.

    Attributes:
        time: (N,), s; from 0, strictly increasing, the last exactly the duration.
        position: (N, joints).
        velocity: (N, joints).
        acceleration: (N, joints).
        segment: (N,), the waypoint segment that each row lies on.
        jerk: (N, joints), when asked.
        torque: (N, joints), when asked.
        tcp_position: (N, 3), m, when asked.
        tcp_quaternion: (N, 4), x, y, z, w, when asked.
        tcp_rpy: (N, 3), roll, pitch, yaw as `rpy_from_rotations` has them, rad, when asked.
        tcp_velocity: Linear (N, 3), m/s, and angular (N, 3), rad/s, in the base's axes, when asked.
        tcp_acceleration: Linear (N, 3), m/s^2, and angular (N, 3), rad/s^2, in the base's axes, when asked.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    segment: np.ndarray
    jerk: FloatArray | None
    torque: FloatArray | None
    tcp_position: FloatArray | None
    tcp_quaternion: FloatArray | None
    tcp_rpy: FloatArray | None
    tcp_velocity: tuple[FloatArray, FloatArray] | None
    tcp_acceleration: tuple[FloatArray, FloatArray] | None


def sample_at(
    dynamics: SegmentDynamics, trajectory: Trajectory, time: FloatArray, include: Collection[str] = ()
) -> Samples:
    """Evaluate a trajectory at times (N,), s.

    Args:
        dynamics: The robot, with its tools and payloads.
        trajectory: A trajectory of its joints.
        time: (N,), s, strictly increasing.
        include: Columns that are computed besides, by the names that `planner.export` has for them.

    Raises:
        MissingDynamics: Torques are asked of a robot without inertias and payload.
    """
    orders = 4 if "jerk" in include else 3
    derivatives = trajectory.evaluate(time, range(orders))
    position, velocity, acceleration = derivatives[:3]
    segment = trajectory.segments[trajectory.locate(time)[0]]
    torque = tcp_position = tcp_quaternion = tcp_rpy = tcp_velocity = tcp_acceleration = None
    if "torque" in include:
        torque = dynamics.torques(segment, position, velocity, acceleration)
    if "tcp_pose" in include:
        points, rotations = tool_poses_on(dynamics, segment, position)
        tcp_position = np.ascontiguousarray(points)
        tcp_quaternion = np.array([quaternion(rotation) for rotation in rotations])
    if "tcp_rpy" in include:
        tcp_rpy = rpy_from_rotations(tool_poses_on(dynamics, segment, position)[1])
    if "tcp_velocity" in include:
        linear, angular = dynamics.by_robot(tool_velocities, segment, position, velocity)
        tcp_velocity = linear, angular
    if "tcp_acceleration" in include:
        linear, angular = dynamics.by_robot(tool_accelerations, segment, position, velocity, acceleration)
        tcp_acceleration = linear, angular
    return Samples(
        time=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        segment=segment,
        jerk=derivatives[3] if orders == 4 else None,
        torque=torque,
        tcp_position=tcp_position,
        tcp_quaternion=tcp_quaternion,
        tcp_rpy=tcp_rpy,
        tcp_velocity=tcp_velocity,
        tcp_acceleration=tcp_acceleration,
    )
