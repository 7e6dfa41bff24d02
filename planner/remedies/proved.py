"""Changes of a problem that are known to help, since the changed problem has been planned."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from planner.errors import PlanningError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.errors import Remedy
    from planner.plan import Plan
    from planner.problem import PlanningProblem
    from planner.remedies.higher_limits import Change

PlanOf = Callable[["PlanningProblem"], "Plan"]
"""The plan of a problem; raises its refusal."""


def first_proved(changes: Iterable[Change], plan_of: PlanOf) -> list[Remedy]:
    """What the first change with a plan says; nothing where none has one."""
    for changed, remedies in changes:
        try:
            plan_of(changed)
        except PlanningError:
            continue
        return remedies
    return []
