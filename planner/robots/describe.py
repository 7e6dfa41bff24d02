"""A robot in plain words and numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from planner.robots.description import RANGED_QUANTITIES
from planner.spatial import quaternion

if TYPE_CHECKING:
    from planner.robots.description import Joint
    from planner.robots.robot import Robot
    from planner.spatial import FloatArray


def describe(robot: Robot) -> dict[str, Any]:
    """Return the robot as a dictionary of plain values; None where there is no limit. SI units."""
    mounting, tool = robot.mounting, robot.tool_in_tip
    return {
        "id": robot.id,
        "source": robot.source,
        "notes": list(robot.notes),
        "dof": robot.dof,
        "joint_names": list(robot.joint_names),
        "joints": [_describe_joint(joint) for joint in robot.joints],
        "limit_sources": dict(robot.limit_sources),
        "tip_frame": robot.tip_frame,
        "chain": _describe_chain(robot),
        "placements": [
            _describe_pose(frame.placement.translation, frame.placement.rotation)
            | {"frame": frame.name, "after": frame.parentJoint}
            for frame in robot.model.frames
            if frame.type != pin.FrameType.FIXED_JOINT
        ],
        "frames": [frame.name for frame in robot.model.frames if frame.type != pin.FrameType.FIXED_JOINT],
        "tool": _describe_pose(tool.translation, tool.rotation),
        "mounting": None
        if mounting is None
        else _describe_pose(mounting.position, np.eye(3) if mounting.rotation is None else mounting.rotation),
        "external_axes": list(robot.external_axes),
        "named_positions": {name: list(position) for name, position in robot.named_positions.items()},
        "mass": robot.mass,
        "rated_payload": robot.rated_payload,
        "rated_payload_source": robot.rated_payload_source,
        "geometry": [dict(shape) for shape in robot.geometry],
        "groups": [dict(vars(group)) for group in robot.groups],
        "disabled_collisions": [dict(vars(pair)) for pair in robot.disabled_collisions],
    }


def _describe_pose(position: FloatArray, rotation: FloatArray) -> dict[str, list[float]]:
    return {"position": position.tolist(), "quaternion_xyzw": quaternion(rotation).tolist()}


def _describe_chain(robot: Robot) -> list[dict[str, Any]]:
    """Return where each joint stands in the one before, and its axis, which is its column of its own Jacobian."""
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, np.zeros(model.nq))
    jacobians = [pin.getJointJacobian(model, data, i + 1, pin.LOCAL) for i in range(model.nv)]
    columns = [jacobian.reshape(6, model.nv)[:, i] for i, jacobian in enumerate(jacobians)]  # one column comes flat
    return [
        _describe_pose(placement.translation, placement.rotation)
        | {"axis": (column[:3] if joint.kind == "prismatic" else column[3:]).tolist()}
        for joint, placement, column in zip(robot.joints, list(model.jointPlacements)[1:], columns, strict=True)
    ]


def _describe_joint(joint: Joint) -> dict[str, Any]:
    limits = {
        name: value if math.isfinite(value := float(getattr(joint, name))) else None
        for name in ("lower", "upper", "velocity", "acceleration", "jerk", "torque")
    }
    ranges = {
        f"{quantity}_range": list(joint.ranges[quantity]) if quantity in joint.ranges else None
        for quantity in RANGED_QUANTITIES
    }
    return {"name": joint.name, "kind": joint.kind, **limits, **ranges, "provenance": dict(joint.provenance)}
