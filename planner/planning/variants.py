"""Variants of a refused attempt: slower corners of detours, smaller blends, and searches that are kept clear."""

from __future__ import annotations

from planner.errors import Collision, InvalidProblem
from planner.planning.attempts import Attempt, Outcome, Proposals, Refused, is_unmade
from planner.planning.blends import LEAST_RADII, Blamed, larger_blends, warnings_of
from planner.planning.clear_searches import kept_clear
from planner.problems.blend_radii import blend_radii


def planned(attempt: Attempt) -> Proposals[Outcome]:
    """Plan an attempt or, where it is refused, the variant of it that is passed as smoothly as stays free.

    Returns:
        The plan; the refusal with the slowest corners, its blends as requested, where no variant has a plan.
    """
    blamed: Blamed = {}
    refused = outcome = yield from kept_clear(attempt)
    while isinstance(outcome, Refused):
        variant = _variant_of(outcome, blamed)
        if variant is None:
            return refused
        outcome = yield from kept_clear(variant)
        if not blamed and not is_unmade(outcome):
            refused = outcome
    if not blamed:
        return outcome
    outcome = yield from larger_blends(outcome, blend_radii(attempt.problem), blamed)
    return outcome.saying(warnings_of(outcome.attempt.problem, blend_radii(attempt.problem), blamed))


def _variant_of(refused: Refused, blamed: Blamed) -> Attempt | None:
    """Return the attempt with slower corners, and with smallest blends, next to the segment that is refused.

    Where there are none, all detours are passed more slowly. None: nothing is left to be varied.

    `blamed` has the pairs that are too near, by the waypoints whose blends are small already; new ones are added.
    """
    refusal, attempt = refused.refusal, refused.attempt
    if isinstance(refusal, InvalidProblem) or is_unmade(refused) or attempt.detours is None:
        return None
    ends = () if refusal.segment is None else (refusal.segment, refusal.segment + 1)
    slower = {detour: detour.slower() for detour in attempt.detours}
    able = {detour: other for detour, other in slower.items() if other is not None}
    changed = {detour: other for detour, other in able.items() if detour.waypoint in ends[1:]}
    radii = {}
    if isinstance(refusal, Collision):
        radii = {i: LEAST_RADII * r for i, r in blend_radii(attempt.problem).items() if i in ends and i not in blamed}
        blamed |= dict.fromkeys(radii, refusal.pair)
    if not changed and not radii:
        changed = able
    if not changed and not radii:
        return None
    return attempt.along([changed.get(detour, detour) for detour in attempt.detours]).blended(radii)
