"""The judge's own distances: Gilbert's algorithm says the same of convex hulls."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tests.api.random_requests.distances import distance_to


def gilbert(point: np.ndarray, vertices: np.ndarray) -> float:
    """Return the distance of a point from a convex hull: E. G. Gilbert (1966), doi 10.1137/0304007, its upper bound."""
    nearest = vertices[0] - point
    for _ in range(20_000):
        farther = vertices[(vertices @ nearest).argmin()] - point - nearest
        if -farther @ nearest < 1e-9 * np.linalg.norm(nearest):
            break
        nearest = nearest + np.clip(-(nearest @ farther) / (farther @ farther), 0.0, 1.0) * farther
    return float(np.linalg.norm(nearest))


@pytest.mark.parametrize(("corners", "count"), [(8, 4), (250, 8), (250, 12_000)])
def test_the_least_distance_from_a_hull_is_the_truth(corners: int, count: int) -> None:
    """Of many points from a hull of many corners, the least was that from a plane: too little."""
    random = np.random.default_rng(corners + count)
    vertices = random.normal(size=(corners, 3)) * [0.1, 0.2, 0.02]
    vertices = vertices[ConvexHull(vertices).vertices]
    points = random.normal(size=(count, 3)) * 0.05 + [0.3, 0.9, 0.3]
    found = distance_to({"kind": "convex", "vertices": vertices.tolist()})(points)
    chosen = np.unique([found.argmin(), *range(0, count, max(1, count // 20))])
    truth = np.array([gilbert(points[k], vertices) for k in chosen])
    assert found.min() == pytest.approx(truth.min(), abs=1e-6)
    assert (found[chosen] > truth - 1e-6).all()
