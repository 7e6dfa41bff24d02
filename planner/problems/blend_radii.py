"""The radii of a problem's blends, and the same problem with others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from planner.problems.problem import PlanningProblem
from planner.problems.transitions import BlendTransition


def blend_radii(problem: PlanningProblem) -> dict[int, float]:
    """Return the radii of the blends, m, by the indices of their waypoints."""
    transitions = enumerate(waypoint.transition for waypoint in problem.waypoints)
    return {i: transition.radius for i, transition in transitions if isinstance(transition, BlendTransition)}


def with_blend_radii(problem: PlanningProblem, radii: Mapping[int, float]) -> PlanningProblem:
    """Return the problem with other radii, m, of some of its blends, by the indices of their waypoints."""
    waypoints = list(problem.waypoints)
    for i, radius in radii.items():
        waypoints[i] = replace(waypoints[i], transition=BlendTransition(radius))
    return replace(problem, waypoints=waypoints)
