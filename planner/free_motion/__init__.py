"""Free motions: collision-free paths of proved straight joint motions."""

from planner.free_motion.way import Way, find_way

__all__ = ["Way", "find_way"]
