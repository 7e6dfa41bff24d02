"""Remedies proved by attempts: the changed problem is planned as it will be when it is requested."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.backends.base import without_search
from planner.errors import Remedy
from planner.planning.attempts import Attempt, Planned
from planner.planning.variants import planned

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.planning.attempts import Outcome, Proposals
    from planner.plans.result import Plan

Change = list[Remedy]
"""Remedies to be applied together."""


def plan_with(remedies: Iterable[Remedy], attempt: Attempt) -> Proposals[Outcome]:
    """Plan the problem of a refused attempt with remedies applied to it.

    A back end that searches makes the plan before its search, and detours stay as they are found: what the problem with
    the remedies is planned with is no worse.
    """
    problem, backend = attempt.problem, attempt.backend
    for remedy in remedies:
        problem, backend = remedy.applied_to(problem), remedy.applied_to_backend(backend)
    return (yield from planned(Attempt(problem, without_search(backend))))


def of_plan(remedies: Iterable[Remedy], plan: Plan) -> Change:
    """Return remedies with the duration of the plan to which they lead together."""
    return [replace(remedy, duration=plan.trajectory.duration) for remedy in remedies]


def proved(remedies: Change, attempt: Attempt) -> Proposals[Change]:
    """Return remedies that lead to a plan together, with its duration; none where they do not."""
    outcome = yield from plan_with(remedies, attempt)
    return of_plan(remedies, outcome.plan) if isinstance(outcome, Planned) else []


def first_proved(changes: Iterable[Change], attempt: Attempt) -> Proposals[Change]:
    """Return the first of some changes that leads to a plan; none where no change does."""
    for remedies in changes:
        helping = yield from proved(remedies, attempt)
        if helping:
            return helping
    return []
