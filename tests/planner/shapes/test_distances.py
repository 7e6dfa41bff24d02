"""Distances that planes prove, against a second code: a quadratic program over vertices, and the plane that it finds.

Each shape is the hull of points and a radius around it. The program (non-negative least squares of the difference of
two convex combinations) gives two points, and so an upper bound. The plane between them gives a lower bound. Both need
sums of products only. Where the two bounds meet, they are the distance, whatever found them.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from planner import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Sphere
from planner.scene.separations import Placed, separation
from tests.planner.shapes.solids import KINDS, shape_of
from tests.sizes import NAME

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.spatial import FloatArray

pytestmark = pytest.mark.sized

PAIRS = 10_000 if NAME != "quick" else 300
SIDES = 64
TIGHT_WITHIN = 1e-4
"""Allowed loss of a proved distance: coal has the same error for capsules of 30 micrometres."""


class Truth(NamedTuple):
    lower: float
    upper: float


def points_and_radius(placed: Placed) -> tuple[FloatArray, float, float]:
    """Return points (N, 3) in the world, a radius, and an error.

    The hull of the points with the radius around it is inside the shape, smaller by at most the error.
    """
    shape, radius, inside = placed.shape, 0.0, 0.0
    match shape:
        case Sphere():
            points, radius = np.zeros((1, 3)), shape.radius
        case Capsule():
            points, radius = np.outer([-0.5, 0.5], [0.0, 0.0, shape.length]), shape.radius
        case Box():
            points = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T * shape.size
        case Cylinder():
            turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
            ring = shape.radius * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(SIDES)])
            points = np.concatenate([ring + [0, 0, z * shape.length] for z in (-0.5, 0.5)])  # noqa: RUF005
            inside = shape.radius * (1.0 - np.cos(np.pi / SIDES))
        case ConvexHull():
            points = shape.vertices
        case _:
            raise TypeError(type(shape))
    return points @ placed.rotation.T + placed.translation, radius, inside


def distance_by_program(first: Placed, second: Placed) -> Truth:
    """Return bounds of the distance of two shapes, 0 where they overlap."""
    (a, radius_a, inside_a), (b, radius_b, inside_b) = points_and_radius(first), points_and_radius(second)
    middle = (a.mean(axis=0) + b.mean(axis=0)) / 2.0
    a, b = a - middle, b - middle
    size = max(np.abs(a).max(), np.abs(b).max(), 1e-9)
    weight = 1e4
    rows = np.zeros((5, len(a) + len(b)))
    rows[:3, : len(a)], rows[:3, len(a) :] = a.T / size, -b.T / size
    rows[3, : len(a)] = rows[4, len(a) :] = weight
    shares = nnls(rows, np.array([0.0, 0.0, 0.0, weight, weight]))[0]
    own, other = shares[: len(a)], shares[len(a) :]
    apart = other @ b / other.sum() - own @ a / own.sum()
    length = float(np.linalg.norm(apart))
    radii = radius_a + radius_b
    if length == 0.0:
        return Truth(0.0, 0.0)
    n = apart / length
    gap = float((b @ n).min() - (a @ n).max())
    return Truth(max(0.0, gap - inside_a - inside_b - radii), max(0.0, length - radii))


def random_pair(rng: np.random.Generator) -> tuple[Placed, Placed]:
    """Draw two shapes near each other: touching, parallel, aligned, nested or far."""
    kinds = rng.choice(KINDS, 2)
    scales = 10.0 ** rng.uniform(-3.0, 1.0, 2) if rng.random() < 0.3 else np.full(2, 0.3)
    shapes = [shape_of(str(kind), rng, scale) for kind, scale in zip(kinds, scales, strict=True)]
    if rng.random() < 0.1:
        shapes[1] = shapes[0]
    sizes = [np.linalg.norm(shape.support(np.eye(3)) + shape.support(-np.eye(3))) for shape in shapes]
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    rotations = [Rotation.random(random_state=rng).as_matrix() for _ in shapes]
    match rng.integers(5):
        case 0:  # parallel
            rotations[1] = rotations[0]
        case 1:  # along the axes of the world
            rotations = [np.eye(3)[rng.permutation(3)] for _ in shapes]
            rotations = [rotation * np.linalg.det(rotation) for rotation in rotations]
            direction = np.eye(3)[rng.integers(3)]
    first = Placed(shapes[0], rotations[0], rng.uniform(-1.0, 1.0, 3))
    second = Placed(shapes[1], rotations[1], first.translation)
    reach = first.support(direction) - first.translation @ direction
    reach += second.support(-direction) + second.translation @ direction
    gaps = (0.0, 1e-6, 1e-3, 0.1 * sum(sizes), -0.01 * min(sizes), -reach)
    return first, second._replace(translation=first.translation + (reach + rng.choice(gaps)) * direction)


def structured_pairs() -> Iterator[tuple[str, Placed, Placed]]:
    """Yield pairs on which distance algorithms have failed: faces on faces, edges on edges, plates and needles."""
    here = np.zeros(3)
    cube, plate, needle = Box([1.0, 1.0, 1.0]), Box([1e3, 1e3, 1e-3]), Capsule(1e-6, 1.0)
    turn = Rotation.from_euler("xyz", [45.0, 35.26438968, 10.0], degrees=True).as_matrix()
    turned = 2.0 * np.pi * np.arange(200) / 200
    ring = np.column_stack([np.cos(turned), np.sin(turned), np.zeros(200)])
    disc = ConvexHull(np.concatenate([ring, ring + np.array([0.0, 0.0, 0.1])]))
    for name, first, second in (
        ("cubes", cube, cube),
        ("plates", plate, plate),
        ("needles", needle, needle),
        ("needle and plate", needle, plate),
        ("discs", disc, disc),
        ("cylinder and disc", Cylinder(1.0, 0.1), disc),
        ("tiny and huge", Sphere(1e-6), Box([1e3] * 3)),
        ("flat hulls", ConvexHull(np.eye(4, 3)[:3].repeat(2, axis=0)), ConvexHull(np.zeros((4, 3)))),
    ):
        for rotation in (np.eye(3), turn):
            for gap in (0.0, 1e-9, 1e-6, 0.01, 10.0, 500.0):
                for axis in (np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.ones(3) / np.sqrt(3.0)):
                    one, other = Placed(first, np.eye(3), here), Placed(second, rotation, here)
                    reach = one.support(axis) + other.support(-axis)
                    yield name, one, other._replace(translation=(reach + gap) * axis)


def scale_of(first: Placed, second: Placed) -> float:
    points = np.concatenate([points_and_radius(placed)[0] for placed in (first, second)])
    return 1.0 + float(np.abs(points).max())


def assert_proved_and_near(first: Placed, second: Placed) -> float:
    """Assert that proved distances never exceed the truth and are near it where shapes are apart.

    Returns the uncertainty of the truth.
    """
    truth, found = distance_by_program(first, second), separation(first, second)
    scale = scale_of(first, second)
    said = f"{first}\n{second}\n{truth} {found}"
    assert found.proved <= truth.upper + 1e-11 * scale, said
    assert max(found.distance, 0.0) >= truth.lower - 1e-9 * scale, said
    assert found.proved >= truth.lower - TIGHT_WITHIN * scale or truth.lower == 0.0, said
    return (truth.upper - truth.lower) / scale


@pytest.mark.large_only
def test_random_pairs() -> None:
    rng = np.random.default_rng(11)
    widths = [assert_proved_and_near(*random_pair(rng)) for _ in range(PAIRS)]
    assert np.median(widths) < 1e-6, "the truth is known well enough to tell"


def test_structured_pairs() -> None:
    for _name, first, second in islice(structured_pairs(), 0, None, 1 if PAIRS > 1000 else 5):
        assert_proved_and_near(first, second)


def test_half_spaces() -> None:
    """The truth is the lowest of many points of the surface."""
    rng = np.random.default_rng(12)
    for _ in range(PAIRS // 10):
        first, _ = random_pair(rng)
        normal = rng.normal(size=3)
        floor = HalfSpace(normal, float(rng.uniform(-1.0, 1.0)))
        second = Placed(floor, Rotation.random(random_state=rng).as_matrix(), rng.uniform(-1.0, 1.0, 3))
        points, radius, inside = points_and_radius(first)
        along = ((points - second.translation) @ second.rotation) @ floor.normal
        expected = along.min() - radius - floor.offset
        found = separation(first, second)
        assert expected - inside - 1e-9 <= found.proved <= expected + 1e-11
