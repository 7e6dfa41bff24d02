"""Models of robots with a tool, a payload and a process force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from planner.kernels.serial_chain import NO_FORCE, SerialChain
from planner.robots.description import RobotDescription
from planner.robots.payload import Payload
from planner.spatial import Pose


def model_with_tool(model: pin.Model, tip_frame: int, pose: Pose, frame: str) -> pin.Model:
    """Return a model with a tool in the place of any other.

    Args:
        model: The model.
        tip_frame: Its id of the tip frame.
        pose: The tool centre point in the tip frame.
        frame: Name of the tool's frame.
    """
    model = model.copy()
    tip = model.frames[tip_frame]
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    placement = tip.placement * pin.SE3(rotation, pose.position)
    if model.existFrame(frame, pin.FrameType.OP_FRAME):  # another tool takes the place of the first
        model.frames[model.getFrameId(frame, pin.FrameType.OP_FRAME)].placement = placement
    else:
        model.addFrame(pin.Frame(frame, tip.parentJoint, tip_frame, placement, pin.FrameType.OP_FRAME))
    return model


def fields_with_payload(robot: RobotDescription, tip_frame: int, payload: Payload) -> dict[str, Any]:
    """Return the fields of a robot that change with a payload on its tip frame, in addition to its own."""
    tip = (model := robot.model.copy()).frames[tip_frame]
    body = pin.Inertia(payload.mass, np.array(payload.center_of_mass), np.diag(payload.inertia))
    model.appendBodyToJoint(tip.parentJoint, body, tip.placement)
    tip.inertia += body
    mass, uncertain = robot.payload_mass + payload.largest_mass, (payload,) * payload.has_tolerances
    return {"model": model, "payload_mass": mass, "uncertain_payloads": robot.uncertain_payloads + uncertain}


def loaded_chain(robot: RobotDescription, tool_frame: int) -> SerialChain:
    """Return the chain of a robot with its drives and process force, for kernels.

    Args:
        robot: The robot.
        tool_frame: The id of the tool's frame in its model.
    """
    force = robot.process_force
    load = NO_FORCE if force is None else force.on_chain(robot.model.frames[tool_frame])
    turns = np.array([joint.is_angle for joint in robot.joints])
    drives = [(joint.rotor_inertia, joint.friction, joint.damping) for joint in robot.joints]
    return SerialChain.of_model(robot.model, turns, load, drives, len(robot.positioner))
