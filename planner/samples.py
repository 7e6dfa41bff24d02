"""Samples of a trajectory: the states of joints and tool at a list of times."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.dynamics import SegmentDynamics
from planner.kinematics import quaternion, tool_accelerations, tool_velocities
from planner.kinematics.forward import tool_poses_on
from planner.spatial import FloatArray, rpy_from_rotations
from planner.trajectories.reversals import directions, towards
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
        jerk: (N, joints), on request.
        torque: (N, joints), on request.
        tcp_position: (N, 3), m, on request.
        tcp_quaternion: (N, 4), x, y, z, w, on request.
        tcp_rpy: (N, 3), roll, pitch, yaw as `rpy_from_rotations` has them, rad, on request.
        tcp_velocity: Linear (N, 3), m/s, and angular (N, 3), rad/s, in the base's axes, on request.
        tcp_acceleration: Linear (N, 3), m/s^2, and angular (N, 3), rad/s^2, in the base's axes, on request.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    segment: np.ndarray
    jerk: FloatArray | None = None
    torque: FloatArray | None = None
    tcp_position: FloatArray | None = None
    tcp_quaternion: FloatArray | None = None
    tcp_rpy: FloatArray | None = None
    tcp_velocity: tuple[FloatArray, FloatArray] | None = None
    tcp_acceleration: tuple[FloatArray, FloatArray] | None = None


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
        MissingDynamics: Torques are requested of a robot without inertias and payload.
    """
    derivatives = trajectory.evaluate(time, range(4 if "jerk" in include else 3))
    position, velocity, acceleration = derivatives[:3]
    segment = trajectory.segments[trajectory.locate(time)[0]]
    more: dict[str, Any] = {}
    if "jerk" in include:
        more["jerk"] = derivatives[3]
    if "torque" in include:
        more["torque"] = dynamics.torques(
            segment, position, _moving(dynamics, trajectory, time, velocity), acceleration
        )
    if "tcp_pose" in include:
        points, rotations = tool_poses_on(dynamics, segment, position)
        more["tcp_position"] = np.ascontiguousarray(points)
        more["tcp_quaternion"] = np.array([quaternion(rotation) for rotation in rotations])
    if "tcp_rpy" in include:
        more["tcp_rpy"] = rpy_from_rotations(tool_poses_on(dynamics, segment, position)[1])
    if "tcp_velocity" in include:
        more["tcp_velocity"] = dynamics.by_robot(tool_velocities, segment, position, velocity)
    if "tcp_acceleration" in include:
        more["tcp_acceleration"] = dynamics.by_robot(tool_accelerations, segment, position, velocity, acceleration)
    return Samples(time, position, velocity, acceleration, segment, **more)


def _moving(dynamics: SegmentDynamics, trajectory: Trajectory, time: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return velocities (N, joints) with the direction of the motion where a joint starts, stops or reverses.

    There its Coulomb friction is that of the moving joint.
    """
    if dynamics.robots[0].friction is None:
        return velocity
    pieces, _ = trajectory.locate(time)
    return towards(directions(trajectory)[pieces], velocity)
