"""Searches of back ends for a better motion, kept clear of obstacles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.backends.base import searches
from planner.certificate.clearance import segment_checkers
from planner.errors import ClearanceUnproved, Collision
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused
from planner.planning.half_spaces import half_spaces_between
from planner.trajectories.trajectory import PlanWarning

DEVIATION_SHARES = (0.3, 0.1)
"""Shares of the deviation allowed within which a search is held, one after the other, where it would collide."""

EXTRA_MARGINS = (0.001, 0.002, 0.004, 0.008)
"""Distances, m, by which pairs that were too near are kept further away than their margins, search after search."""


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
