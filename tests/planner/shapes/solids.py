"""Random and structured shapes, and points of them computed without the library."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import Box, Capsule, ConvexHull, Cylinder, Sphere

if TYPE_CHECKING:
    from planner import Shape
    from planner.spatial import FloatArray

KINDS = ("sphere", "box", "cylinder", "capsule", "hull")


def shape_of(kind: str, rng: np.random.Generator, scale: float = 0.3) -> Shape:
    """Draw a shape of a kind with sizes from 1 % of the scale up to it, cubes, needles and plates."""
    size = scale * 10.0 ** rng.uniform(-2.0, 0.0, 3)
    match kind:
        case "sphere":
            return Sphere(size[0])
        case "box":
            return Box(size)
        case "cylinder":
            return Cylinder(*size[:2])
        case "capsule":
            return Capsule(*size[:2])
        case _:
            return ConvexHull(rng.normal(size=(int(rng.integers(4, 40)), 3)) * size)


def structured_shapes() -> list[Shape]:
    """Return tiny, huge, flat, thin and symmetric shapes, and hulls of regular bodies with many points in one plane."""
    grid = np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 4)] * 3), axis=-1).reshape(-1, 3)
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    disc = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(400)])
    return [
        Sphere(1e-6),
        Sphere(1e3),
        Box([1.0, 1.0, 1.0]),
        Box([1e3, 1e3, 1e-3]),
        Box([1e-6, 1e-6, 1.0]),
        Cylinder(1.0, 1e-4),
        Cylinder(1e-4, 1.0),
        Capsule(1e-3, 100.0),
        Capsule(1.0, 1e-6),
        ConvexHull(grid),
        ConvexHull(np.concatenate([disc, disc + np.array([0.0, 0.0, 0.5]), np.zeros((1, 3))])),
        ConvexHull(disc),
        ConvexHull(np.outer([0.0, 0.1, 0.5, 1.0], [1.0, 2.0, 3.0])),
        ConvexHull(np.full((4, 3), 0.2)),
        ConvexHull(1e3 * np.eye(4, 3)),
    ]


def surface_points(shape: Shape, count: int, rng: np.random.Generator) -> FloatArray:
    """Draw points (count, 3) of the surface, its rims and corners among them, by the formula of each kind."""
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    match shape:
        case Sphere(radius=r):
            return r * n
        case Box(size=size):
            sides = rng.uniform(-0.5, 0.5, (count, 3))
            sides[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-0.5, 0.5], count)
            sides[:8] = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T
            return sides * size
        case Cylinder(radius=r, length=length):
            z = np.where(rng.random(count) < 0.5, rng.choice([-0.5, 0.5], count), rng.uniform(-0.5, 0.5, count))
            return np.column_stack([r * np.cos(turn), r * np.sin(turn), length * z])
        case Capsule(radius=r, length=length):
            return r * n + np.outer(rng.uniform(-0.5, 0.5, count), [0.0, 0.0, length])
        case ConvexHull(vertices=vertices):
            weights = rng.dirichlet(np.ones(3), count)
            corners = vertices[rng.integers(0, len(vertices), (count, 3))]
            return np.concatenate([np.einsum("ij,ijk->ik", weights, corners), vertices])
    raise TypeError(type(shape))
