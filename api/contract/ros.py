"""A trajectory as a message of ROS 2, written as JSON."""

from __future__ import annotations

from api.contract.parts.common import Answer


class RosTime(Answer):
    """A `builtin_interfaces/Time` or `Duration` of ROS 2."""

    sec: int
    """The whole seconds, s."""
    nanosec: int
    """The rest, 1e-9 s."""


class RosHeader(Answer):
    """A `std_msgs/Header` of ROS 2."""

    stamp: RosTime
    """When to start; 0: at once."""
    frame_id: str
    """Empty: joint positions need no frame."""


class RosPoint(Answer):
    """A `trajectory_msgs/JointTrajectoryPoint` of ROS 2."""

    positions: list[float]
    """The joint positions, one value a joint, rad or m."""
    velocities: list[float]
    """The joint velocities, one value a joint, rad/s or m/s."""
    accelerations: list[float]
    """The joint accelerations, one value a joint, rad/s^2 or m/s^2."""
    effort: list[float]
    """The joint torques, one value a joint, N m or N; empty unless `torque` is included."""
    time_from_start: RosTime
    """When the robot is there, from the start of the trajectory."""


class RosJointTrajectory(Answer):
    """A `trajectory_msgs/JointTrajectory` of ROS 2."""

    header: RosHeader
    """When to start."""
    joint_names: list[str]
    """The names of the joints in the order of the values of each point."""
    points: list[RosPoint]
    """The trajectory, sampled every `sample_period`."""
