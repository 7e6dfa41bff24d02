"""The one way through: plan the problem or a variant of it, or refuse with remedies that are proved."""

from __future__ import annotations

from math import inf
from time import monotonic

from planner.backends import as_backend
from planner.backends.base import BackEnd
from planner.backends.splines.cubic import Cubic
from planner.planning.attempts import Attempt, Budget, Proposals, Refused, run
from planner.planning.improved import improved
from planner.planning.option_choice import with_chosen_options
from planner.planning.remedies import remedies_for
from planner.planning.rides.in_order import with_earliest_rides
from planner.plans.result import Plan
from planner.problems.any_of import goal_sets
from planner.problems.problem import PlanningProblem
from planner.problems.rides import rides_of

DEFAULT = Budget()
"""The default budget of a plan."""


def plan(problem: PlanningProblem, backend: BackEnd | str = Cubic(), budget: Budget = DEFAULT) -> Plan:
    """Plan a certified trajectory.

    Args:
        problem: The robot, the waypoints and the limits. Of each goal set (`AnyOf`) the plan has one option.
        backend: The back end that puts time on the path, or its kind, for example `"ruckig"`: one with default options.
        budget: The bounds on the variants and remedies that are tried.

    Raises:
        PlanningError: Of the kind that says why there is no plan, with remedies where there are any.
        TypeError: The back end is none.
        ValueError: No back end is of this kind.
    """
    attempt = Attempt(problem, as_backend(backend))
    if rides_of(problem):
        return run(with_earliest_rides(attempt), budget)
    if not goal_sets(problem):
        return run(_attempts(attempt), budget)
    seconds = min(inf if limit is None else limit for limit in (budget.seconds, problem.time_budget))
    return run(with_chosen_options(attempt, monotonic() + seconds), budget)


def _attempts(attempt: Attempt) -> Proposals[Plan]:
    """Plan an attempt or a variant of it, and improve the plan; refuse with remedies.

    Raises:
        PlanningError: There is no plan.
    """
    outcome = yield from improved(attempt)
    if isinstance(outcome, Refused):
        remedies, hints = yield from remedies_for(outcome)
        raise outcome.refusal.with_remedies(remedies, hints)
    return outcome.plan
