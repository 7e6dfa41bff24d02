"""Attempts at a shorter duration: open waypoints move, blends change their radii, and detours their corners."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import monotonic

import numpy as np

from planner.free_motion.detours import with_moved_ends
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused, is_unmade
from planner.planning.better_detours import with_better_detour
from planner.planning.candidate_detours import CHECKS_OF_A_PLAN
from planner.planning.off_path.search import Candidate, Search
from planner.plans.optimisation import Optimisation
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import PlanningProblem
from planner.trajectories.trajectory import PlanWarning

MOST_ITERATES = 100
"""The most trajectories that are timed by default: 0.5 to 5 s."""

WAYPOINTS_SHARE = 0.5
"""The share of the time budget for waypoints and blends, where detours have corners that move afterwards."""


def with_shorter_duration(first: Proposals[Outcome]) -> Proposals[Outcome]:
    """Shorten the duration of a plan within the open coordinates of its request.

    Args:
        first: What leads to the plan. The time budget includes it.

    Returns:
        A plan that is no longer, with its `optimisation`; or the refusal.
    """
    begun = monotonic()
    planned = yield from first
    if isinstance(planned, Refused):
        return planned
    problem, before = planned.attempt.problem, planned.plan.trajectory.duration
    end = inf if problem.time_budget is None else begun + problem.time_budget
    most = problem.optimise_iterates or (MOST_ITERATES if problem.time_budget is None else inf)
    detours = enumerate(planned.plan.detours)
    corners = [k for k, detour in detours if detour.has_corners and _is_left_open(problem, detour.waypoint)]
    search, iterates = Search(planned), 0
    if search.is_empty and not corners:
        message = (
            "`optimise` has no effect: no joint position, no radius of a blend and no corner of a free motion is open"
        )
        planned = planned.saying([PlanWarning("nothing_to_optimise", message)])
    elif not search.is_empty:
        left = end - monotonic()
        until = end - (1.0 - WAYPOINTS_SHARE) * left if corners and end < inf else end
        planned, iterates = yield from _with_moved_waypoints(planned, search, most, until)
    for count, number in enumerate(corners):
        now = monotonic()
        until = now + (end - now) / (len(corners) - count)
        planned = yield from with_better_detour(planned, number, "duration", CHECKS_OF_A_PLAN * most, until)
        gain = planned.plan.detours[number].gain
        iterates += 0 if gain is None else gain.candidates
    radii = {k: radius for k, radius in search.best.radii.items() if radius != search.first.radii[k]}
    report = Optimisation(before, planned.plan.trajectory.duration, iterates, search.moved(search.best), radii)
    return Planned(planned.attempt, replace(planned.plan, optimisation=report))


def _is_left_open(problem: PlanningProblem, waypoint: int) -> bool:
    """Tell whether the free motion to a waypoint has no objective of its own."""
    motion = problem.waypoints[waypoint].motion
    return isinstance(motion, FreeMotion) and motion.optimise is None


def _with_moved_waypoints(
    planned: Planned, search: Search, most: float, until: float
) -> Proposals[tuple[Planned, int]]:
    """Try candidates; return the best plan, and the number of trajectories that were timed.

    It tries no more than `most` candidates, and ends at the time `until`, s on the monotonic clock.
    """
    seed, first = planned.attempt.problem.inverse_kinematics.seed, planned.attempt
    number, iterates, longest = 0, 0, 0.0
    while number < most and monotonic() + longest < until:
        begun = monotonic()
        candidate = search.candidate(number, np.random.default_rng([seed, number]))
        number += 1
        if candidate is None:
            continue
        iterates += 1
        attempt = _attempt_at(candidate, search, first)
        outcome = yield replace(attempt, better_than=("duration", planned.plan.trajectory.duration))
        if is_unmade(outcome):
            break
        if isinstance(outcome, Planned):
            planned = replace(outcome, attempt=replace(outcome.attempt, better_than=None))
        search.learn(candidate, is_better=isinstance(outcome, Planned))
        longest = max(longest, monotonic() - begun)
    return planned, iterates


def _attempt_at(candidate: Candidate, search: Search, first: Attempt) -> Attempt:
    """Return the attempt with the joint positions and the radii of a candidate."""
    moved = search.moved(candidate)
    attempt = first.blended({k: radius for k, radius in candidate.radii.items() if radius != search.first.radii[k]})
    return replace(attempt, moved=moved, detours=with_moved_ends(first.detours or (), moved))
