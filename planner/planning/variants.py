"""Variants of a refused attempt: slower corners of detours, smaller blends, and searches that are kept clear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from planner.backends.base import searches
from planner.certificate.clearance import segment_checkers
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, PlanningError
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused, is_unmade
from planner.planning.half_spaces import half_spaces_between
from planner.problems.any_of import requested_indices
from planner.problems.blend_radii import blend_radii
from planner.problems.problem import PlanningProblem
from planner.problems.rides import handling_of
from planner.trajectories.trajectory import PlanWarning

DEVIATION_SHARES = (0.3, 0.1)
"""Shares of the deviation allowed within which a search is held, one after the other, where it would collide."""

EXTRA_MARGINS = (0.001, 0.002, 0.004, 0.008)
"""Distances, m, by which pairs that were too near are kept further away than their margins, search after search."""


def is_of_moving_object(problem: PlanningProblem, refusal: PlanningError) -> bool:
    """Tell whether a refusal is about the clearance from an object that moves."""
    if problem.scene is None or not isinstance(refusal, Collision | ClearanceUnproved):
        return False
    put_on_others = (name for done in handling_of(problem) if done.carrier is not None for name in done.put_down)
    return refusal.pair[1] in {thing.id for thing in problem.scene.moving}.union(put_on_others)


def kept_clear(attempt: Attempt) -> Proposals[Outcome]:
    """Plan an attempt, and keep the search of its back end clear of collisions.

    If the result of the search collides, the back end searches again within half spaces that cut off the collision. If
    that gives no free motion, the search stays nearer to its first motion. As a last resort the plan is that first
    motion, if it is free. A warning says so.
    """
    outcome = yield attempt
    backend = attempt.backend
    if isinstance(outcome, Planned) or outcome.trajectory is None or not searches(backend):
        return outcome
    without = backend.without_search()
    if without == backend or not isinstance(outcome.refusal, Collision | ClearanceUnproved):
        return outcome
    first = yield replace(outcome.attempt, backend=without)
    if isinstance(first, Refused):
        return outcome
    if not is_of_moving_object(attempt.problem, outcome.refusal):
        cut_off = yield from _in_half_spaces(outcome, first)
        if cut_off is not None:
            return cut_off
    for share in DEVIATION_SHARES:
        nearer = yield replace(outcome.attempt, backend=backend.held_nearer(share))
        if isinstance(nearer, Planned):
            return _replacing(outcome.attempt, nearer, f"the result stays within {share:g} of the allowed deviation")
    return _replacing(outcome.attempt, first, "the result is the first motion of the search")


def _in_half_spaces(refused: Refused, first: Planned) -> Proposals[Planned | None]:
    """Search repeatedly with more half spaces that cut off collisions; None: no free motion is found."""
    attempt, free, found = refused.attempt, first.plan.trajectory, refused.trajectory
    path, half_spaces = attempt.solved, None
    checkers = segment_checkers(attempt.with_detours, path.positions)
    for ahead in EXTRA_MARGINS:
        if found is None or np.array_equal(found.coefficients, free.coefficients):
            return None
        cut = half_spaces_between(checkers, free, found, ahead)
        half_spaces = cut if half_spaces is None else half_spaces.joined(cut)
        outcome = yield replace(attempt, path=replace(path, half_spaces=half_spaces))
        if isinstance(outcome, Planned):
            return None if np.array_equal(outcome.plan.trajectory.coefficients, free.coefficients) else outcome
        found = outcome.trajectory
    return None


def _replacing(attempt: Attempt, planned: Planned, held: str) -> Planned:
    """Return another back end's plan as the plan of an attempt, with a warning about the restriction."""
    known = [warning for warning in planned.plan.warnings if warning.code != "suboptimal"]
    warning = PlanWarning("suboptimal", f"the optimum of the search would collide: {held}")
    return Planned(attempt, replace(planned.plan, backend=attempt.backend, warnings=(*known, warning)))


LEAST_RADII = 1.0 / 32.0
"""Share of the requested radius below which no blend is tried: a robot that turns as sharply as that nearly stops."""

FINENESS = 0.1
"""How near the largest free blend is found, as a share of its radius: each halving of that takes another attempt."""

Blamed = dict[int, tuple[str, str]]
"""The pairs that are too near with blends as requested, by the indices of their waypoints."""


def larger_blends(planned: Planned, requested: Mapping[int, float], blamed: Blamed) -> Proposals[Planned]:
    """Make small blends larger, one after the other, up to the largest radius that is free.

    Args:
        planned: The plan with small blends.
        requested: The requested radii, m, by the indices of their waypoints.
        blamed: The waypoints whose blends are small; the pairs that larger ones bring too near are noted.
    """
    for corner in sorted(blamed):
        free, refused = blend_radii(planned.attempt.problem)[corner], requested[corner]
        # With several small blends it may be another one that collides: the requested radius is tried first.
        trial = refused if len(blamed) > 1 else (free * refused) ** 0.5
        while refused > free * (1.0 + FINENESS):
            outcome = yield from kept_clear(planned.attempt.blended({corner: trial}))
            if isinstance(outcome, Planned):
                planned, free = outcome, trial
            else:
                refused = trial
                if isinstance(outcome.refusal, Collision):
                    blamed[corner] = outcome.refusal.pair
            trial = (free * refused) ** 0.5
    return planned


def warnings_of(problem: PlanningProblem, requested: Mapping[int, float], blamed: Blamed) -> Iterator[PlanWarning]:
    """Yield a warning for each blend of a planned problem that is smaller than requested."""
    for corner, radius in blend_radii(problem).items():
        if radius < requested[corner]:
            first, second = blamed[corner]
            number = requested_indices(problem)[corner]
            within = f"waypoint {number} is blended within {radius:.6g} m in place of {requested[corner]:g} m"
            message = f"{within}, with which {first} would be too near to {second}"
            yield PlanWarning("blend_reduced", message)


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
    if is_of_moving_object(attempt.problem, refusal):
        return None  # other corners and blends would be as near to it, some milliseconds earlier or later
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
