"""Changes of a problem that are known to help, since the changed problem has been planned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import PlanningError
from planner.paths import solve_path
from planner.result import certified_plan

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.backends.base import BackEnd
    from planner.errors import Remedy
    from planner.problem import PlanningProblem
    from planner.remedies.higher_limits import Change
    from planner.result import Plan


def plan_again(problem: PlanningProblem, backend: BackEnd) -> Plan:
    """The plan of a changed problem.

    Raises:
        PlanningError: It has none, either.
    """
    return certified_plan(problem, backend, solve_path(problem))


def first_proved(changes: Iterable[Change], backend: BackEnd) -> list[Remedy]:
    """The remedies of the first change with a plan; none where no change has one."""
    for changed, remedies in changes:
        try:
            plan_again(changed, backend)
        except PlanningError:
            continue
        return remedies
    return []
