"""Limits of joints that depend on position, speed or payload."""
