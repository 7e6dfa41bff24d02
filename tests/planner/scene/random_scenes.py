"""Random scenes, arms made of capsules, and motions among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.scene import PointCloud, Scene, SceneObject
from planner.shapes import Box, Capsule, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose, rotation_with_z_along
from planner.trajectories.trajectory import Trajectory

POINTS = 150
"""Number of points of a random cloud: its tree has three leaves."""


def random_shape(rng: np.random.Generator) -> Shape | PointCloud:
    match rng.integers(7):
        case 0:
            return Box(rng.uniform(0.02, 0.4, 3))
        case 1:
            return Sphere(rng.uniform(0.02, 0.2))
        case 2:
            return Cylinder(rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.5))
        case 3:
            return Capsule(rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.5))
        case 4:
            return HalfSpace(rng.normal(size=3), -rng.uniform(0.3, 1.0))
        case 5:  # a bent surface, each of whose points is a ball of its own
            x, y = rng.uniform(-0.4, 0.4, (2, POINTS))
            return PointCloud(np.stack([x, y, rng.uniform(-1.0, 1.0) * x * y], axis=1), 0.02, 1e-4)
        case _:
            return Box([1.0, 1.0, 0.01])


def random_scene(rng: np.random.Generator, reach: float) -> Scene:
    things = []
    for number in range(3):
        shape, way = random_shape(rng), rng.normal(size=3)
        position = np.zeros(3) if isinstance(shape, HalfSpace) else way / np.linalg.norm(way) * rng.uniform(0.4, reach)
        things.append(SceneObject(f"thing_{number}", [shape], Pose.from_rpy(position, rng.normal(size=3))))
    return Scene(things)


def in_capsules(robot: Robot) -> None:
    """Replace the shapes of a robot by their bounding capsules, which have closed forms."""
    shapes = []
    for piece in robot.collision_shapes:
        capsule = piece.shape.bounding_capsule
        assert capsule is not None
        way = capsule.end - capsule.start
        length = float(np.linalg.norm(way))
        rotation = rotation_with_z_along(way / length) if length else np.eye(3)
        placement = piece.placement * pin.SE3(rotation, (capsule.start + capsule.end) / 2.0)
        round_one = Capsule(capsule.radius, length) if length else Sphere(capsule.radius)
        shapes.append(replace(piece, placement=placement, shape=round_one))
    vars(robot)["collision_shapes"] = tuple(shapes)


def motion_between(start: FloatArray, end: FloatArray, duration: float = 1.5) -> Trajectory:
    """Return a quintic from rest to rest."""
    rise = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]) / duration ** np.arange(6)
    coefficients = np.outer(end - start, rise)
    coefficients[:, 0] += start
    ends = np.array([0.0, duration])
    return Trajectory(np.array([duration]), coefficients[None], np.zeros(1, dtype=int), ends, ends)
