"""Free motions that would meet a moving object: a detour around the space it takes up, or a wait until it has passed.

The search for a detour knows no time. So the space that the objects take up while the motion lasts counts as an
obstacle. A wait comes where the free motion begins, or another one before. The faster of both is the plan, and its
certificate proves the clearance in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.certificate.clearance import segment_checkers
from planner.errors import ClearanceUnproved, Collision, PlanningError
from planner.free_motion.detours import Detour, find_detour, find_detours, last_of
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused, is_unmade
from planner.planning.moving.swept import with_swept
from planner.planning.moving.waits import waits_for_objects
from planner.planning.proofs import sought_quickly
from planner.planning.variants import is_of_moving_object, planned
from planner.problems.any_of import requested_indices
from planner.problems.motion_around import FreeMotion
from planner.trajectories.trajectory import PlanWarning

FACTORS_OF_DURATION = (1.5, 3.0)
"""The factors on the duration of a free motion, one after the other, for the interval that its detour is clear in."""


def clear_of_moving_objects(attempt: Attempt) -> Proposals[Outcome]:
    """Plan an attempt, and change its free motions where they would meet moving objects.

    Returns:
        The plan; the first refusal where no change of a free motion avoids it.
    """
    first = outcome = yield from planned(attempt)
    if isinstance(first, Planned) or not _is_free(first):
        return first
    while isinstance(outcome, Refused):
        other = (yield from _avoided(outcome)) if _is_free(outcome) else None
        if other is None:
            known = f"no detour that was found avoids {_object_of(first)}, and no wait where a free motion begins"
            return replace(first, refusal=first.refusal.with_fields(_text=f"{first.refusal._text}; {known}"))
        outcome = other
    return outcome


def _is_free(refused: Refused) -> bool:
    """Tell whether a free motion would meet a moving object."""
    problem, refusal = refused.attempt.problem, refused.refusal
    if refused.trajectory is None or refusal.segment is None or not is_of_moving_object(problem, refusal):
        return False
    return isinstance(problem.waypoints[refusal.segment + 1].motion, FreeMotion)


def _avoided(refused: Refused) -> Proposals[Outcome | None]:
    """Change the free motion that would meet a moving object; None: it still would.

    Returns:
        The plan with the shorter duration, or the refusal of a later motion.
    """
    outcomes: list[Outcome] = []
    for factor in FACTORS_OF_DURATION:
        detours = _around(refused, factor)
        if detours is None:
            break
        outcome = yield from planned(refused.attempt.along(detours))
        if is_unmade(outcome):
            return None
        if _is_further(outcome, refused):
            outcomes.append(outcome)
            break
    waited = yield from _waited(refused)
    outcomes += [] if waited is None else [waited]
    plans = [outcome for outcome in outcomes if isinstance(outcome, Planned)]
    if plans:
        return min(plans, key=lambda outcome: outcome.plan.trajectory.duration)
    return outcomes[0] if outcomes else None


def _is_further(outcome: Outcome, refused: Refused) -> bool:
    """Tell whether an attempt has a plan, or is refused for a later motion."""
    if isinstance(outcome, Planned):
        return True
    segment, before = outcome.refusal.segment, refused.refusal.segment
    return _is_free(outcome) and segment is not None and before is not None and segment > before


def _around(refused: Refused, factor: float) -> Sequence[Detour] | None:
    """Return detours, of which that of the refused motion avoids moving objects for longer than it takes; None: none.

    The interval is longer than the refused motion by a factor.
    """
    attempt, trajectory, segment = refused.attempt, refused.trajectory, refused.refusal.segment
    problem, scene = attempt.problem, attempt.problem.scene
    if trajectory is None or segment is None or scene is None or attempt.detours is None:
        return None
    begin = float(trajectory.departures[last_of(attempt.with_detours, segment)])
    last = last_of(attempt.with_detours, segment + 1)
    end = float(trajectory.arrivals[last])
    taken = {take.id for take in problem.waypoints[segment + 1].attach}
    there = segment_checkers(attempt.with_detours, attempt.solved.positions)[last - 1].moving
    things = [thing for thing in there if thing.id not in taken]
    swept = with_swept(scene, things, begin, begin + factor * (end - begin))
    before = [detour for detour in attempt.detours if detour.waypoint <= segment]
    waypoints = list(problem.waypoints)
    waypoints[segment + 1] = sought_quickly(waypoints[segment + 1])
    sought = replace(problem, waypoints=waypoints, scene=swept, roadmap=None)
    try:
        own = find_detour(sought, before, segment + 1)
        return find_detours(problem, [*before, own])
    except PlanningError:
        return None


def _waited(refused: Refused) -> Proposals[Outcome | None]:
    """Wait where a free motion begins; None: no wait helps, or the requested duration leaves no time."""
    attempt = refused.attempt
    problem = attempt.problem
    if problem.duration is not None:
        return None
    for wait, *_ in waits_for_objects(refused):
        number = int(wait.field[1])
        if not isinstance(problem.waypoints[number + 1].motion, FreeMotion):
            continue
        longer, where = wait.value - problem.waypoints[number].dwell, requested_indices(problem)[number]
        text = f"the robot waits {longer:.4g} s longer at waypoint {where}, until {_object_of(refused)} has passed"
        warnings = (PlanWarning("waits_for_object", text), *attempt.warnings)
        outcome = yield from planned(replace(attempt, problem=wait.applied_to(problem), path=None, warnings=warnings))
        if _is_further(outcome, refused):
            return outcome
        if is_unmade(outcome):
            break
    return None


def _object_of(refused: Refused) -> str:
    """Return the name of the moving object that a refusal is about."""
    refusal = refused.refusal
    return refusal.pair[1] if isinstance(refusal, Collision | ClearanceUnproved) else ""
