"""Jerk-limited time scalings along a path, shared by all back ends that promise jerk limits."""
