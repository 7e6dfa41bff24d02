"""The costs of joint motions and joint positions, by which ways through them are compared."""

from __future__ import annotations

import numpy as np

from planner.kinematics.options import Preference
from planner.kinematics.screws import screws_of
from planner.kinematics.turns import counted_velocity
from planner.robots import Robot
from planner.spatial import FloatArray

MOTION_PENALTY = 0.01
"""The weight of the times of all joints beside that of the slowest: no joint moves for nothing behind a slower one."""

EXTERNAL_PENALTY = 10.0
"""Weight of the external axes' times with `prefer` = `arm`: a tenth of their second costs a second of the arm."""

PREFERENCE_WEIGHT = 1e3
"""Weight of the preference costs, s: a thousandth of them outweighs a second of the path."""


def joint_times(robot: Robot, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Time (..., joints), s, of every joint at its velocity limit: |dq_j| / v_j.

    Args:
        robot: A joint without a velocity limit counts 1 rad/s or 1 m/s.
        starts: (..., joints).
        ends: (..., joints).
    """
    velocity = robot.limit("velocity")
    return np.abs(ends - starts) / counted_velocity(velocity)


def motion_costs(robot: Robot, starts: FloatArray, ends: FloatArray, prefer: Preference) -> FloatArray:
    """Return the costs of joint motions (...), s: max_j t_j + `MOTION_PENALTY` sum_j t_j, of the `joint_times` t_j.

    With `prefer` = `arm`, `EXTERNAL_PENALTY` sum_j t_j over the external axes is added.

    Args:
        robot: The robot.
        starts: (..., joints).
        ends: (..., joints).
        prefer: The preference.
    """
    times = joint_times(robot, starts, ends)
    costs: FloatArray = times.max(axis=-1) + MOTION_PENALTY * times.sum(axis=-1)
    if prefer == "arm":
        costs += EXTERNAL_PENALTY * times[..., : len(robot.external_axes)].sum(axis=-1)
    return costs


def tilts(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the angles (N,), rad, between the normal of the workpiece's surface and the vertical.

    The normal is the direction from which the tool comes: opposite to its z axis. Welders call the position with the
    normal upright flat (PA in ISO 6947).

    Args:
        robot: A robot with a positioner, whose base frame is the workpiece.
        positions: (N, joints), rad or m.
    """
    screws, count = screws_of(robot), len(robot.positioner)
    # How the world turns, seen from the workpiece:
    standing = screws.of_first(count).poses(positions[:, :count], np.zeros(3))[1]
    normals = -screws.poses(positions, np.zeros(3))[1] @ robot.tool_in_tip.rotation[:, 2]
    ups = standing @ -robot.model.gravity.linear
    angles: FloatArray = np.arctan2(np.linalg.norm(np.cross(normals, ups), axis=1), (normals * ups).sum(axis=1))
    return angles
