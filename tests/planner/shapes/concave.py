"""Concave meshes: bins, shelves and tubes, closed, of one part or several."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.planner.shapes.mesh_files import box

if TYPE_CHECKING:
    from planner.spatial import FloatArray


def bin_of(size: tuple[float, float, float], wall: float) -> FloatArray:
    """Return the closed surface of a bin that is open above, with a corner at the origin: 28 triangles."""
    (x, y, z), t = size, wall
    outer = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]
    inner = [(t, t), (x - t, t), (x - t, y - t), (t, y - t)]
    quads = []
    for k in range(4):
        n = (k + 1) % 4
        quads += [
            [(*outer[k], 0.0), (*outer[n], 0.0), (*outer[n], z), (*outer[k], z)],
            [(*inner[n], t), (*inner[k], t), (*inner[k], z), (*inner[n], z)],
            [(*outer[k], z), (*outer[n], z), (*inner[n], z), (*inner[k], z)],
        ]
    quads += [[(*p, 0.0) for p in outer[::-1]], [(*p, t) for p in inner]]
    return np.array([[q[k] for k in half] for q in quads for half in ((0, 1, 2), (0, 2, 3))])


def walls_of_bin(size: tuple[float, float, float], t: float) -> list[FloatArray]:
    """Return a bin as five boxes."""
    x, y, z = size
    return [
        box((0, 0, 0), (x, y, t)),
        box((0, 0, 0), (t, y, z)),
        box((x - t, 0, 0), (x, y, z)),
        box((0, 0, 0), (x, t, z)),
        box((0, y - t, 0), (x, y, z)),
    ]


def shelf() -> FloatArray:
    """Return four boards between two sides."""
    boards = [box((0, 0, z), (1.0, 0.3, z + 0.02)) for z in (0.0, 0.4, 0.8, 1.2)]
    return np.concatenate([*boards, box((0, 0, 0), (0.02, 0.3, 1.2)), box((0.98, 0, 0), (1.0, 0.3, 1.2))])


def concave_meshes() -> dict[str, FloatArray]:
    """Return concave meshes by name."""
    turned = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
    closed, size = bin_of((0.6, 0.4, 0.25), 0.01), (0.6, 0.4, 0.25)
    return {
        "bin": closed,
        "bin_turned": closed @ turned + np.array([0.1, 0.2, 0.3]),
        "bin_of_boxes": np.concatenate(walls_of_bin(size, 0.01)),
        "shelf": shelf(),
        "two_bins": np.concatenate([closed, closed + np.array([0.9, 0.0, 0.0])]),
    }
