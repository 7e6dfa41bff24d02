"""STL, the form of most meshes: binary or text, without units (m here)."""

from __future__ import annotations

import re

import numpy as np

from planner.shapes.meshes.mesh import InvalidMesh, Mesh, check_count

HEADER = 84
"""Bytes before the triangles of a binary file: a comment of 80, and the number of triangles."""

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle of a binary file, 50 bytes."""

VERTEX = re.compile(rb"\bvertex\s+([-+.\deE]+)\s+([-+.\deE]+)\s+([-+.\deE]+)(?=\s)")
"""A corner in a text."""


def read_stl(data: bytes) -> Mesh:
    """Read an STL file.

    A binary file may begin with the word `solid`, too: which it is follows from whether its size goes with its number
    of triangles.

    Raises:
        InvalidMesh: It is no STL file, is cut short, or has no usable triangles.
    """
    count = int.from_bytes(data[HEADER - 4 : HEADER], "little")
    if len(data) >= HEADER and len(data) == HEADER + count * TRIANGLE.itemsize:
        check_count(count)
        return Mesh.checked(np.frombuffer(data, TRIANGLE, count, HEADER)["corners"])
    if data[:1024].lstrip().lower().startswith(b"solid") and b"vertex" in data:
        return _read_text(data)
    if len(data) < HEADER:
        raise InvalidMesh(f"it is no STL file: it has {len(data)} bytes, a header alone has {HEADER}")
    expected = HEADER + count * TRIANGLE.itemsize
    raise InvalidMesh(f"its header says {count} triangles, which are {expected} bytes: the file has {len(data)}")


def _read_text(data: bytes) -> Mesh:
    lowered = data.lower()
    count = len(re.findall(rb"\bvertex\b", lowered))
    if count % 3:
        raise InvalidMesh(f"it has {count} corners: a triangle has three")
    check_count(count // 3)
    found = VERTEX.findall(lowered)
    try:
        corners = np.array([float(number) for corner in found for number in corner])
    except ValueError:
        raise InvalidMesh("a corner is not made of numbers") from None
    if len(found) != count:
        raise InvalidMesh("a corner is not made of three numbers")
    return Mesh.checked(corners.reshape(-1, 3, 3))
