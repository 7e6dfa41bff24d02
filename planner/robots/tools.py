"""Robots for part of a motion: with another tool, or with the tolerance region of the goal as joints behind it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from planner.robots.description import Joint
from planner.robots.robot import Robot
from planner.spatial import FloatArray, Pose, rotation_with_z_along

TOOL_DIGITS = 12
"""Decimals of the position (m) and the rotation of tools that are compared: what differs further behind is one tool."""


def with_tools(robot: Robot, tools: Iterable[Pose | None]) -> tuple[Robot, ...]:
    """Return the robot with each tool in turn; equal tools make one object.

    Args:
        robot: With the tool that it has at first.
        tools: Tool centre points in the tip frame; None: the tool before stays.
    """
    made: dict[bytes, Robot] = {}
    found = []
    for tool in tools:
        if tool is not None:
            own = robot.tool_in_tip
            made.setdefault(_rounded(own.translation, own.rotation), robot)
            key = _rounded(tool.position, np.eye(3) if tool.rotation is None else tool.rotation)
            if key not in made:
                made[key] = robot.with_tool(tool)
            robot = made[key]
        found.append(robot)
    return tuple(found)


def _rounded(position: FloatArray, rotation: FloatArray) -> bytes:
    """Return bytes that are equal for placements that differ only by rounding."""
    return (np.round(np.column_stack([position, rotation]), TOOL_DIGITS) + 0.0).tobytes()


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
