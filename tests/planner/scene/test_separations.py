"""Proved distances against independent code: non-negative least squares over the corners of two shapes."""

from __future__ import annotations

import numpy as np
import pytest

from planner.scene.point_cloud import Cluster, PointCloud, k_d_leaves
from planner.scene.scene import SceneObject
from planner.scene.separations import Placed, cluster_separation, separation
from planner.shapes import Box, Capsule, Sphere
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.scene.least_squares import distance, random_placed
from tests.planner.scene.reference.bounds import ReferenceObstacles, segment_distances
from tests.sizes import NAME, SIZE

PAIRS = 150 if NAME == "quick" else 10_000
"""Number of pairs; larger sizes take all of them."""


@pytest.mark.sized
def test_proved_distances_agree_with_least_squares() -> None:
    rng = np.random.default_rng(7)
    apart = 0
    for _ in range(PAIRS):
        spread = 10.0 ** rng.uniform(-1.5, 0.5)
        first, second = random_placed(rng, spread), random_placed(rng, spread)
        found, truth = separation(first, second), distance(first, second)
        assert found.proved <= found.distance
        assert found.proved <= truth + 1e-6
        if truth > 1e-5:
            apart += 1
            assert found.proved >= truth - 2e-5
            assert found.distance == pytest.approx(truth, abs=2e-5)
    assert 0.2 * PAIRS < apart < 0.98 * PAIRS


@pytest.mark.sized
def test_segments_are_never_nearer_than_their_bound() -> None:
    """Segments are parallel, crossing, touching, degenerate to a point, tiny and long."""
    rng = np.random.default_rng(3)
    points = rng.integers(-2, 3, (4, 40 * SIZE.examples, 3)) * 10.0 ** rng.integers(-4, 2, (4, 40 * SIZE.examples, 1))
    bounds = segment_distances(*points)
    shares = np.linspace(0.0, 1.0, 21)[:, None, None]
    first, second = (points[k] + shares * (points[k + 1] - points[k]) for k in (0, 2))
    sampled = np.linalg.norm(first[:, None] - second[None], axis=-1).min(axis=(0, 1))
    scale = np.abs(points).max(axis=(0, 2)) + 1.0
    assert (bounds <= sampled + 1e-12 * scale).all()
    steps = (np.linalg.norm(points[1] - points[0], axis=1) + np.linalg.norm(points[3] - points[2], axis=1)) / 40.0
    clear = sampled > 2.0 * steps  # where they meet there is no direction to leave each other in
    assert clear.sum() > 0.2 * len(clear)
    assert (bounds[clear] >= (sampled - steps - 1e-9 * scale)[clear]).all()


@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 63, 65, 1000])
@pytest.mark.parametrize("kinds", [1, 3, 10**6])
def test_leaves_of_a_tree_have_every_point_once(count: int, kinds: int) -> None:
    """Many points may be equal, or all of them."""
    points = np.random.default_rng(count).integers(kinds, size=(count, 3)).astype(float)
    leaves = k_d_leaves(points, 8)
    assert sorted(row for leaf in leaves for row in leaf.tolist()) == list(range(count))
    assert all(0 < len(leaf) <= 8 for leaf in leaves)
    if count == 1000 and kinds > 3:
        sides = [float(np.ptp(points[leaf], axis=0).max()) for leaf in leaves]
        assert np.median(sides) < 0.4 * kinds


@pytest.mark.large_only
def test_a_cluster_is_as_near_as_its_nearest_ball() -> None:
    rng = np.random.default_rng(5)
    cloud = PointCloud(rng.uniform(-1.0, 1.0, (500, 3)), radius=0.01)
    rotation, translation = rotation_from_rpy(0.3, -0.4, 1.0), np.array([0.1, 0.2, 0.3])
    assert sum(len(cluster.radii) for cluster in cloud.clusters) == len(cloud.balls.radii)
    for shape in (Box([0.1, 0.2, 0.3]), Sphere(0.1), Capsule(0.05, 0.2)):
        first = Placed(shape, np.eye(3), np.array([2.0, 0.5, 0.0]))
        there = [Cluster(each.centers @ rotation.T + translation, each.radii) for each in cloud.clusters]
        found = min(cluster_separation(first, each).proved for each in there)
        centers = cloud.balls.centers @ rotation.T + translation
        balls = (Placed(Sphere(r), np.eye(3), c) for c, r in zip(centers, cloud.balls.radii.tolist(), strict=True))
        assert found == pytest.approx(min(distance(first, ball) for ball in balls), abs=2e-6)


@pytest.mark.parametrize("size", [1e-3, 0.1, 10.0, 300.0])
@pytest.mark.parametrize("place", [0.0, 1.0, 300.0])
def test_segments_are_as_far_from_balls_as_a_closed_form_says(size: float, place: float) -> None:
    """Segments are long or points, inside balls and far away, near clusters of one ball, of many, and of none."""
    rng = np.random.default_rng(8)
    clouds = [PointCloud(place + size * rng.uniform(-1.0, 1.0, (count, 3)), 0.01, 0.001) for count in (1, 7, 500)]
    pose = Pose(np.array([0.3, -0.2, 0.1]), rotation_from_rpy(0.3, -0.4, 1.0))
    obstacles = ReferenceObstacles([SceneObject("box", [Box([1.0, 1.0, 1.0])]), SceneObject("all", clouds, pose)], None)
    obstacles.prepare()
    numbers = np.flatnonzero(obstacles.has_balls(np.arange(len(obstacles.pieces))))
    assert numbers.tolist() == list(range(1, len(obstacles.pieces)))
    rows = np.repeat(numbers, 20)
    centers = np.array([rng.permutation(obstacles.balls(row).centers)[0] for row in rows.tolist()])
    starts = centers + rng.choice([0.0, 0.01, 1.0], (len(rows), 1)) * size * rng.normal(size=(len(rows), 3))
    ends = starts + rng.choice([0.0, 1e-9, 1.0], (len(rows), 1)) * size * rng.normal(size=(len(rows), 3))
    found = obstacles.ball_distances(starts, ends, rows)
    for row, start, end, bound in zip(rows.tolist(), starts, ends, found.tolist(), strict=True):
        balls = obstacles.balls(row)
        way = end - start
        shares = np.clip((balls.centers - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        truth = (np.linalg.norm(balls.centers - start - shares[:, None] * way, axis=1) - balls.radii).min()
        assert truth - 1e-5 * (1e-3 + size) - 2e-9 <= bound <= truth
