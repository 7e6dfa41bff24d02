"""Pictures of plans, robots and workspaces, by matplotlib, which only `planner.plots.picture` loads."""

from planner.plots.quantities import joint_indices

__all__ = ["joint_indices"]
