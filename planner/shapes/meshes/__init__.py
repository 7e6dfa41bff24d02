"""Meshes of triangles, read from untrusted files and cut into convex pieces."""

from planner.shapes.meshes.files import tight_mesh_pieces
from planner.shapes.meshes.mesh import InvalidMesh, Mesh

__all__ = ["InvalidMesh", "Mesh", "tight_mesh_pieces"]
