"""Pictures of plans, robots and workspaces, by matplotlib, which only `planner.plots.picture` loads."""
