"""Roadmaps: built, proved again where a scene changes, and searched."""

from planner.free_motion.roadmaps.digests import is_current

__all__ = ["is_current"]
