"""The frame that stands still: the base frame, or with a positioner the frame in which it and the arm stand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from planner.robots.description import RobotDescription
from planner.spatial import Pose

FOOT = "positioner_base"
"""Name of the link on which a positioner stands, beside the arm: the arm's own base frame."""

FLIP = pin.SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
"""The half turn about x."""


def foot_in_standing_link(robot: RobotDescription) -> pin.SE3:
    """Return the placement of the frame that stands still in that of the last joint of the positioner.

    Without a positioner, it is the identity: the base frame stands still.
    """
    return _foot(robot.model) if robot.positioner else pin.SE3.Identity()


def _foot(model: pin.Model) -> pin.SE3:
    return model.frames[model.getFrameId(FOOT, pin.FrameType.BODY)].placement


def foot_at_zero(robot: RobotDescription) -> pin.SE3:
    """Return the placement of the frame that stands still in the base frame, with all joints at 0."""
    placement = foot_in_standing_link(robot)
    for before in reversed(robot.model.jointPlacements.tolist()[1 : 1 + len(robot.positioner)]):
        placement = before * placement
    return placement


def keep_standing(robot: RobotDescription, model: pin.Model, held: Mapping[str, float]) -> dict[str, object]:
    """Return the fields of a robot that change because axes of its positioner are fixed; gravity is changed in place.

    Args:
        robot: The robot with all of its axes.
        model: Its model without the fixed joints.
        held: The positions of the fixed joints, rad or m.
    """
    left = tuple(name for name in robot.positioner if name not in held)
    if left == robot.positioner:
        return {}
    turned = _foot(model)
    for before in reversed(model.jointPlacements.tolist()[1 : 1 + len(left)]):
        turned = before * turned
    model.gravity.linear = turned.rotation @ (foot_at_zero(robot).rotation.T @ robot.model.gravity.linear)
    if left:
        return {"positioner": left}
    base = turned.inverse()
    in_world = Pose(base.translation, base.rotation).from_frame(robot.mounting or Pose(np.zeros(3), np.eye(3)))
    return {"positioner": (), "mounting": in_world}


def placement_in_world(robot: RobotDescription, joint: int, placement: Any) -> tuple[int, Any]:
    """Return the joint that carries a model's joint, counted from the standing frame, and a placement there.

    The tree from the standing frame has the joints of the model by the same numbers. A joint of a positioner moves the
    link before it there, with its own frame turned by `FLIP`.

    Args:
        robot: The robot.
        joint: Number of a joint of its model, from 1; 0 is the base frame.
        placement: A placement in the frame of that joint.
    """
    last = len(robot.positioner)
    if joint > last or last == 0:
        return joint, placement
    if joint == last:
        return 0, foot_in_standing_link(robot).actInv(placement)
    return joint + 1, FLIP * robot.model.jointPlacements[joint + 1].actInv(placement)


def tree_joints(robot: RobotDescription) -> tuple[list[int], list[Any]]:
    """Return the joint before each joint of the tree from the standing frame, from 1, and the placements in it."""
    parents, placements = list[int](), list[Any]()
    for joint in range(1, robot.model.njoints):
        is_reversed = joint <= len(robot.positioner)
        before = joint if is_reversed else int(robot.model.parents[joint])
        parent, there = placement_in_world(robot, before, FLIP if is_reversed else robot.model.jointPlacements[joint])
        parents.append(parent)
        placements.append(there)
    return parents, placements
