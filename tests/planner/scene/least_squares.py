"""Random pairs of shapes, and their distances by independent code: least squares over the corners of both."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import nnls

from planner.scene.separations import Placed
from planner.shapes import Box, Capsule, ConvexHull, Shape, Sphere
from planner.spatial import FloatArray, rotation_from_rpy

WEIGHT = 1e3
"""Weight of the equations that the shares of the corners sum up to 1."""


def core(shape: Shape) -> tuple[FloatArray, float]:
    """Return the corners (N, 3) of a shape's convex core, and the radius of the ball around it, m."""
    match shape:
        case Box():
            return np.array([*product((-0.5, 0.5), repeat=3)]) * shape.size, 0.0
        case ConvexHull():
            return shape.vertices, 0.0
        case Sphere():
            return np.zeros((1, 3)), shape.radius
        case Capsule():
            return np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]) * shape.length, shape.radius
        case _:
            raise TypeError(f"{shape} has no corners")


def distance(first: Placed, second: Placed) -> float:
    """Compute the distance of the cores minus the radii, m, by least squares over convex combinations of corners."""
    (a, r), (b, s) = core(first.shape), core(second.shape)
    a, b = a @ first.rotation.T + first.translation, b @ second.rotation.T + second.translation
    middle = a.mean(axis=0)
    sums = np.zeros((2, len(a) + len(b)))
    sums[0, : len(a)] = sums[1, len(a) :] = WEIGHT
    shares, _ = nnls(np.vstack([np.hstack([(a - middle).T, -(b - middle).T]), sums]), [0.0, 0.0, 0.0, WEIGHT, WEIGHT])
    left, right = shares[: len(a)] / shares[: len(a)].sum(), shares[len(a) :] / shares[len(a) :].sum()
    return float(np.linalg.norm(left @ a - right @ b)) - r - s


def random_shape(rng: np.random.Generator) -> Shape:
    match rng.integers(4):
        case 0:
            return Box(10.0 ** rng.uniform(-3.0, 0.0, 3))
        case 1:
            return Sphere(10.0 ** rng.uniform(-3.0, -0.5))
        case 2:
            return Capsule(10.0 ** rng.uniform(-3.0, -1.0), 10.0 ** rng.uniform(-2.0, 0.0))
        case _:
            return ConvexHull(rng.normal(size=(rng.integers(4, 60), 3)) * 10.0 ** rng.uniform(-2.0, -0.5, 3))


def random_placed(rng: np.random.Generator, spread: float) -> Placed:
    """Draw a shape at a random pose, every third one aligned with the axes, like machines and tables."""
    rotation = rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3)) if rng.integers(3) else np.eye(3)
    return Placed(random_shape(rng), rotation, rng.normal(size=3) * spread)
