"""A ball in the inside of a blended corner."""

from __future__ import annotations

import numpy as np

import planner
from planner.problems.transitions import BlendTransition
from planner.scene import Scene, SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM

KUKA = CAPSULE_ARM
ASKED = 0.2
"""The requested radius of the blends, m."""

BESIDE_A_LINE = (1.205, -0.405, 0.7)
"""Position of a ball in the inside of the corner of two lines, m."""

BESIDE_A_JOINT_MOTION = (1.23, -0.43, 0.65)
"""Position of a ball in the inside of the corner of two joint motions, which go below the lines, m."""

MARGIN = 0.01
"""Margin of the balls, m."""


def ball_at(*position: float) -> Scene:
    """Make a scene with a ball; only the hand counts, as the other links come near on any path."""
    others = {shape.link for shape in KUKA.collision_shapes} - {"link_6"}
    ball = SceneObject("ball", [Sphere(0.03)], Pose(position))
    return Scene([ball], allowed_pairs=[(link, "ball") for link in sorted(others)], margin=MARGIN)


def along_a_rectangle(
    scene: Scene | None, motion: planner.JointMotion | planner.LinearMotion
) -> planner.PlanningProblem:
    """Return a problem that goes out, across and back; waypoints 1 and 2 are blended."""
    places = ([0.9, -0.5, 0.7], [1.3, -0.5, 0.7], [1.3, 0.5, 0.7], [0.9, 0.5, 0.7])
    poses = [Pose.from_rpy(place, [0.0, np.pi, 0.0]) for place in places]
    blend = BlendTransition(ASKED)
    waypoints = [
        planner.PoseWaypoint(poses[0]),
        *(planner.PoseWaypoint(pose, motion=motion, transition=blend) for pose in poses[1:3]),
        planner.PoseWaypoint(poses[3], motion=motion),
    ]
    return planner.PlanningProblem(KUKA, waypoints, scene=scene)
