"""Meshes of triangles, read from files that nobody trusts, and cut into convex pieces."""
