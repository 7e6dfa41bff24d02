"""What would make a refused problem feasible, found by calculation and proved by a second plan before it is offered."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import ClearanceUnproved, Collision, InfeasibleDuration
from planner.planning.remedies.collisions import collision_remedies
from planner.planning.remedies.durations import duration_remedies
from planner.planning.remedies.holding import holding_remedies

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.errors import LimitsUnsatisfiable, Remedy
    from planner.paths import JointPath
    from planner.problems.problem import PlanningProblem


def remedies_for(
    refusal: InfeasibleDuration | LimitsUnsatisfiable | Collision | ClearanceUnproved,
    problem: PlanningProblem,
    backend: BackEnd,
    path: JointPath,
) -> list[Remedy]:
    """Remedies for what a back end refuses.

    Those that change durations belong together, so do those that change limits, and the payload; each such group is a
    way by itself.

    Args:
        refusal: The refusal of the back end.
        problem: The problem that is refused.
        backend: That refuses it; each remedy is proved with it.
        path: The path of the problem.
    """
    if isinstance(refusal, InfeasibleDuration):
        return duration_remedies(refusal, problem, backend, path)
    if isinstance(refusal, Collision | ClearanceUnproved):
        return collision_remedies(refusal, problem, backend, path)
    return holding_remedies(problem, backend, path)


__all__ = ["remedies_for"]
