"""Collision shapes of robots: the convex shapes of their links, and the pairs of links that are checked."""

from planner.robots.collision.mesh_files import KeptPieces, MeshReference, files_of, kept_meshes, meshes_of
from planner.robots.collision.pairs import MANY_POSITIONS, contacts, shapes_of_links

__all__ = [
    "MANY_POSITIONS",
    "KeptPieces",
    "MeshReference",
    "contacts",
    "files_of",
    "kept_meshes",
    "meshes_of",
    "shapes_of_links",
]
