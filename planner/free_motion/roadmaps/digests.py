"""Digests of the moving bodies and of each static object, as the proofs of a roadmap read them."""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256

import numpy as np
from numpy.typing import ArrayLike

from planner.roadmap import Roadmap
from planner.robots import Robot
from planner.scene import CollisionChecker, Scene
from planner.scene.arrays import core_of
from planner.scene.checker import checker_of
from planner.scene.obstacles import Obstacle
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace, Shape
from planner.spatial import FloatArray

WIDEST = np.pi
"""The largest distance of a sample from the middle of its joint's range, rad or m: whole turns lead nowhere else."""


def is_current(roadmap: Roadmap, robot: Robot, scene: Scene | None, self_collision: bool | None) -> bool:
    """Tell whether a roadmap is proved for these moving bodies among these objects."""
    return (roadmap.robot, roadmap.objects) == digests_of(robot, checker_of(robot, scene, self_collision))


def digests_of(robot: Robot, checker: CollisionChecker) -> tuple[str, dict[str, str]]:
    """Compute the digest of a robot, and the digest of each object around it by its name."""
    return digest_of_robot(checker, sampled_range(robot)), digests_of_objects(checker)


def sampled_range(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest joint positions (joints,) of samples."""
    lower, upper = robot.limit("lower"), robot.limit("upper")
    middle = np.clip(0.0, lower, upper)
    return np.maximum(lower, middle - WIDEST), np.minimum(upper, middle + WIDEST)


def digest_of_robot(checker: CollisionChecker, within: ArrayLike) -> str:
    """Compute the digest of the moving bodies, and of the range of its joint positions (2, joints), rad or m."""
    bodies = checker.bodies
    parts: list[ArrayLike] = [within, bodies.joint_rows(), checker.first, checker.second, checker.own_margins]
    for body in bodies.pieces:
        parts += [body.joint, body.rotation, body.translation, *_numbers(body.shape)]
    return _digest(parts)


def digests_of_objects(checker: CollisionChecker) -> dict[str, str]:
    """Compute the digest of each static object, with its pose in the base frame and its margins, by its name."""
    margins, pieces = checker.margins, checker.obstacles.all
    kinds = checker.kinds(np.arange(margins.size) + checker.own_pairs).reshape(margins.shape)
    by_name: dict[str, list[int]] = {thing.id: [] for thing in checker.scene.objects}
    for number, piece in enumerate(pieces):
        by_name[piece.name].append(number)
    return {
        name: _digest(part for k in numbers for part in (*_placed_numbers(pieces[k]), margins[:, k], kinds[:, k]))
        for name, numbers in by_name.items()
    }


def _placed_numbers(piece: Obstacle) -> list[ArrayLike]:
    return [piece.rotation, piece.translation, *_numbers(piece.shape)]


def _numbers(shape: Shape | Cluster) -> list[ArrayLike]:
    """Return the numbers of a shape."""
    if isinstance(shape, Cluster):
        return [shape.centers, shape.radii]
    return [shape.normal, shape.offset] if isinstance(shape, HalfSpace) else list(core_of(shape))


def _digest(parts: Iterable[ArrayLike]) -> str:
    """Compute the digest of arrays with their shapes."""
    found = sha256()
    for part in parts:
        array = np.asarray(part, dtype="<f8")
        found.update(repr(array.shape).encode() + array.tobytes())
    return found.hexdigest()
