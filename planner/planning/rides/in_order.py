"""The plan of a problem with rides: each as early as it can be after the ride before, and the latest start of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.errors import PlanningError
from planner.planning.attempts import Attempt, Planned, Proposals, is_unmade
from planner.planning.rides.boarded import with_boarding
from planner.planning.rides.search import AHEAD, ARRIVAL_KNOWN_TO, Found, Search, attempted
from planner.plans.result import Plan
from planner.plans.ride import RideReport
from planner.problems.any_of import ProblemWithOptions
from planner.problems.check import check_problem
from planner.problems.rides import rides_of
from planner.trajectories.trajectory import PlanWarning

SHARES_OF_DELAY = (1.0, 0.96, 0.92, 0.88, 0.7, 0.5, 0.3)
"""The shares of the longest delay of all rides that are tried for the latest start; the first with a plan counts."""

SHARES_OF_SLACK = (1.0, 0.98, 0.9, 0.75)
"""The shares of its time to spare by which the robot may begin later, where other objects are in the way."""

_SEARCH_ENDED = PlanWarning(
    "ride_search_ended",
    "the search for the earliest arrival and the latest start was ended by its budget: more time may find better ones",
)
"""The warning of a plan whose ride may not be the best."""


class _Ridden(NamedTuple):
    """A ride with a plan, and its search."""

    search: Search
    found: Found

    @property
    def problem(self) -> ProblemWithOptions:
        """The problem with this ride and those before."""
        return with_boarding(self.search.boardings, self.found.boarding)


def with_earliest_rides(attempt: Attempt) -> Proposals[Plan]:
    """Plan with the earliest rides found, one after the other, and find the latest start.

    Raises:
        PlanningError: A ride has no plan: the reason at the time of arrival that came nearest to one.
    """
    check_problem(attempt.problem, attempt.backend)
    rides = yield from _in_order(attempt)
    is_spent, start = yield from _latest_start(rides)
    plan = rides[-1].found.plan
    reports = tuple(_report(ride, start) for ride in rides)
    warnings = (_SEARCH_ENDED, *plan.warnings) if is_spent else plan.warnings
    return replace(plan, rides=reports, warnings=warnings)


def _in_order(attempt: Attempt) -> Proposals[list[_Ridden]]:
    """Return the earliest rides found, each one after those before; the last one has the plan.

    Raises:
        PlanningError: A ride has no plan.
    """
    rides: list[_Ridden] = []
    while rides_of(attempt.problem):
        search = Search(attempt)
        rides.append(_Ridden(search, (yield from search.earliest())))
        attempt = replace(attempt, problem=rides[-1].problem)
    return rides


def _report(ride: _Ridden, start: float) -> RideReport:
    boarding = ride.found.boarding
    path = boarding.path
    return RideReport(
        waypoint=ride.search.number,
        object=ride.search.ride.thing.id,
        begin=float(boarding.begin),
        arrival=float(boarding.time),
        end=float(boarding.begin + path.duration),
        durations=tuple(map(float, (path.lead_in, *path.moves, path.lead_out))),
        latest_start=float(start),
    )


def _latest_start(rides: Sequence[_Ridden]) -> Proposals[tuple[bool, float]]:
    """Find the longest rest at the first waypoint, s, with a plan.

    Returns:
        Whether the budget has ended the search; the rest.
    """
    is_spent, known, first = any(ride.search.is_spent for ride in rides), 0.0, rides[0]
    if first.found.slack > ARRIVAL_KNOWN_TO:
        is_spent, known = yield from _proved_start(rides, is_spent, known)
    if is_spent:
        return is_spent, known
    longest = min(ride.search.last(ride.found) - ride.found.boarding.time for ride in rides)
    for share in SHARES_OF_DELAY:
        late, is_spent = yield from _delayed(rides, share * longest)
        if is_spent:
            break
        if late:
            return (yield from _proved_start(late, is_spent, known))
    return is_spent, known


def _delayed(rides: Sequence[_Ridden], delay: float) -> Proposals[tuple[list[_Ridden], bool]]:
    """Plan rides that arrive later by a delay, s.

    Returns:
        The rides, none where there is no plan; whether the budget has ended the search.
    """
    late: list[_Ridden] = []
    attempt = rides[0].search.attempt
    for ride in rides:
        search = Search(attempt)
        tried = yield from search.not_before(ride.found.boarding.time + delay)
        if isinstance(tried, PlanningError):
            return [], search.is_spent
        late.append(_Ridden(search, tried))
        attempt = replace(attempt, problem=late[-1].problem)
    return late, False


def _proved_start(rides: Sequence[_Ridden], is_spent: bool, known: float) -> Proposals[tuple[bool, float]]:
    """Find a start, s, later than the one known, with a plan in which the rides keep their times.

    The robot waits less for the first ride.

    Returns:
        Whether the budget has ended the search; the start, or the one known.
    """
    for share in SHARES_OF_SLACK:
        later = float(np.floor((rides[0].found.slack - AHEAD) * share / AHEAD) * AHEAD)
        if later <= known or is_spent:
            break
        problem = rides[-1].problem
        start, *others = problem.waypoints
        waypoints = (replace(start, dwell=start.dwell + later), *others)
        outcome = yield from attempted(rides[0].search.attempt, replace(problem, waypoints=waypoints))
        is_spent = is_unmade(outcome)
        if isinstance(outcome, Planned):
            return is_spent, later
    return is_spent, known
