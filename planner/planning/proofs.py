"""Remedies proved by attempts: the changed problem is planned as it will be when it is requested."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from planner.backends.base import without_search
from planner.errors import Remedy
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused
from planner.planning.variants import planned
from planner.plans.result import Plan
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import AnyWaypoint

Change = list[Remedy]
"""Remedies to be applied together."""


QUICK_CHECKS = 1000
"""The number of motions that a search for a detour checks first when a remedy is tried.

Most detours need fewer, and refusals must not take long.
"""


def plan_with(remedies: Iterable[Remedy], attempt: Attempt, longer: bool = False) -> Proposals[Outcome]:
    """Plan the problem of a refused attempt with remedies applied to it.

    A back end that searches returns the first motion of its search, and detours are not improved. The plan of the
    problem with the remedies is no worse.

    Args:
        remedies: The changes.
        attempt: The refused attempt.
        longer: Whether searches may take long, even where they find nothing.
    """
    problem, backend = attempt.problem, attempt.backend
    for remedy in remedies:
        problem, backend = remedy.applied_to(problem), remedy.applied_to_backend(backend)
    tried = Attempt(problem, without_search(backend))
    quick = replace(problem, waypoints=tuple(map(sought_quickly, problem.waypoints)))
    if not longer and quick.waypoints != problem.waypoints:
        outcome = yield from planned(replace(tried, problem=quick))
        if isinstance(outcome, Refused):
            return outcome
    return (yield from planned(tried))


def sought_quickly(waypoint: AnyWaypoint) -> AnyWaypoint:
    """Return a waypoint to which a free motion is sought among few motions; any other as it is."""
    motion = waypoint.motion
    if not isinstance(motion, FreeMotion) or motion.most_checks <= QUICK_CHECKS:
        return waypoint
    return replace(waypoint, motion=replace(motion, most_checks=QUICK_CHECKS))


def of_plan(remedies: Iterable[Remedy], plan: Plan) -> Change:
    """Return remedies with the duration of the plan to which they lead together."""
    return [replace(remedy, duration=plan.trajectory.duration) for remedy in remedies]


def proved(remedies: Change, attempt: Attempt, longer: bool = False) -> Proposals[Change]:
    """Return remedies that lead to a plan together, with its duration; none where they do not."""
    outcome = yield from plan_with(remedies, attempt, longer)
    return of_plan(remedies, outcome.plan) if isinstance(outcome, Planned) else []


def first_proved(changes: Iterable[Change], attempt: Attempt) -> Proposals[Change]:
    """Return the first of some changes that leads to a plan; none where no change does."""
    for remedies in changes:
        helping = yield from proved(remedies, attempt)
        if helping:
            return helping
    return []
