"""Reading of meshes, STL, OBJ and DAE, with a cache of the convex pieces last used."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np

from planner.last_used import LastUsed
from planner.shapes.hulls import ConvexHull, hull_volume
from planner.shapes.meshes.dae import read_dae
from planner.shapes.meshes.mesh import MAX_BYTES, MAX_TRIANGLES, InvalidMesh, Mesh, check_count
from planner.shapes.meshes.pieces import convex_pieces, tight_pieces
from planner.shapes.shape import InvalidShape
from planner.spatial import FloatArray

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


MOST_BYTES_KEPT = 2**25
"""Largest size of the cached pieces, bytes: the pieces of a hundred links."""

READERS: dict[str, Callable[[bytes], Mesh]] = {".stl": read_stl, ".obj": read_obj, ".dae": read_dae}
"""What reads a file, by the end of its name in lower case."""


def read_mesh(name: str, data: bytes) -> Mesh:
    """Read a mesh.

    Args:
        name: Name of the file, whose suffix gives the format: `.stl`, `.obj` or `.dae`.
        data: Its bytes.

    Raises:
        InvalidMesh: It cannot be read, or is too large.
    """
    end = PurePosixPath(name).suffix.lower()
    if end not in READERS:
        raise InvalidMesh(
            f"a file {end or 'without a kind'} cannot be read; the readable formats are {', '.join(READERS)}"
        )
    if len(data) > MAX_BYTES:
        raise InvalidMesh(f"it has more than {MAX_BYTES} bytes")
    return READERS[end](data)


class MeshPieces(NamedTuple):
    """A mesh as convex pieces.

    Attributes:
        hulls: The pieces, which cover the surface of the mesh.
        size: Lengths of the sides of the box around the mesh (3,), m.
        excess: The volume of the pieces relative to the one of the mesh, if that is closed.
    """

    hulls: tuple[ConvexHull, ...]
    size: FloatArray
    excess: float = 1.0

    @classmethod
    def of(cls, hulls: Iterable[ConvexHull]) -> MeshPieces:
        """Return pieces that were cut before, of a mesh that is not known any more."""
        pieces = tuple(hulls)
        corners = np.concatenate([hull.vertices for hull in pieces])
        return cls(pieces, np.ptp(corners, axis=0))


def mesh_pieces(name: str, data: bytes, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> MeshPieces:
    """Read a mesh and cut it into convex pieces, once for the same content.

    Args:
        name: Name of the file, whose suffix gives the format: `.stl`, `.obj` or `.dae`.
        data: Its bytes.
        scale: Factors of x, y and z.

    Raises:
        InvalidMesh: It cannot be read, or is too large.
    """
    key = hashlib.sha256(data).digest(), PurePosixPath(name).suffix.lower(), tuple(scale)
    return _KEPT.get(key, lambda: _cut(read_mesh(name, data).scaled(np.array(scale))))


def tight_mesh_pieces(mesh: Mesh) -> tuple[ConvexHull, ...]:
    """Cut a mesh into convex pieces that leave its cavities open, once for the same triangles.

    Raises:
        InvalidShape: A piece is no shape.
    """
    key = hashlib.sha256(mesh.triangles.tobytes()).digest()
    return _KEPT.get(key, lambda: MeshPieces(tight_pieces(mesh), mesh.size)).hulls


def _cut(mesh: Mesh) -> MeshPieces:
    try:
        hulls = convex_pieces(mesh)
    except InvalidShape as error:
        raise InvalidMesh(f"it has no convex pieces: {error}") from None
    volume = sum(hull_volume(hull.vertices) for hull in hulls)
    return MeshPieces(hulls, mesh.size, volume / mesh.volume if mesh.volume > 0.0 else np.inf)


_KEPT: LastUsed[MeshPieces] = LastUsed(
    MOST_BYTES_KEPT, lambda pieces: sum(hull.vertices.nbytes + hull.faces.nbytes for hull in pieces.hulls)
)
"""The pieces of the meshes last used, by content."""
