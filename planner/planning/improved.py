"""A plan with all its improvements: better detours, and a shorter duration if its problem requests it."""

from __future__ import annotations

from planner.planning.attempts import Attempt, Outcome, Proposals
from planner.planning.better_detours import with_better_detours
from planner.planning.moving import clear_of_moving_objects


def improved(attempt: Attempt) -> Proposals[Outcome]:
    """Plan an attempt or a variant of it, and improve the plan."""
    first = with_better_detours(clear_of_moving_objects(attempt))
    if attempt.problem.optimise is None:
        return (yield from first)
    from planner.planning.off_path.shorter import with_shorter_duration  # here: scipy's optimisers load slowly

    return (yield from with_shorter_duration(first))
