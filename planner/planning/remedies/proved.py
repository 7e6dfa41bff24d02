"""Changes of a problem that are known to help, since the changed problem has been planned."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.backends.base import without_search
from planner.errors import PlanningError
from planner.free_motion.ways import free_waypoints
from planner.paths import solve_path
from planner.planning.detours import plan_around
from planner.plans.result import certified_plan
from planner.problems.check import check_problem

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.backends.base import BackEnd
    from planner.errors import Remedy
    from planner.planning.remedies.higher_limits import Change
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem


def plan_with(remedies: Iterable[Remedy], problem: PlanningProblem, backend: BackEnd) -> Plan:
    """Return the plan of a problem with remedies applied to it; of a back end that searches, the one before its search.

    Raises:
        PlanningError: It has none, either.
    """
    for remedy in remedies:
        problem, backend = remedy.applied_to(problem), remedy.applied_to_backend(backend)
    check_problem(problem, backend)
    at_once = without_search(backend)
    if free_waypoints(problem):
        return plan_around(problem, at_once)
    return certified_plan(problem, at_once, solve_path(problem))


def of_plan(remedies: Iterable[Remedy], plan: Plan) -> list[Remedy]:
    """Return remedies with the duration of the plan to which they lead together."""
    return [replace(remedy, duration=plan.trajectory.duration) for remedy in remedies]


def proved(remedies: Change, problem: PlanningProblem, backend: BackEnd) -> Change:
    """Return remedies that lead to a plan together, with its duration; none where they do not."""
    try:
        return of_plan(remedies, plan_with(remedies, problem, backend))
    except PlanningError:
        return []


def first_proved(changes: Iterable[Change], problem: PlanningProblem, backend: BackEnd) -> Change:
    """Return the first of some changes that leads to a plan; none where no change does."""
    return next((helping for remedies in changes if (helping := proved(remedies, problem, backend))), [])
