"""Cells of requests as the library's robots in one scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from api.contract import requests
from api.contract.cells import CellMember
from api.contract.parts import scenes
from api.work.conversion.poses import to_pose
from api.work.conversion.problems import WORLD, to_backend, to_planning_problem
from api.work.conversion.scenes import to_scene
from planner.errors import InvalidProblem
from planner.spatial import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from api.contract.cells import CellRequest
    from planner import FieldPath
    from planner.robots import Robot

OF_A_MEMBER = [name for name in requests.PlanRequest.model_fields if name in CellMember.model_fields]
"""The fields of a robot of a cell that are fields of a plan request."""


def in_request(field: FieldPath) -> FieldPath:
    """Return the field of the request for a field of a robot's plan request in the library's cell."""
    match field:
        case ("robots", _, "frames", *_):
            return field[2:]
        case ("robots", index, "scene", *own):
            return ("robots", index, *own)
    return field


def to_cell(
    request: CellRequest, robots: Sequence[Robot]
) -> tuple[tuple[planner.CellRobot, ...], planner.Scene | None]:
    """Make the robots of a cell, and the scene around all of them.

    Raises:
        InvalidProblem: With the faults of all robots, or of the scene.
    """
    scene = None
    if request.scene is not None:
        frames = {name: to_pose(pose) for name, pose in request.frames.items()}
        scene = to_scene(request.scene, {WORLD: Pose(np.zeros(3)), **frames})
    members, faults = [], []
    for index, (member, robot) in enumerate(zip(request.robots, robots, strict=True)):
        try:
            problem = to_planning_problem(_to_plan_request(request, member), robot)
            members.append(planner.CellRobot(member.name, problem, to_backend(member.backend)))
        except InvalidProblem as refusal:
            faults += [(("robots", index, *fault.field), fault.message) for fault in refusal.faults]
    if faults:
        raise InvalidProblem(faults)
    return tuple(members), scene


def _to_plan_request(request: CellRequest, member: CellMember) -> requests.PlanRequest:
    """Write a robot of a cell as a plan request, whose scene has its attached objects and allowed pairs alone."""
    own = {name: getattr(member, name) for name in OF_A_MEMBER}
    scene = scenes.Scene(attached=member.attached, allowed_pairs=member.allowed_pairs)
    is_empty = request.scene is None and not member.attached and not member.allowed_pairs
    return requests.PlanRequest.model_construct(
        **own, frames=request.frames, scene=None if is_empty else scene, deadline=request.deadline
    )


def rules_of(request: CellRequest) -> dict[str, Any]:
    """Return the further arguments of `plan_cell`."""
    pairs = [(first, second) for first, second in request.allowed_pairs]
    return {"margin": request.margin, "skew": request.skew, "meetings": request.meetings, "allowed_pairs": pairs}
