"""Models of robots with a tool, and with a payload."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

if TYPE_CHECKING:
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


def model_with_payload(model: pin.Model, tip_frame: int, payload: Payload) -> pin.Model:
    """Return a model with a payload on its tip frame in addition to its own."""
    tip = (model := model.copy()).frames[tip_frame]
    body = pin.Inertia(payload.mass, np.array(payload.center_of_mass), np.diag(payload.inertia))
    model.appendBodyToJoint(tip.parentJoint, body, tip.placement)
    tip.inertia += body
    return model
