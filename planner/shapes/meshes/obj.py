"""Wavefront OBJ: points, and faces with any number of corners by the numbers of their points."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from planner.shapes.meshes.mesh import MAX_TRIANGLES, InvalidMesh, Mesh, check_count


def read_obj(data: bytes) -> Mesh:
    """Read the points and faces of an OBJ file; cut faces with more corners into fans of triangles.

    Raises:
        InvalidMesh: It is not made of numbers, or a face names a point that is not there.
    """
    points: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for number, line in enumerate(data.splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == [b"v"]:
                x, y, z = words[1:4]
                points.append([float(x), float(y), float(z)])
            elif words[:1] == [b"f"]:
                corners = [_index(word, len(points)) for word in words[1:]]
                if len(corners) < 3:
                    raise InvalidMesh(f"the face in line {number} has {len(corners)} corners")
                triangles += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
        except InvalidMesh:
            raise
        except (IndexError, ValueError):
            raise InvalidMesh(f"line {number} is no {'point' if words[0] == b'v' else 'face'} of this file") from None
        if max(len(triangles), len(points)) > MAX_TRIANGLES:
            raise InvalidMesh(f"it has more than {MAX_TRIANGLES} triangles or points")
    check_count(len(triangles))
    return Mesh.checked(np.array(points)[np.array(triangles)])


def _index(word: bytes, count: int) -> int:
    """Return the index of a face's point, written from 1, or from -1 backwards, before a slash.

    Raises:
        IndexError: There is no such point.
        ValueError: It is no number.
    """
    written = int(word.partition(b"/")[0])
    index = written - 1 if written > 0 else count + written
    if not (0 <= index < count and written):
        raise IndexError
    return index
