"""Distances from meshes, also from degenerate ones, which must not end the process."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from planner import Box
from planner.shapes.meshes.mesh import distance_from_mesh

RNG = np.random.default_rng(0)
AWAY = np.array([0.3, 0.2, 5.0])
FACETS = RNG.normal(size=(500, 3, 3))
MESHES = {
    "one": FACETS[:1],
    "the same": np.repeat(FACETS[:1], 500, axis=0),
    "points": np.zeros((300, 3, 3)),
    "line": np.linspace(0.0, 1.0, 900).reshape(300, 3, 1) * np.ones(3),
    "plane": FACETS * [1.0, 1.0, 0.0],
    "tiny": 1e-12 * FACETS,
    "tiny and large": np.concatenate([1e-12 * FACETS, 1e3 * FACETS - [0.0, 0.0, 1e4]]),
    "aligned": RNG.integers(0, 3, size=(2000, 3, 3)).astype(float),
}


@pytest.mark.parametrize("name", MESHES)
def test_distances_are_those_of_dense_points(name: str) -> None:
    triangles = MESHES[name]
    found = distance_from_mesh(SimpleNamespace(triangles=triangles), Box((0.1, 0.1, 0.1)), np.eye(3), AWAY)  # type: ignore[arg-type]
    weights = RNG.dirichlet((1.0, 1.0, 1.0), size=200)
    weights = np.concatenate([weights, np.eye(3)])
    points = np.einsum("pk,nkx->npx", weights, triangles).reshape(-1, 3) - AWAY
    nearest = np.linalg.norm(np.maximum(np.abs(points) - 0.05, 0.0), axis=1).min()
    assert found <= nearest + 1e-9
    assert found == pytest.approx(nearest, rel=0.02)
