"""The plan of a problem with goal sets: the options with the shortest estimate that have a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from math import inf

import numpy as np

from planner.backends.base import BackEnd
from planner.choices import Choice, OptionOutcome
from planner.errors import (
    Collision,
    Fault,
    InfeasibleDuration,
    InvalidProblem,
    JointPositionLimit,
    MissingDynamics,
    PayloadExceeded,
    PlanningError,
    StartInCollision,
    UnreachableWaypoint,
)
from planner.fields import FieldPath
from planner.planning.attempts import Attempt, Proposals, Refused, is_unmade
from planner.planning.improved import improved
from planner.planning.option_estimates import OptionEstimates
from planner.planning.remedies import remedies_for
from planner.plans.result import Plan
from planner.problems.any_of import (
    AnyOf,
    Expansion,
    goal_set_faults,
    goal_sets,
    requested_indices,
    requested_paths,
    waypoints_of,
)
from planner.problems.check import check_problem
from planner.problems.problem import PlanningProblem, RelativeWaypoint, Waypoint
from planner.problems.waypoint_faults import waypoint_faults

COMMON_FIELDS = tuple(field for field in fields(Waypoint) if field.name != "name")
"""The fields of every kind of waypoint that a check of the whole problem reads."""

MOST_KINDS = 4
"""The number of kinds of options that are remembered while options are checked."""


AT_ONE_WAYPOINT = (UnreachableWaypoint, JointPositionLimit, PayloadExceeded, StartInCollision)
"""Refusals that depend on no other waypoint than their own."""


def with_chosen_options(attempt: Attempt, until: float = inf) -> Proposals[Plan]:
    """Plan with the options of the shortest estimate; where they are refused, with the next ones.

    Args:
        attempt: The attempt at the problem with its goal sets.
        until: The time on the monotonic clock, s, from which no further option is compared.

    Raises:
        PlanningError: No option has a plan: the refusal of the first one that was planned, with remedies.
    """
    problem = attempt.problem
    check_options(problem, attempt.backend)
    estimates = OptionEstimates(problem, until)
    refusals: dict[tuple[int, int], PlanningError] = {}
    first: tuple[dict[int, int], Expansion, Refused] | None = None
    ranked = options = estimates.best()
    while ranked is not None or first is None:
        options = ranked or dict.fromkeys(estimates.goal_sets, 0)
        expansion = Expansion.of(problem, options)
        outcome = yield from improved(replace(attempt, problem=expansion.problem))
        if not isinstance(outcome, Refused):
            choices = _choices(problem, estimates, options, refusals, is_planned=True)
            return replace(outcome.plan, choices=choices)
        first = first or (options, expansion, outcome)
        if is_unmade(outcome) or _is_of_all(outcome.refusal.moved(requested_paths(expansion.problem)), problem):
            break
        at_fault = [requested_indices(expansion.problem)[k] for k in _waypoints_at_fault(outcome.refusal)]
        refusal = outcome.refusal.moved(requested_paths(expansion.problem))
        for k in estimates.refuse(options, at_fault):
            refusals.setdefault((k, options[k]), refusal)
        ranked = estimates.best()
    options, expansion, outcome = first
    remedies, hints = yield from remedies_for(outcome)
    refusal = outcome.refusal.with_remedies(remedies, hints).moved(requested_paths(expansion.problem))
    if ranked is None:
        where = " and ".join(f"option {option} of waypoint {k}" for k, option in options.items())
        none = "no option" if estimates.are_all_solved else "no option compared in time"
        refusal = refusal.with_fields(_text=f"{none} has a plan; with {where}: {refusal._text}")
    raise refusal.with_fields(choices=_choices(problem, estimates, options, refusals, is_planned=False))


def check_options(problem: PlanningProblem, backend: BackEnd) -> None:
    """Check a problem with each option of its goal sets; of options that differ only in poses, with the first.

    Raises:
        InvalidProblem: With all faults of all options.
    """
    faults: list[Fault | tuple[FieldPath, str]] = list(goal_set_faults(problem))
    if faults:
        raise InvalidProblem(faults)

    def check(options: Mapping[int, int]) -> None:
        expansion = Expansion.of(problem, options)
        try:
            check_problem(expansion.problem, backend)
        except InvalidProblem as refusal:
            found = refusal.moved(requested_paths(expansion.problem)).faults
            faults.extend(fault for fault in found if fault not in faults)
        except PlanningError:
            pass  # other options may avoid it; the plan with this option is refused, with remedies

    check({})
    for k, goal_set in goal_sets(problem).items():
        known: list[list[tuple[object, ...]]] = []
        for row, option in enumerate(goal_set.options):
            own = waypoints_of(option)
            kind = [(type(one), *(getattr(one, field.name) for field in COMMON_FIELDS)) for one in own]
            is_alike = kind in known and not any(waypoint_faults(problem.robot, own, problem.inverse_kinematics))
            if row > 0 and not is_alike:
                check({k: row})
            if not is_alike:
                known = [kind, *known[:MOST_KINDS]]
    if faults:
        raise InvalidProblem(faults)


def _is_of_all(refusal: PlanningError, problem: PlanningProblem) -> bool:
    """Tell whether no other option avoids a refusal: one of the request, of its whole duration, or of another pose."""
    if refusal.segment is not None:
        return False
    if refusal.waypoint is None:
        return isinstance(refusal, InvalidProblem | MissingDynamics | InfeasibleDuration)
    depends_on_options = isinstance(problem.waypoints[refusal.waypoint], AnyOf | RelativeWaypoint)
    return isinstance(refusal, AT_ONE_WAYPOINT) and not depends_on_options


def _waypoints_at_fault(refusal: PlanningError) -> list[int]:
    """Return the indices of the waypoints at which a refusal points."""
    if refusal.waypoint is not None:
        return [refusal.waypoint]
    return [] if refusal.segment is None else [refusal.segment, refusal.segment + 1]


def _choices(
    problem: PlanningProblem,
    estimates: OptionEstimates,
    options: Mapping[int, int],
    refusals: Mapping[tuple[int, int], PlanningError],
    *,
    is_planned: bool,
) -> tuple[Choice, ...]:
    """Return the outcomes of all options of all goal sets, beside chosen options at the others."""
    expansion = Expansion.of(problem, options)
    choices = []
    for k in estimates.goal_sets:
        outcomes = []
        durations = estimates.estimates(k, options)
        is_longer = is_planned & (durations >= durations[options[k]])
        for option, duration in enumerate(durations.tolist()):
            refusal = refusals.get((k, option))
            if is_planned and option == options[k]:
                outcome = OptionOutcome("chosen", duration if np.isfinite(duration) else None)
            elif np.isfinite(duration):
                outcome = OptionOutcome("longer" if is_longer[option] else "untried", duration)
            elif refusal is not None:
                outcome = OptionOutcome("refused", code=refusal.code, message=refusal.message)
            elif estimates.is_unreachable(k, option):
                message = "no joint position reaches its waypoints"
                outcome = OptionOutcome("refused", code=UnreachableWaypoint.code, message=message)
            elif estimates.is_colliding(k, option):
                message = "every joint position at one of its waypoints collides"
                outcome = OptionOutcome("refused", code=Collision.code, message=message)
            else:
                outcome = OptionOutcome("untried")
            outcomes.append(outcome)
        first, last = expansion.first[k], expansion.first[k + 1] - 1
        choices.append(Choice(k, options[k] if is_planned else None, first, last, tuple(outcomes)))
    return tuple(choices)
