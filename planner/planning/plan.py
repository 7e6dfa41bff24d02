"""The one way through: check the problem, solve its path, put time on it, certify; refuse with remedies, or return."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.backends import as_backend
from planner.backends.splines.cubic import Cubic
from planner.errors import (
    ClearanceUnproved,
    Collision,
    InfeasibleDuration,
    JointPositionLimit,
    LimitsUnsatisfiable,
    PlanningError,
)
from planner.free_motion.ways import free_waypoints
from planner.paths import solve_path
from planner.planning.better_detours import plan_free_motions
from planner.planning.remedies import remedies_for
from planner.planning.remedies.proved import proved
from planner.plans.smaller_blends import plan_with_free_blends
from planner.problems.check import check_problem

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem


def plan(problem: PlanningProblem, backend: BackEnd | str = Cubic()) -> Plan:
    """Plan a certified trajectory.

    Args:
        problem: What is asked: robot, waypoints, limits.
        backend: The back end that puts time on the path, or its kind, for example `"ruckig"`: one with default options.

    Raises:
        PlanningError: Of the kind that says why there is no plan, with remedies where there are any.
        TypeError: The back end is none.
        ValueError: No back end is of this kind.
    """
    backend = as_backend(backend)
    try:
        check_problem(problem, backend)
        if free_waypoints(problem):
            return plan_free_motions(problem, backend)
        path = solve_path(problem)
    except PlanningError as refusal:
        _try_remedies(refusal, problem, backend)
        raise
    try:
        return plan_with_free_blends(problem, backend, path)
    except (JointPositionLimit, LimitsUnsatisfiable) as refusal:
        _try_remedies(refusal, problem, backend)
        if isinstance(refusal, LimitsUnsatisfiable) and not refusal.remedies:
            refusal.remedies = tuple(remedies_for(refusal, problem, backend, path))
        raise
    except (InfeasibleDuration, Collision, ClearanceUnproved) as refusal:
        refusal.remedies = tuple(remedies_for(refusal, problem, backend, path))
        raise


def _try_remedies(refusal: PlanningError, problem: PlanningProblem, backend: BackEnd) -> None:
    """Leave those remedies of a refusal that lead to a plan; the others become hints."""
    tried = [(remedy, proved([remedy], problem, backend)) for remedy in refusal.remedies]
    refusal.remedies = tuple(remedy for _, helping in tried for remedy in helping)
    refusal.hints = tuple(remedy for remedy, helping in tried if not helping)
