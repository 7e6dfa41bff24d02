"""Robots with the tolerance region of their goal as joints behind the tool."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from planner.robots.description import Joint
from planner.robots.robot import Robot
from planner.spatial import rotation_with_z_along

GOAL_FRAME = "goal"
"""Name of the link behind the joints of the region, whose pose must be the requested pose."""


def with_region_joints(robot: Robot, ranges: dict[str, tuple[float, float]]) -> Robot:
    """Return a robot whose last joints are the coordinates of a tolerance region, each within its range.

    With the tool at T D, D the offset of `planner.problems.regions.Region`, this robot's tip frame is at T = (T D)
    D^-1. So each coordinate is a joint along or about the negative axis. The last factor of D is the first joint behind
    the tool.

    Args:
        robot: The robot, with its tool.
        ranges: Lower and upper ends, m or rad, by the names of the coordinates, in the order of `Region`.
    """
    model = robot.model.copy()
    tool = model.frames[robot.tool_frame_id]
    parent, placement = tool.parentJoint, tool.placement
    for name in reversed(ranges):
        axis = pin.SE3(rotation_with_z_along(-np.eye(3)["xyz".index(name[-1])]), np.zeros(3))
        joint = pin.JointModelRZ() if name.startswith("rotation") else pin.JointModelPZ()
        parent = model.addJoint(parent, joint, placement * axis, f"{GOAL_FRAME}_{name}")
        placement = axis.inverse()
    model.addFrame(pin.Frame(GOAL_FRAME, parent, 0, placement, pin.FrameType.BODY))
    if robot.tool_frame_id != robot.tip_frame_id:
        model.frames[robot.tool_frame_id].parentJoint = parent
        model.frames[robot.tool_frame_id].placement = placement
    region_joints = tuple(_joint(name, *ends) for name, ends in reversed(ranges.items()))
    return replace(robot, model=model, joints=robot.joints + region_joints, tip_frame=GOAL_FRAME, named_positions={})


def _joint(name: str, lower: float, upper: float) -> Joint:
    if not name.startswith("rotation"):
        return Joint(f"{GOAL_FRAME}_{name}", "prismatic", lower, upper)
    if upper - lower >= 2.0 * np.pi:
        return Joint(f"{GOAL_FRAME}_{name}", "continuous")
    return Joint(f"{GOAL_FRAME}_{name}", "revolute", lower, upper)
