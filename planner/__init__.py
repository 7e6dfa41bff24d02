"""Waypoints in, certified joint trajectory out.

The way through is `planner.planning.plan`, from a `planner.problem.PlanningProblem` to a `planner.result.Plan`. Robots
come from `planner.robots`, what can go wrong stands in `planner.errors`, the forms that a plan can leave in
are `planner.export.FORMATS`. Importing this package alone loads nothing: a server that only passes bytes on
stays small.
"""
