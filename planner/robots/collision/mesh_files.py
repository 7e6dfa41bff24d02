"""Finds the meshes that a URDF names: in a folder, among uploaded files or kept pieces, and nowhere else."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias
from urllib.parse import unquote

from planner.shapes import ConvexHull
from planner.shapes.meshes.files import MeshPieces, mesh_pieces
from planner.shapes.meshes.mesh import MAX_BYTES
from planner.spatial import FloatArray


class MeshReference(NamedTuple):
    """A mesh that a description names.

    Attributes:
        name: The name of the file there.
        scale: Factors of x, y and z.
    """

    name: str
    scale: tuple[float, float, float]


FILE = "file://"
"""How the address of a file on the machine that wrote a URDF begins."""

FindFile: TypeAlias = "Callable[[str], bytes | None]"
"""What gives the bytes of a mesh by the name that a URDF has for it; None: it is not there."""

FindPieces: TypeAlias = "Callable[[MeshReference], MeshPieces | None]"
"""What gives the convex pieces of a mesh; None: it is not there. It raises `InvalidMesh`."""

KeptPieces: TypeAlias = "Mapping[MeshReference, Sequence[FloatArray]]"
"""The corners (N, 3) of the convex pieces of each mesh, m."""


def no_meshes(reference: MeshReference | str) -> None:
    """Find nothing: a document without files beside it."""


def meshes_of(meshes: Path | Mapping[str, bytes] | FindPieces | None) -> FindPieces:
    """Return what finds meshes in a folder, among files by their paths, or nothing."""
    if meshes is None:
        return no_meshes
    if callable(meshes):
        return meshes
    return partial(_pieces_of_file, files_of(meshes))


def files_of(meshes: Path | Mapping[str, bytes] | FindPieces | None) -> FindFile:
    """Return what finds the files of meshes in a folder or among files; where only pieces are kept, nothing."""
    if meshes is None or callable(meshes):
        return no_meshes
    return meshes_in_folder(meshes) if isinstance(meshes, Path) else meshes_among(meshes)


def kept_meshes(kept: KeptPieces) -> FindPieces:
    """Return what finds the pieces of meshes that were cut before."""
    return partial(_pieces_among, kept)


# What finds meshes is kept by robots, which are pickled: a function of a module with its first argument, no closure.


def _pieces_of_file(find: FindFile, reference: MeshReference) -> MeshPieces | None:
    data = find(reference.name)
    return None if data is None else mesh_pieces(reference.name, data, reference.scale)


def _pieces_among(kept: KeptPieces, reference: MeshReference) -> MeshPieces | None:
    return None if reference not in kept else MeshPieces.of(ConvexHull(corners) for corners in kept[reference])


def meshes_in_folder(folder: Path) -> FindFile:
    """Find meshes in a folder that has one folder for each package, or is the folder of the only package.

    Of a `file://` address or an absolute path the longest tail that is a path in the folder counts: the folder may have
    been copied. Links that lead out of the folder are not followed.
    """
    return partial(_file_in_folder, folder.resolve())


def _file_in_folder(root: Path, reference: str) -> bytes | None:
    names = candidates(reference)
    for name in tails(names[0]) if names and reference.startswith((FILE, "/")) else names:
        file = (root / name).resolve()
        if file.is_relative_to(root) and file.is_file():
            with file.open("rb") as opened:
                return opened.read(MAX_BYTES + 1)
    return None


def meshes_among(files: Mapping[str, bytes]) -> FindFile:
    """Find meshes among files by their names.

    If no file has the mesh's path in the package, with or without the package name, the longest matching end of the
    path decides. Archives may thus start at any folder.

    Args:
        files: The bytes by paths with `/`.
    """
    return partial(_file_among, files)


def _file_among(files: Mapping[str, bytes], reference: str) -> bytes | None:
    for name in candidates(reference):
        if name in files:
            return files[name]
    for end in tails((candidates(reference) or [""])[0]):
        found = [name for name in files if name == end or name.endswith(f"/{end}")]
        if found:
            return files[found[0]] if len(found) == 1 else None
    return None


def tails(path: str) -> list[str]:
    """Return a path and all its ends, the longest first: `a/b/c`, `b/c` and `c`."""
    parts = path.split("/")
    return ["/".join(parts[first:]) for first in range(len(parts))]


def candidates(reference: str) -> list[str]:
    """Return the paths that a mesh of a URDF may have: with the name of its package, and without.

    A mesh on another machine, or at a path that leads out of the package, has none. A `file://` address or an
    absolute path has the path below the root of the machine that wrote it, to be found by its tails.

    Args:
        reference: `package://package/path`, `model://package/path`, `file:///path`, an absolute or a relative path.
    """
    if reference.startswith(FILE):
        reference = unquote(reference.removeprefix(FILE))
    if reference.startswith("/"):
        reference = reference.lstrip("/")
    scheme, separator, rest = reference.partition("://")
    if separator and scheme not in ("package", "model"):
        return []
    path = posixpath.normpath(rest if separator else reference)
    if path.startswith(("/", "..")) or "\\" in path or "\0" in path or path == ".":
        return []
    inside = path.partition("/")[2]
    return [path, inside] if separator and inside else [path]
