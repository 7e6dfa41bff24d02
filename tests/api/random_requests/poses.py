"""Poses of requests as placements and back, by SciPy's rotations, and poses of the tool by Pinocchio's kinematics."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from planner.robots import Robot

NOTATIONS = ("quaternion", "rpy", "matrix")


def placement(pose: dict[str, Any] | None) -> pin.SE3:
    """Return the placement of a requested pose; without an orientation it is not rotated."""
    if pose is None:
        return pin.SE3.Identity()
    turn = pose.get("orientation")
    match turn and turn["kind"]:
        case "quaternion":
            rotation = Rotation.from_quat(turn["xyzw"]).as_matrix()
        case "rpy":
            rotation = Rotation.from_euler("xyz", turn["rpy"]).as_matrix()
        case "matrix":
            rotation = Rotation.from_matrix(turn["matrix"]).as_matrix()
        case _:
            rotation = np.eye(3)
    return pin.SE3(rotation, np.array(pose["position"]))


def written(where: pin.SE3, notation: str | None) -> dict[str, Any]:
    """Return a placement as a requested pose; without a notation, only its position."""
    turn = Rotation.from_matrix(where.rotation)
    orientation: dict[str, Any] | None
    match notation:
        case "quaternion":
            orientation = {"kind": notation, "xyzw": turn.as_quat().tolist()}
        case "rpy":
            orientation = {"kind": notation, "rpy": angles_of(turn, "xyz")}
        case "matrix":
            orientation = {"kind": notation, "matrix": turn.as_matrix().tolist()}
        case _:
            orientation = None
    return {"position": where.translation.tolist(), "orientation": orientation}


def angles_of(turn: Rotation, axes: str) -> list[float]:
    """Return angles of a rotation about axes, even if they are not unique."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Gimbal lock")
        return list(turn.as_euler(axes).tolist())


def tool_at(robot: Robot, position: np.ndarray, tool: dict[str, Any] | None) -> pin.SE3:
    """Return the pose of a tool (None: the robot's own) in the base frame at a joint position."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.asarray(position, dtype=float))
    if tool is None:
        return data.oMf[robot.tool_frame_id].copy()
    return data.oMf[robot.tip_frame_id] * placement(tool)


def base_of(robot: Robot, request: dict[str, Any]) -> pin.SE3:
    """Return the pose of the base in the world."""
    if request.get("mounting"):
        return placement(request["mounting"])
    here = robot.mounting
    if here is None:
        return pin.SE3.Identity()
    return pin.SE3(np.eye(3) if here.rotation is None else here.rotation, here.position)


def thing_at(robot: Robot, request: dict[str, Any], thing: dict[str, Any], time: float) -> pin.SE3:
    """Return the pose of an object, which may move, in the base frame at a time, s."""
    into = in_base(robot, request, thing.get("frame", "world"))
    where, motion = placement(thing.get("pose")), thing.get("motion") or {"velocity": [0.0, 0.0, 0.0]}
    gone = min(max(time, 0.0), motion.get("end") or np.inf) * np.array(motion["velocity"])
    return into * pin.SE3(where.rotation, where.translation + gone)


def in_base(robot: Robot, request: dict[str, Any], frame: str | None) -> pin.SE3:
    """Return the pose in the base frame of a frame that a request names."""
    if frame in (None, "base"):
        return pin.SE3.Identity()
    world = placement(None if frame == "world" else request["frames"][frame])
    return base_of(robot, request).actInv(world)
