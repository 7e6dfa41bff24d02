"""Free motions: collision-free paths of proved straight joint motions."""

from planner.free_motion.detours import Detour, Gain, last_of, with_detours
from planner.free_motion.fixed import with_fixed
from planner.free_motion.free_path import FreePath, find_free_path

__all__ = ["Detour", "FreePath", "Gain", "find_free_path", "last_of", "with_detours", "with_fixed"]
