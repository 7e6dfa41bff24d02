"""Obstacles around a robot, and proved distances of its pieces: at joint positions and along motions."""

from planner.scene.carried import checker_at_waypoints, segment_scenes
from planner.scene.checker import CONTACT_TOLERANCE, CollisionChecker
from planner.scene.continuous import (
    Budget,
    Clearances,
    Nearest,
    PositionCollision,
    clearances,
    collisions_at,
    edge,
    is_free,
)
from planner.scene.motions import ConstantVelocity, ObjectMotion, TimedPoses
from planner.scene.point_cloud import PointCloud
from planner.scene.scene import HERE, Attach, AttachedObject, Handling, Scene, SceneObject

__all__ = [
    "CONTACT_TOLERANCE",
    "HERE",
    "Attach",
    "AttachedObject",
    "Budget",
    "Clearances",
    "CollisionChecker",
    "ConstantVelocity",
    "Handling",
    "Nearest",
    "ObjectMotion",
    "PointCloud",
    "PositionCollision",
    "Scene",
    "SceneObject",
    "TimedPoses",
    "checker_at_waypoints",
    "clearances",
    "collisions_at",
    "edge",
    "is_free",
    "segment_scenes",
]
