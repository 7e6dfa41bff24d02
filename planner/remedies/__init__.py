"""What would make a refused problem feasible, found by calculation and proved by a second plan before it is offered."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import InfeasibleDuration
from planner.remedies.durations import duration_remedies
from planner.remedies.holding import holding_remedies

if TYPE_CHECKING:
    from planner.errors import LimitsUnsatisfiable, Remedy
    from planner.paths import JointPath
    from planner.problem import PlanningProblem
    from planner.remedies.proved import PlanOf


def remedies_for(
    refusal: InfeasibleDuration | LimitsUnsatisfiable, problem: PlanningProblem, path: JointPath, plan_of: PlanOf
) -> list[Remedy]:
    """Remedies for what a back end refuses.

    Those that begin alike (`/waypoints/../duration`, `/limits`, `/payload`) belong together; each such group is a way
    by itself.

    Args:
        refusal: Of the back end.
        problem: That is refused.
        path: Of the problem.
        plan_of: A changed problem; raises its refusal.
    """
    if isinstance(refusal, InfeasibleDuration):
        return duration_remedies(refusal, problem, path, plan_of)
    return list(refusal.remedies) or holding_remedies(problem, path, plan_of)


__all__ = ["remedies_for"]
