"""What helps where no detour is found: a longer search, a smaller margin."""

from __future__ import annotations

from planner.errors import NoPathFound, Remedy
from planner.planning.attempts import Proposals, Refused
from planner.planning.proofs import QUICK_CHECKS, proved
from planner.planning.remedies.collisions import smaller_margin
from planner.problems.motion_around import MOST_CHECKS, FreeMotion

LONGER = 8
"""Factor on the motions that a longer search looks at, from `QUICK_CHECKS` up to the default."""


def detour_remedies(refused: Refused, refusal: NoPathFound) -> Proposals[list[Remedy]]:
    """Find changes with each of which the problem has been planned."""
    attempt, at = refused.attempt, (refusal.segment or 0) + 1
    motion = attempt.problem.waypoints[at].motion
    if not isinstance(motion, FreeMotion):
        return []
    field, helping = ("waypoints", at, "motion", "most_checks"), []
    more = min(max(LONGER * motion.most_checks, QUICK_CHECKS), MOST_CHECKS)
    if more > motion.most_checks and not refusal.enclosed_by:
        helping += yield from proved([Remedy(field, more, "a longer search finds a detour")], attempt, longer=True)
    scene = attempt.problem.scene
    if not helping and scene is not None and (scene.margin or any(thing.margin for thing in scene.objects)):
        helping += yield from smaller_margin(attempt, refusal.enclosed_by)
    return helping
