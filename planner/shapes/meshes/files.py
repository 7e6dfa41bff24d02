"""Reading of meshes by the kind of their file, with a cache of the convex pieces last used."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np

from planner.last_used import LastUsed
from planner.shapes.hulls import ConvexHull, hull_volume
from planner.shapes.meshes.dae import read_dae
from planner.shapes.meshes.mesh import MAX_BYTES, InvalidMesh, Mesh
from planner.shapes.meshes.obj import read_obj
from planner.shapes.meshes.pieces import convex_pieces, tight_pieces
from planner.shapes.meshes.stl import read_stl
from planner.shapes.shape import InvalidShape
from planner.spatial import FloatArray

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
