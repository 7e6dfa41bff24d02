"""A robot's kinematics alone, for peers and for requests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.spatial import FloatArray


def joints_of(robot: Robot) -> list[tuple[Any, FloatArray, pin.SE3]]:
    """List every joint with its axis in its own frame and its placement in the frame before."""
    model, data = robot.model, robot.data
    pin.computeJointJacobians(model, data, np.zeros(robot.dof))
    joints = []
    for i, joint in enumerate(robot.joints):
        twist = pin.getJointJacobian(model, data, i + 1, pin.ReferenceFrame.LOCAL)[:, i]
        joints.append((joint, twist[3:] if joint.is_angle else twist[:3], model.jointPlacements[i + 1]))
    return joints


def plain_urdf(robot: Robot, *, clipped: bool = True) -> str:
    """Write the robot's kinematics and limits, no further than half a turn if clipped, for a peer that reads files."""
    last = robot.dof
    parts = [f'<link name="link_{i}"/>' for i in range(last + 1)] + ['<link name="tool"/>']
    for i, (joint, axis, placement) in enumerate(joints_of(robot)):
        kind = "revolute" if joint.is_angle else "prismatic"
        lower, upper = np.clip([joint.lower, joint.upper], *((-np.pi, np.pi) if clipped else (-np.inf, np.inf)))
        parts.append(
            f'<joint name="joint_{i + 1}" type="{kind}"><parent link="link_{i}"/><child link="link_{i + 1}"/>'
            f'{origin(placement)}<axis xyz="{_numbers(axis)}"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint>'
        )
    placement = robot.model.frames[robot.tool_frame_id].placement
    parts.append(
        f'<joint name="to_tool" type="fixed"><parent link="link_{last}"/><child link="tool"/>'
        f"{origin(placement)}</joint>"
    )
    return f'<robot name="{robot.id}">{"".join(parts)}</robot>'


def origin(placement: pin.SE3) -> str:
    """Write a placement."""
    rpy = pin.rpy.matrixToRpy(placement.rotation)
    return f'<origin xyz="{_numbers(placement.translation)}" rpy="{_numbers(rpy)}"/>'


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)
