"""The planning problem and the checks of its fields."""

from planner.problems.any_of import Expansion, requested_indices
from planner.problems.blend_radii import blend_radii, with_blend_radii
from planner.problems.motion_around import as_requested
from planner.problems.regions import region_of

__all__ = ["Expansion", "as_requested", "blend_radii", "region_of", "requested_indices", "with_blend_radii"]
