"""Robots read from URDF and SRDF, documents that nobody trusts."""
