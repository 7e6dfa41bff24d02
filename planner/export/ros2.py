"""ROS 2: a trajectory_msgs/JointTrajectory message as JSON, field by field."""

from __future__ import annotations

from typing import Any

import orjson

from planner.export.base import ExportOptions, Format, refuse_actions
from planner.plans.result import Plan
from planner.samples import Samples

NANOSECONDS = 1_000_000_000
"""Number of nanoseconds in a second."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as the message: header, joint_names, points of positions, velocities, accelerations, effort, time.

    Efforts are the torques when these are included. `frame_id` is empty and `stamp` 0: start at once.

    Raises:
        UnsupportedFormat: The plan has actions.
    """
    refuse_actions(plan, "JointTrajectory")
    samples = plan.samples(options.sample_period, options.include)
    return orjson.dumps(joint_trajectory(plan, samples))


def joint_trajectory(plan: Plan, samples: Samples) -> dict[str, Any]:
    """Return the message as plain values."""
    efforts = [[]] * len(samples.time) if samples.torque is None else samples.torque.tolist()
    rows = (values.tolist() for values in (samples.position, samples.velocity, samples.acceleration))
    points = [
        {
            "positions": position,
            "velocities": velocity,
            "accelerations": acceleration,
            "effort": effort,
            "time_from_start": time_of(time),
        }
        for time, position, velocity, acceleration, effort in zip(nanoseconds(samples), *rows, efforts, strict=True)
    ]
    return {"header": header(0), "joint_names": list(plan.path.robot.joint_names), "points": points}


def nanoseconds(samples: Samples) -> list[int]:
    """Return the times of samples, ns: rounded once, no two points share a time, and the last is the duration."""
    return [round(time * NANOSECONDS) for time in samples.time.tolist()]


def header(time: int, frame: str = "") -> dict[str, Any]:
    """Return the header of a message at a time, ns, about a frame."""
    return {"stamp": time_of(time), "frame_id": frame}


def time_of(time: int) -> dict[str, int]:
    """Return a time, ns, as messages have it."""
    return {"sec": time // NANOSECONDS, "nanosec": time % NANOSECONDS}


FORMAT = Format("ros2", "application/vnd.ros2.joint-trajectory+json", ".ros2.json", render)
"""The form of ROS 2's message `trajectory_msgs/JointTrajectory`, as JSON."""
