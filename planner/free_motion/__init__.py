"""Free motions: collision-free paths of proved straight joint motions."""

from planner.free_motion.free_path import FreePath, find_free_path

__all__ = ["FreePath", "find_free_path"]
