"""Bodies of triangles and their files, written without the library."""

from __future__ import annotations

import struct
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

CUBE = np.array(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij")).reshape(3, 8).T
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> FloatArray:
    """Return the twelve triangles of a box."""
    corners = np.array(low) + CUBE * (np.array(high) - np.array(low))
    faces = [face for a, b, c, d in QUADS for face in ((a, b, c), (a, c, d))]
    return corners[np.array(faces)]


def tube(radii: list[float], heights: list[float], sides: int = 40, ends: bool = True) -> FloatArray:
    """Make a body of revolution about z; a fan of `sides` triangles meets in the middle of each end."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    rings = [
        np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(sides, z)])
        for r, z in zip(radii, heights, strict=True)
    ]
    triangles = []
    for lower, upper in pairwise(rings):
        for k in range(sides):
            n = (k + 1) % sides
            triangles += [[lower[k], lower[n], upper[n]], [lower[k], upper[n], upper[k]]]
    for ring, sign in ((rings[0], -1), (rings[-1], 1)) if ends else ():
        middle = ring.mean(axis=0)
        triangles += [[middle, *([ring[k], ring[(k + 1) % sides]][::sign])] for k in range(sides)]
    return np.array(triangles)


def bodies() -> dict[str, FloatArray]:
    """Return bodies by name: convex, concave, flat, open, thin, tiny, huge, and random triangles."""
    rng = np.random.default_rng(7)
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    dumbbell = tube([0.06, 0.06, 0.02, 0.02, 0.06, 0.06], [0.0, 0.1, 0.11, 0.4, 0.41, 0.5])
    return {
        "box": box((0, 0, 0), (0.3, 0.2, 0.1)),
        "l_shape": np.concatenate([box((0, 0, 0), (0.5, 0.1, 0.1)), box((0, 0, 0), (0.1, 0.1, 0.5))]),
        "dumbbell": dumbbell,
        "dumbbell_turned": dumbbell @ turned + np.array([0.1, 0.2, 0.3]),
        "fine_disc": tube([0.1, 0.1], [0.0, 0.05], sides=300),
        "open_tube": tube([0.1, 0.1, 0.02], [0.0, 0.3, 0.4], ends=False),
        "sheet": box((0, 0, 0), (0.5, 0.5, 0.0)),
        "one_triangle": np.eye(3)[None],
        "one_point": np.full((1, 3, 3), 0.3),
        "needle": box((0, 0, 0), (1e-5, 1e-5, 1.0)),
        "tiny": 1e-6 * dumbbell,
        "huge": 1e3 * dumbbell,
        "soup": rng.normal(size=(200, 3, 3)) * 0.1,
        "far_apart": np.concatenate([box((0, 0, 0), (0.1, 0.1, 0.1)), box((5, 5, 5), (5.1, 5.1, 5.1))]),
        "repeated": np.repeat(box((0, 0, 0), (0.3, 0.2, 0.1)), 20, axis=0),
    }


def surface_of(triangles: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return all corners, and random points of the triangles and of their edges."""
    weights = rng.dirichlet(np.ones(3), count)
    weights[::2, 2] = 0.0
    weights /= weights.sum(axis=1, keepdims=True)
    inside = np.einsum("ij,ijk->ik", weights, triangles[rng.integers(0, len(triangles), count)])
    return np.concatenate([triangles.reshape(-1, 3), inside])


def stl(triangles: FloatArray, comment: bytes = b"made by a test") -> bytes:
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles)
    return comment.ljust(80)[:80] + struct.pack("<I", len(triangles)) + body


def stl_text(triangles: FloatArray) -> bytes:
    lines = ["solid made by a test"]
    for triangle in triangles.tolist():
        corners = [f"      vertex {x!r} {y!r} {z!r}" for x, y, z in triangle]
        lines += ["  facet normal 0 0 0", "    outer loop", *corners, "    endloop", "  endfacet"]
    return "\n".join([*lines, "endsolid", ""]).encode()


def obj(triangles: FloatArray) -> bytes:
    points = [f"v {x!r} {y!r} {z!r}" for x, y, z in triangles.reshape(-1, 3).tolist()]
    count = 3 * len(triangles)  # the three ways to write a corner, the last one counted from the end
    faces = [f"f {k + 1}/1/1 {k + 2}//2 {k + 2 - count}" for k in range(0, count, 3)]
    return "\n".join(["# made by a test", "o body", *points, "vn 0 0 1", *faces, ""]).encode()


def dae(triangles: FloatArray, node: str = "", unit: str = "1", kind: str = "triangles") -> bytes:
    points = " ".join(map(repr, triangles.ravel().tolist()))
    indices = " ".join(f"{k} 0" for k in range(3 * len(triangles)))
    counts = f"<vcount>{'3 ' * len(triangles)}</vcount>" if kind == "polylist" else ""
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="{triangles.size}">{points}</float_array>
      <technique_common><accessor source="#pa" stride="3"/></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <{kind} count="{len(triangles)}"><input semantic="VERTEX" source="#v" offset="0"/>
      <input semantic="NORMAL" source="#n" offset="1"/>{counts}<p>{indices}</p></{kind}>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene>
    <node>{node}<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
</COLLADA>""".encode()
