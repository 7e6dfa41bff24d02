"""Distances of line segments, bounded from below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

PARALLEL = 1e-12
"""Squared sine of the angle between two segments below which they count as parallel."""


def segment_distances(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Bound the distances of the segments from a to b from those from c to d, exactly but where they nearly meet.

    The nearest points (Ericson, Real-Time Collision Detection, 5.1.9) suggest a direction; what is returned is how far
    the segments leave each other along it, which is never more than their distance, however well the points were found.

    Args:
        a: (N, 3), m.
        b: (N, 3), m.
        c: (N, 3), m.
        d: (N, 3), m.

    Returns:
        (N,), m.
    """
    u, v, r = b - a, d - c, a - c
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    ur, vr = _dot(u, r), _dot(v, r)
    area = uu * vv - uv * uv
    skew = area > PARALLEL * uu * vv
    s = np.where(skew, np.clip((uv * vr - ur * vv) / np.where(skew, area, 1.0), 0.0, 1.0), 0.0)
    has_u, has_v = uu > 0.0, vv > 0.0
    t = np.where(has_v, np.clip((uv * s + vr) / np.where(has_v, vv, 1.0), 0.0, 1.0), 0.0)
    s = np.where(has_u, np.clip((uv * t - ur) / np.where(has_u, uu, 1.0), 0.0, 1.0), 0.0)
    way = r + s[:, None] * u - t[:, None] * v
    length = np.sqrt(_dot(way, way))
    normal = way / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    nearest = np.minimum(_dot(normal, a), _dot(normal, b))
    return nearest - np.maximum(_dot(normal, c), _dot(normal, d))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    products: FloatArray = np.einsum("ij,ij->i", a, b)
    return products
