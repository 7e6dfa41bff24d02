"""ROS 2: a trajectory_msgs/JointTrajectory message as JSON, field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING

import orjson

from planner.export.base import ExportOptions, Format, refuse_actions

if TYPE_CHECKING:
    from planner.plans.result import Plan

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
    efforts = [[]] * len(samples.time) if samples.torque is None else samples.torque.tolist()
    # Rounded once, so that two points never share a time and the last is the duration to the nanosecond.
    nanoseconds = [round(t * NANOSECONDS) for t in samples.time.tolist()]
    points = [
        {
            "positions": position,
            "velocities": velocity,
            "accelerations": acceleration,
            "effort": effort,
            "time_from_start": {"sec": ns // NANOSECONDS, "nanosec": ns % NANOSECONDS},
        }
        for position, velocity, acceleration, effort, ns in zip(
            samples.position.tolist(),
            samples.velocity.tolist(),
            samples.acceleration.tolist(),
            efforts,
            nanoseconds,
            strict=True,
        )
    ]
    message = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": plan.path.robot.joint_names,
        "points": points,
    }
    return orjson.dumps(message)


FORMAT = Format("ros2", "application/vnd.ros2.joint-trajectory+json", ".ros2.json", render)
"""The form of ROS 2's message `trajectory_msgs/JointTrajectory`, as JSON."""
