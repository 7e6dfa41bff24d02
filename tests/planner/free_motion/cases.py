"""Arms, two sides of a wall, and the wall between them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

import planner
from planner.robots import DHJoint
from planner.scene import SceneObject
from planner.shapes import Box
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM

ARM = CAPSULE_ARM
LEFT = np.array([0.9, -0.9, 1.2, 0.0, 0.8, 0.0])
RIGHT = np.array([-0.9, *LEFT[1:]])

WALL = SceneObject("wall", [Box([0.8, 0.1, 1.6])], Pose([1.3, 0.0, 0.8]))
"""The obstacle between the two, in the plane of their symmetry."""

RIGHT_ANGLE = np.pi / 2.0
TABLE = [(0.1807, 0.0, RIGHT_ANGLE), (0.0, -0.6127, 0.0), (0.0, -0.57155, 0.0), (0.17415, 0.0, RIGHT_ANGLE)]
TABLE += [(0.11985, 0.0, -RIGHT_ANGLE), (0.11655, 0.0, 0.0)]
"""The lengths d and a, m, and the twists of the UR10e, as its maker publishes them."""

RADII = (0.1, 0.09, 0.075, 0.06, 0.05, 0.05, 0.045)
"""Radii of the capsules that stand for its base and links, m."""


@lru_cache
def robot() -> planner.Robot:
    """Return a UR10e made of capsules, with a tool of 0.2 m."""
    turn = 2.0 * np.pi
    joints = [
        DHJoint("revolute", d=d, a=a, alpha=alpha, lower=-turn, upper=turn, velocity=2.0) for d, a, alpha in TABLE
    ]
    arm = planner.Robot.from_dh(joints)
    return replace(arm, collision=replace(arm.collision, link_radii=RADII)).with_tool(planner.Pose([0.0, 0.0, 0.2]))
