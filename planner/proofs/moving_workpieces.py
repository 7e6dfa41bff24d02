"""Proofs where the workpiece moves: the chain starts at the workpiece, and the scene stands behind its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pinocchio as pin

from planner.robots import Robot
from planner.robots.derived.standing import FLIP, foot_in_standing_link, placement_in_world
from planner.scene.checker import CollisionChecker
from planner.spatial import FloatArray

IN_WORLD = ("torque", "power", "total_power", "torque_at_speed", "speed_zones")
"""The claims about motions in the world, where the base of the chain moves with the workpiece."""

MOVES = "the workpiece moves"
"""The reason for leaving them out."""

HALF_SPACE = "a half space stands behind joints that move the workpiece"
"""The reason for leaving out clearances: half spaces of proofs are on the base of the chain."""


def left_out(robot: Robot, checkers: Sequence[CollisionChecker]) -> Mapping[str, str]:
    """Return the claims that no proof of a robot covers, and the reasons; none if its base frame stands still."""
    if not robot.positioner:
        return {}
    has_half_space = any(checker.obstacles.half_spaces for checker in checkers)
    return dict.fromkeys(IN_WORLD, MOVES) | ({"clearance": HALF_SPACE} if has_half_space else {})


def in_chain(
    robot: Robot, joint: int, rotation: FloatArray, translation: FloatArray
) -> tuple[int, FloatArray, FloatArray]:
    """Return the joint of the chain that carries a body of the tree, and the body's placement there.

    Args:
        robot: The robot.
        joint: Number of a joint of the tree from the standing frame, from 1; 0 is that frame.
        rotation: (3, 3), of the body in the frame of that joint.
        translation: (3,), m.
    """
    last = len(robot.positioner)
    if joint > last or last == 0:
        return joint, rotation, translation
    before = foot_in_standing_link(robot) if joint == 0 else robot.model.jointPlacements[joint] * FLIP
    placed = before * pin.SE3(rotation, translation)
    return last if joint == 0 else joint - 1, placed.rotation, placed.translation


def rotation_of(robot: Robot, joint: int, rotations: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) of a joint of the chain by the tree's rotations (joints + 1, 3, 3)."""
    number, placement = placement_in_world(robot, joint, pin.SE3.Identity())
    found: FloatArray = rotations[number] @ placement.rotation
    return found
