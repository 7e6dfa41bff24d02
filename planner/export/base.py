"""What a format is, and the samples that most of them write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UnsupportedFormat
from planner.kinematics import quaternion, tool_accelerations, tool_velocities
from planner.kinematics.forward import tool_poses_on
from planner.spatial import rpy_from_rotations

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from planner.dynamics import SegmentDynamics
    from planner.kinematics import FloatArray
    from planner.result import Plan
    from planner.trajectory import Trajectory

INCLUDABLE = (
    "jerk",
    "torque",
    "tcp_pose",
    "tcp_rpy",
    "tcp_velocity",
    "tcp_acceleration",
    "polynomials",
    "tcp_polynomials",
    "sample_checks",
    "tcp_speed_report",
)
"""Names of the parts that an answer carries only when asked."""


@dataclass(frozen=True)
class ExportOptions:
    """The options by which a plan is written.

    Attributes:
        sample_period: Time between samples, s; the last one is at the end.
        include: Parts to be written besides, some of `INCLUDABLE`.
        request_hash: The hash of the request that is quoted in the answer; None: none.
    """

    sample_period: float = 0.01
    include: frozenset[str] = frozenset()
    request_hash: str | None = None


@dataclass(frozen=True)
class Format:
    """One form that a plan can leave in.

    Attributes:
        name: The form's name.
        media_type: The media type of a file of this form.
        suffix: How the name of such a file ends, with the dot.
        render: What writes a plan.
    """

    name: str
    media_type: str
    suffix: str
    render: Callable[[Plan, ExportOptions], bytes]


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


def refuse_actions(plan: Plan, form: str) -> None:
    """Refuse to leave actions out.

    Raises:
        UnsupportedFormat: The plan has actions.
    """
    if plan.problem.actions:
        raise UnsupportedFormat(f"{form} carries no actions; json, msgpack, npz, mcap and programs of robots do")


def sample(plan: Plan, options: ExportOptions) -> Samples:
    """Evaluate a plan's trajectory at multiples of the sample period and at its end.

    Raises:
        MissingDynamics: Torques are asked of a robot without inertias and payload.
    """
    time = plan.trajectory.sample_times(options.sample_period)
    return sample_at(plan.path.dynamics, plan.trajectory, time, options.include)


def sample_at(
    dynamics: SegmentDynamics, trajectory: Trajectory, time: FloatArray, include: Collection[str] = ()
) -> Samples:
    """Evaluate a trajectory at times (N,), s.

    Args:
        dynamics: The robot, with its tools and payloads.
        trajectory: A trajectory of its joints.
        time: (N,), s, strictly increasing.
        include: Columns that are computed besides, some of `INCLUDABLE`.

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
