"""Free motions: collision-free paths of proved straight joint motions."""

from planner.free_motion.detours import Detour, Gain, with_detours
from planner.free_motion.free_path import FreePath, find_free_path

__all__ = ["Detour", "FreePath", "Gain", "find_free_path", "with_detours"]
