"""Plans of problems with free motions: ways are found, then timed as smoothly as stays free."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.errors import InvalidProblem, PlanningError
from planner.free_motion.ways import asked_indices, find_ways, with_ways
from planner.paths import solve_path
from planner.plans.result import certified_plan
from planner.problems.problem import ViaWaypoint
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.errors import Remedy
    from planner.free_motion.ways import FoundWay
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem

LADDER = (ThroughTransition(), BlendTransition(0.05), BlendTransition(0.01), StopTransition())
"""How the corners of a way are passed, the fastest first: the next one where the certificate refuses. With stops the
trajectory keeps to the straight motions that have been proved free."""


def plan_around(problem: PlanningProblem, backend: BackEnd) -> Plan:
    """Plan a problem with free motions, free of faults.

    Args:
        problem: What is asked.
        backend: What puts time on the path.

    Returns:
        The plan; its problem has joint motions along the ways in the place of the free ones, see `Plan.ways`.

    Raises:
        NoPathFound: There is no way, or none was found.
        PlanningError: Another refusal; its indices are those of the problem asked.
    """
    ways = find_ways(problem)
    rungs = [0 if way.has_corners else len(LADDER) - 1 for way in ways]
    while True:
        tried = tuple(replace(way, transition=LADDER[rung]) for way, rung in zip(ways, rungs, strict=True))
        try:
            current = with_ways(problem, tried)
            return replace(certified_plan(current, backend, solve_path(current)), ways=tried)
        except PlanningError as refusal:
            asked = asked_indices(problem, ways)
            lower = _at_fault(refusal, ways, rungs, asked)
            if not lower or isinstance(refusal, InvalidProblem):
                raise _as_asked(refusal, current, asked) from None
            rungs = [rung + (k in lower) for k, rung in enumerate(rungs)]


def _at_fault(refusal: PlanningError, ways: tuple[FoundWay, ...], rungs: list[int], asked: list[int]) -> set[int]:
    """Return the numbers of the ways that can be passed more slowly: the one that is refused, or all of them."""
    able = {k for k, rung in enumerate(rungs) if rung + 1 < len(LADDER)}
    if refusal.segment is None:
        return able
    leads_to = asked[refusal.segment + 1]
    own = {k for k in able if ways[k].waypoint == leads_to}
    return own or able


def _as_asked(refusal: PlanningError, current: PlanningProblem, asked: list[int]) -> PlanningError:
    """Return a refusal with the indices of the problem asked; what cannot be changed there is no remedy."""
    if refusal.waypoint is not None:
        refusal.waypoint = asked[refusal.waypoint]
    if refusal.segment is not None:
        refusal.segment = asked[refusal.segment + 1] - 1
    refusal.remedies = tuple(_remedies(refusal.remedies, current, asked))
    return refusal


def _remedies(remedies: tuple[Remedy, ...], current: PlanningProblem, asked: list[int]) -> list[Remedy]:
    found = []
    for remedy in remedies:
        if remedy.field[0] != "waypoints":
            found.append(remedy)
        elif isinstance(index := remedy.field[1], int) and not isinstance(current.waypoints[index], ViaWaypoint):
            found.append(replace(remedy, field=("waypoints", asked[index], *remedy.field[2:])))
    return found
