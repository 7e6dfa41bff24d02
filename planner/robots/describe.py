"""A robot in plain words and numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pinocchio as pin

if TYPE_CHECKING:
    from planner.robots.description import Joint
    from planner.robots.robot import Robot


def describe(robot: Robot) -> dict[str, Any]:
    """The robot as a dictionary of plain values; None where there is no limit. SI units."""
    return {
        "id": robot.id,
        "source": robot.source,
        "dof": robot.dof,
        "joint_names": list(robot.joint_names),
        "joints": [_describe_joint(joint) for joint in robot.joints],
        "limit_sources": dict(robot.limit_sources),
        "tip_frame": robot.tip_frame,
        "frames": [frame.name for frame in robot.model.frames if frame.type != pin.FrameType.FIXED_JOINT],
        "mass": robot.mass,
        "geometry": [dict(shape) for shape in robot.geometry],
        "groups": [dict(vars(group)) for group in robot.groups],
        "disabled_collisions": [dict(vars(pair)) for pair in robot.disabled_collisions],
    }


def _describe_joint(joint: Joint) -> dict[str, Any]:
    limits = {
        name: value if math.isfinite(value := float(getattr(joint, name))) else None
        for name in ("lower", "upper", "velocity", "acceleration", "jerk", "torque")
    }
    return {"name": joint.name, "kind": joint.kind, **limits, "provenance": dict(joint.provenance)}
