"""Detours of a plan, made better one after the other."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import monotonic

from planner.free_motion.detours import LADDER, Gain, ends_of_detour, free_waypoints, kept_poses
from planner.free_motion.edges import FreeEdges
from planner.free_motion.objectives import Estimate, value_of
from planner.planning.attempts import NotBetter, Outcome, Planned, Proposals, Refused
from planner.planning.candidate_detours import CandidateDetours
from planner.problems.motion_around import OPTIMISE_CHECKS, FreeMotion, Objective
from planner.spatial import FloatArray


def with_better_detours(first: Proposals[Outcome]) -> Proposals[Outcome]:
    """Improve the detours of a plan one by one, a little or as requested; straight ones stay.

    Args:
        first: What leads to the plan. Time budgets include it.

    Returns:
        A plan that is no worse by the objectives, with the gains in its `detours`; or the refusal.
    """
    until = monotonic()
    planned = yield from first
    if isinstance(planned, Refused):
        return planned
    for number, index in enumerate(free_waypoints(planned.attempt.problem)):
        motion = planned.attempt.problem.waypoints[index].motion
        if isinstance(motion, FreeMotion) and motion.optimise is None:
            planned = yield from _with_quicker(planned, number)
        elif isinstance(motion, FreeMotion) and motion.optimise is not None:
            until += motion.time_budget or 0.0
            most = OPTIMISE_CHECKS if motion.time_budget is None else inf
            end = inf if motion.time_budget is None else until
            planned = yield from with_better_detour(
                planned, number, motion.optimise, motion.optimise_checks or most, end
            )
    return planned


def _with_quicker(planned: Planned, number: int) -> Proposals[Planned]:
    """Take one change of a detour, where the trajectory is quicker with it."""
    if not planned.plan.detours[number].has_corners:
        return planned
    positions = _candidates(planned, number, "duration", inf, inf).at_once()
    if positions is None:
        return planned
    outcome = yield from _along(planned, number, positions, ("duration", planned.plan.trajectory.duration), inf)
    return outcome if isinstance(outcome, Planned) else planned


def with_better_detour(
    planned: Planned, number: int, objective: Objective, most: float, until: float
) -> Proposals[Planned]:
    """Improve one detour.

    It looks at no more than `most` motions, and ends at the time `until`, s on the monotonic clock.
    """
    first = value = _value(planned, objective)
    timed, checks, longest = 0, 0, 0.0
    if planned.plan.detours[number].has_corners:
        candidates = _candidates(planned, number, objective, most, until)
        for positions in candidates:
            begun = monotonic()
            if begun + longest > until:
                break
            timed += 1
            outcome = yield from _along(planned, number, positions, (objective, value), until)
            if isinstance(outcome, Planned):
                planned, candidates.best = outcome, positions
                value = _value(planned, objective)
            longest = max(longest, monotonic() - begun)
        checks = candidates.edges.checked
    detours = list(planned.plan.detours)
    detours[number] = replace(detours[number], gain=Gain(objective, first, value, timed, checks))
    return Planned(planned.attempt.along(detours), replace(planned.plan, detours=tuple(detours)))


def _value(planned: Planned, objective: Objective) -> float:
    return value_of(objective, planned.plan.path, planned.plan.trajectory)


def _candidates(planned: Planned, number: int, objective: Objective, most: float, until: float) -> CandidateDetours:
    """Return where other detours come from. Only after the last free motion no other detour begins where it ends."""
    problem, detours = planned.attempt.with_moved, planned.plan.detours
    own = detours[number]
    ends = ends_of_detour(problem, detours[:number], own.waypoint)
    if number < len(detours) - 1:
        ends = ends._replace(goals=own.positions[-1:])
    edges = FreeEdges(ends.checker, most, kept_poses(problem, own.waypoint))
    edges.until = until
    cost = Estimate(objective, planned.plan.path, planned.plan.problem.numbers.index(own.waypoint) - 1)
    return CandidateDetours(problem.robot, ends, own.positions, cost, edges, problem.inverse_kinematics.seed)


def _along(
    planned: Planned, number: int, positions: FloatArray, better_than: tuple[Objective, float], until: float
) -> Proposals[Outcome | None]:
    """Plan along another detour (positions, joints), as smoothly as stays free; None: it is no better."""
    detours = list(planned.plan.detours)
    for transition in LADDER:
        if monotonic() > until:
            return None
        detours[number] = replace(detours[number], positions=positions, transition=transition, gain=None)
        outcome = yield replace(planned.attempt.along(detours), better_than=better_than)
        if isinstance(outcome, Planned):
            return replace(outcome, attempt=replace(outcome.attempt, better_than=None))
        if isinstance(outcome.refusal, NotBetter):
            return None
    return None
