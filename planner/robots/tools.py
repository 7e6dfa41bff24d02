"""A robot that changes its tool on its way."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner.robots.robot import Robot
from planner.spatial import FloatArray, Pose

TOOL_DIGITS = 12
"""Decimals of the position (m) and the rotation of tools that are compared: what differs further behind is one tool."""


def with_tools(robot: Robot, tools: Iterable[Pose | None]) -> tuple[Robot, ...]:
    """Return the robot with each tool in turn; equal tools make one object.

    Args:
        robot: With the tool that it has at first.
        tools: Tool centre points in the tip frame; None: the tool before stays.
    """
    own = robot.tool_in_tip
    made = {_rounded(own.translation, own.rotation): robot}
    found = []
    for tool in tools:
        if tool is not None:
            key = _rounded(tool.position, np.eye(3) if tool.rotation is None else tool.rotation)
            if key not in made:
                made[key] = robot.with_tool(tool)
            robot = made[key]
        found.append(robot)
    return tuple(found)


def _rounded(position: FloatArray, rotation: FloatArray) -> bytes:
    """Return bytes that are equal for placements that differ only by rounding."""
    return (np.round(np.column_stack([position, rotation]), TOOL_DIGITS) + 0.0).tobytes()
