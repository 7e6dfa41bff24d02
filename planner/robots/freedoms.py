"""A robot with the freedoms of its goal as joints behind the tool: their positions say where in its region that is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.robots.description import Joint
from planner.spatial import rotation_with_z_along

if TYPE_CHECKING:
    from planner.robots.robot import Robot

GOAL_FRAME = "goal"
"""Name of the link behind the freedoms, which is to have the pose that is asked."""


def with_freedoms(robot: Robot, ranges: dict[str, tuple[float, float]]) -> Robot:
    """Return a robot whose last joints are freedoms of a pose, each within its range.

    Where the tool is at T D, D the offset of `planner.problems.regions.Region`, this robot's tip frame is at
    T = (T D) D^-1: a freedom is a joint along or about the negative axis, the last one of D the first behind the tool.

    Args:
        robot: The robot, with its tool.
        ranges: Lower and upper ends, m or rad, by the names of the freedoms in the order of `Region`.
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
    freedoms = tuple(_joint(name, *ends) for name, ends in reversed(ranges.items()))
    return replace(robot, model=model, joints=robot.joints + freedoms, tip_frame=GOAL_FRAME, named_positions={})


def _joint(name: str, lower: float, upper: float) -> Joint:
    if not name.startswith("rotation"):
        return Joint(f"{GOAL_FRAME}_{name}", "prismatic", lower, upper)
    if upper - lower >= 2.0 * np.pi:
        return Joint(f"{GOAL_FRAME}_{name}", "continuous")
    return Joint(f"{GOAL_FRAME}_{name}", "revolute", lower, upper)
