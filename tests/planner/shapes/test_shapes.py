"""Supports and bounds of shapes against points of their surfaces, and numbers that shapes refuse."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING

import coal
import numpy as np
import pytest

from planner import Box, Capsule, ConvexHull, Cylinder, HalfSpace, InvalidShape, Sphere
from tests.planner.shapes.solids import KINDS, shape_of, structured_shapes, surface_points
from tests.sizes import SIZE

if TYPE_CHECKING:
    from planner import Shape

pytestmark = pytest.mark.sized

NAN = float("nan")
INFINITE = float("inf")


def shapes_to_try() -> list[Shape]:
    rng = np.random.default_rng(1)
    return [*structured_shapes(), *(shape_of(kind, rng) for kind in KINDS for _ in range(-(-SIZE.examples // 10)))]


def unit_vectors(count: int, rng: np.random.Generator) -> np.ndarray:
    n = rng.normal(size=(count, 3))
    n[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


@pytest.mark.parametrize("shape", shapes_to_try(), ids=lambda shape: type(shape).__name__)
def test_no_point_is_beyond_the_support_and_some_point_reaches_it(shape: Shape) -> None:
    rng = np.random.default_rng(2)
    points = surface_points(shape, 5_000, rng)
    directions = unit_vectors(30, rng)
    support, farthest = shape.support(directions), (points @ directions.T).max(axis=0)
    largest = np.abs(points).max()
    assert (farthest <= support + 1e-14 * largest).all()
    assert farthest == pytest.approx(support, abs=0.1 * largest)  # so dense are the points


@pytest.mark.parametrize("shape", shapes_to_try(), ids=lambda shape: type(shape).__name__)
def test_the_bounding_capsule_contains_the_shape(shape: Shape) -> None:
    points = surface_points(shape, 5_000, np.random.default_rng(3))
    start, end, radius = shape.bounding_capsule  # type: ignore[misc]  # no half space is among them
    along = end - start
    share = np.clip((points - start) @ along / max(along @ along, 1e-300), 0.0, 1.0)
    assert np.linalg.norm(points - start - share[:, None] * along, axis=1).max() <= radius


@pytest.mark.parametrize("shape", shapes_to_try(), ids=lambda shape: type(shape).__name__)
def test_coal_has_the_same_shape(shape: Shape) -> None:
    """The bounding box of coal is the box of the supports."""
    shape.geometry.computeLocalAABB()
    box = shape.geometry.aabb_local
    reach = shape.support(np.concatenate([np.eye(3), -np.eye(3)]))
    assert np.concatenate([box.max_, -box.min_]) == pytest.approx(reach, abs=1e-9 + 1e-12 * np.abs(reach).max())


def test_hulls_keep_the_corners_alone() -> None:
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, 8).T
    inside = np.random.default_rng(4).uniform(-1.0, 1.0, (500, 3))
    hull = ConvexHull(np.concatenate([inside, corners, corners]))
    assert sorted(hull.vertices.tolist()) == sorted(corners.tolist())
    assert len(hull.faces) == 12
    a, b, c = (hull.vertices[hull.faces[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0.0).all(), "the origin is behind every face"


def test_the_hull_of_a_hull_is_the_same() -> None:
    """Also of a point beside the origin, whose rounded corners are 1e-13 too near: it was thickened again."""
    rng = np.random.default_rng(6)
    for k in range(30):
        points = rng.normal(size=(5, 3)) @ np.diag([k % 2, k % 3 > 0, k % 5 > 0]) + rng.normal(size=3)
        hull = ConvexHull(points)
        assert (ConvexHull(hull.vertices).vertices == hull.vertices).all()


def test_flat_hulls_get_a_thickness() -> None:
    for points in (np.zeros((4, 3)), np.outer(range(5), [1.0, 1.0, 0.0]), np.eye(4, 3)[:3].repeat(2, axis=0)):
        hull = ConvexHull(points)
        n = unit_vectors(100, np.random.default_rng(5))
        assert (hull.support(n) + hull.support(-n) >= 0.99e-4).all()
        assert (hull.support(n) >= (points @ n.T).max(axis=0)).all()
        assert (hull.support(n) <= (points @ n.T).max(axis=0) + 1e-4).all()


def test_a_half_space_ends_along_its_own_normal_alone() -> None:
    floor = HalfSpace([0.0, 0.0, 1e200], 0.5)
    assert floor.support([[0.0, 0.0, 1.0], [0.0, 1e-3, 1.0]]).tolist() == [0.5, INFINITE]
    assert floor.bounding_capsule is None
    assert isinstance(floor.geometry, coal.Halfspace)


def test_shapes_are_equal_where_kind_and_numbers_are() -> None:
    assert Box([1, 2, 3]) == Box(np.array([1.0, 2.0, 3.0]))
    assert len({Capsule(0.1, 0.2), Cylinder(0.1, 0.2), Capsule(0.1, 0.2), Capsule(0.2, 0.1)}) == 3
    assert ConvexHull(np.eye(4, 3)).digest != ConvexHull(2.0 * np.eye(4, 3)).digest
    assert pickle.loads(pickle.dumps(ConvexHull(np.eye(4, 3)))) == ConvexHull(np.eye(4, 3))  # noqa: S301


@pytest.mark.parametrize("number", [NAN, INFINITE, -INFINITE, 0.0, -1.0, 1e-7, 1e4, "wide", None, [1.0, 2.0]])
def test_no_size_is_without_sense(number: object) -> None:
    """coal itself accepts a NaN or negative size, and such a shape collides with nothing."""
    for make in (
        lambda: Sphere(number),  # type: ignore[arg-type]
        lambda: Box([1.0, number, 1.0]),  # type: ignore[list-item]
        lambda: Cylinder(number, 1.0),  # type: ignore[arg-type]
        lambda: Cylinder(1.0, number),  # type: ignore[arg-type]
        lambda: Capsule(number, 1.0),  # type: ignore[arg-type]
        lambda: Capsule(1.0, number),  # type: ignore[arg-type]
    ):
        with pytest.raises(InvalidShape, match=r"radius|size|length"):
            make()


@pytest.mark.parametrize(
    "vertices",
    [
        [],
        [[0.0, 0.0, 0.0]],
        np.eye(3),
        [[0.0, 0.0]] * 8,
        [*np.eye(4, 3).tolist(), [NAN, 0.0, 0.0]],
        [*np.eye(4, 3).tolist(), [0.0, INFINITE, 0.0]],
        [*np.eye(4, 3).tolist(), [0.0, 0.0, 1e9]],
        "vertices",
        [[1, 2, 3], [4, 5]],
    ],
)
def test_no_hull_is_made_of_nonsense(vertices: object) -> None:
    with pytest.raises(InvalidShape, match="vertices"):
        ConvexHull(vertices)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("normal", "offset"), [([0, 0, 0], 0), ([NAN, 0, 1], 0), ([0, 1], 0), ([0, 0, 1], NAN), ([0, 0, 1], 1e9)]
)
def test_no_half_space_is_without_direction(normal: list[float], offset: float) -> None:
    with pytest.raises(InvalidShape, match=r"normal|offset"):
        HalfSpace(normal, offset)
