"""Blends that would collide, made as large as stays free."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from planner.errors import Collision
from planner.planning.attempts import Planned, Proposals
from planner.planning.clear_searches import kept_clear
from planner.problems.any_of import requested_indices
from planner.problems.blend_radii import blend_radii
from planner.problems.problem import PlanningProblem
from planner.trajectories.trajectory import PlanWarning

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
