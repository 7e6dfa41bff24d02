"""Changes of a problem that are known to help, since the changed problem has been planned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.backends.base import Searching
from planner.errors import PlanningError
from planner.free_motion.ways import free_waypoints
from planner.free_planning import plan_around
from planner.paths import solve_path
from planner.problem_check import check_problem
from planner.result import certified_plan

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.backends.base import BackEnd
    from planner.errors import Remedy
    from planner.problem import PlanningProblem
    from planner.remedies.higher_limits import Change
    from planner.result import Plan


def plan_with(remedies: Iterable[Remedy], problem: PlanningProblem, backend: BackEnd) -> Plan:
    """Return the plan of a problem with remedies applied to it; of a back end that searches, the one before its search.

    Raises:
        PlanningError: It has none, either.
    """
    for remedy in remedies:
        problem, backend = remedy.applied_to(problem), remedy.applied_to_backend(backend)
    check_problem(problem, backend)
    at_once = backend.without_search() if isinstance(backend, Searching) else backend
    if free_waypoints(problem):
        return plan_around(problem, at_once)
    return certified_plan(problem, at_once, solve_path(problem))


def proved(remedies: Iterable[Remedy], problem: PlanningProblem, backend: BackEnd) -> tuple[Remedy, ...]:
    """Those remedies each of which by itself leads to a plan."""
    helping = []
    for remedy in remedies:
        try:
            plan_with([remedy], problem, backend)
        except PlanningError:
            continue
        helping.append(remedy)
    return tuple(helping)


def first_proved(changes: Iterable[Change], problem: PlanningProblem, backend: BackEnd) -> list[Remedy]:
    """Return the first change with which the problem has a plan; none where it has one with no change."""
    for remedies in changes:
        try:
            plan_with(remedies, problem, backend)
        except PlanningError:
            continue
        return remedies
    return []
