"""Bounds on the effects of following errors on the tool and on bodies that move with the joints."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from planner.kernels.bounded_peaks import tool_differences
from planner.kinematics.forward import JointStates
from planner.robots import Robot
from planner.spatial import FloatArray

MANY_ROBOTS = 32
"""Number of robots whose levers are kept."""


def levers(robot: Robot, joint: int, reach: float) -> FloatArray:
    """Return the largest distances (joints,) of a body from the axes of the joints that move it, at any position.

    Joints that slide have 1 in place of a distance; joints that do not move the body have 0.

    Args:
        robot: The robot.
        joint: The number of joints that move the body.
        reach: The largest distance of the body from the origin of the last of them, m.
    """
    links, slides = robot.chain.links, ~robot.is_angle
    farthest = np.abs([robot.limit("lower"), robot.limit("upper")]).max(axis=0)
    offsets = np.linalg.norm(links[:, 9:12], axis=1) + np.where(slides, farthest, 0.0)
    away = np.cumsum(np.append(offsets[:joint], reach)[::-1])[::-1][1:]
    found = np.zeros(robot.dof)
    found[:joint] = np.where(slides[:joint], 1.0, away)
    return found


@lru_cache(maxsize=MANY_ROBOTS)
def tool_following(robot: Robot) -> FloatArray | None:
    """Return the numbers (3, joints) of `tool_differences` for a robot; None: it has no following errors."""
    if robot.following_errors is None:
        return None
    frame = robot.model.frames[robot.tool_frame_id]
    of_tool = levers(robot, int(frame.parentJoint), float(np.linalg.norm(frame.placement.translation)))
    return np.stack([robot.following_errors, of_tool, robot.is_angle.astype(np.float64)])


def tool_rate_differences(states: JointStates, quantity: str, order: int) -> FloatArray:
    """Bound the differences (N,) of a quantity of `TCP_ORDERS` between actual and planned positions of the joints."""
    following = tool_following(states.robot)
    if following is None:
        return np.zeros(len(states.q))
    rates = np.stack([part for part in (states.v, states.a, states.j)[:order] if part is not None], axis=1)
    tool_joints = int(states.robot.model.frames[states.robot.tool_frame_id].parentJoint)
    is_angular = "angular" in quantity
    return tool_differences(following, tool_joints, order, is_angular, rates)


def farthest_tool(robot: Robot) -> float:
    """Return the largest distance of the actual tool centre point from the planned one at any time, m."""
    following = tool_following(robot)
    return 0.0 if following is None else float(following[0] @ following[1])
