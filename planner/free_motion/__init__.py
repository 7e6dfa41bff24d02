"""A way around what is near a robot: joint motions that are proved free, one after the other."""

from planner.free_motion.way import Way, find_way

__all__ = ["Way", "find_way"]
