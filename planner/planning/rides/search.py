"""The plan of a problem with a ride: the earliest time at which the robot can get on, and the latest start."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.errors import (
    InfeasibleDuration,
    InvalidProblem,
    LimitsUnsatisfiable,
    MissingDynamics,
    PayloadExceeded,
    PlanningError,
    Remedy,
    StartInCollision,
    UnreachableWaypoint,
)
from planner.planning.attempts import Attempt, Outcome, Planned, Proposals, Refused, is_unmade
from planner.planning.improved import improved
from planner.planning.rides.boarding import Boarding, Boardings
from planner.plans.result import Plan
from planner.plans.ride import RideReport
from planner.problems.any_of import requested_paths
from planner.problems.check import check_problem
from planner.problems.rides import is_riding, rides_of
from planner.robots import Robot
from planner.timing.arrivals import last_stop
from planner.trajectories.trajectory import PlanWarning

TIMES_TRIED = 48
"""The number of times of arrival, all over the time within reach, between which an interval may be missed."""

ARRIVAL_KNOWN_TO = 5e-3
"""How well the earliest time of arrival is found, s."""

AHEAD = 1e-3
"""Time by which the robot is to be there sooner than it just could, s."""

MOST_SOONER = 12
"""The most attempts that make the time of arrival sooner."""

MOST_LATE = 4
"""The most attempts at the latest start."""

LAST_KNOWN_TO = 2e-2
"""How well the last time of arrival is found, s."""

EARLIER = 0.04
"""The share of the time since the earliest arrival by which a late arrival without a plan is made sooner."""

SHARES_OF_SLACK = (1.0, 0.98, 0.9, 0.75)
"""The shares of its time to spare by which the robot may begin later, where other objects are in the way."""

SLOWER = 1.3
"""The factor on the durations of a ride that breaks a limit which is not compared before, such as that of a torque."""

SLOWEST = 4.0
"""The largest product of such factors."""


_SEARCH_ENDED = PlanWarning(
    "ride_search_ended",
    "the search for the earliest arrival and the latest start was ended by its budget: more time may find better ones",
)
"""The warning of a plan whose ride may not be the best."""

AT_ALL_TIMES = (InvalidProblem, MissingDynamics, PayloadExceeded, StartInCollision)
"""Refusals that no other time of arrival avoids."""


def with_ride(attempt: Attempt) -> Proposals[Plan]:
    """Plan with the earliest ride found, and find the latest start.

    Raises:
        PlanningError: No ride has a plan: the reason at the time of arrival that came nearest to one.
    """
    check_problem(attempt.problem, attempt.backend)
    search = _Search(attempt)
    return (yield from search.run())


@dataclass(frozen=True, eq=False)
class _Found:
    """A plan with a ride.

    Attributes:
        boarding: The ride.
        plan: The plan.
        slack: Time that the robot waits for the ride at the stop before, s.
    """

    boarding: Boarding
    plan: Plan
    slack: float


class _Search:
    """The search for rides that have a plan."""

    def __init__(self, attempt: Attempt) -> None:
        self.attempt, self.problem = attempt, attempt.problem
        (self.ride,) = rides_of(self.problem)
        self.boardings = Boardings(self.problem, self.ride)
        self.first = self.problem.waypoints[self.ride.first]
        self.refusals: list[tuple[float, PlanningError]] = []
        self.is_spent = False

    def run(self) -> Proposals[Plan]:
        """Return the plan with the earliest ride, with its report."""
        times = self._times()
        found, failed = yield from self._first(times)
        if found is None:
            raise self._refusal(times)
        found = yield from self._sooner(found, failed)
        latest = self.first.latest_arrival
        if latest is not None and found.boarding.time > latest:
            raise self._late(latest, found)
        start = yield from self._latest_start(found, times)
        path, begin = found.boarding.path, found.boarding.begin
        arrival, end = found.boarding.time, begin + path.duration
        durations = tuple(map(float, (path.lead_in, *path.moves, path.lead_out)))
        report = RideReport(
            waypoint=self.ride.first,
            object=self.ride.thing.id,
            begin=float(begin),
            arrival=float(arrival),
            end=float(end),
            durations=durations,
            latest_start=float(start),
        )
        warnings = (_SEARCH_ENDED, *found.plan.warnings) if self.is_spent else found.plan.warnings
        return replace(found.plan, ride=report, warnings=warnings)

    def _times(self) -> np.ndarray:
        """Return times of arrival (N,), s, from the earliest to the last within reach.

        Raises:
            UnreachableWaypoint: The pose on the object is never within reach then.
        """
        there = self.boardings.path(0.0, self.boardings.durations).poses[0].position
        velocity, reach = self.boardings.velocity, _reach(self.boardings.robot)
        speed = float(np.linalg.norm(velocity))
        nearest = -float(there @ velocity) / speed**2
        away = float(np.linalg.norm(there + nearest * velocity))
        half = np.sqrt(max(reach**2 - away**2, 0.0)) / speed
        stop = self.ride.thing.motion.stop if self.ride.thing.motion is not None else None
        begin, end = max(self.first.earliest_arrival, nearest - half), nearest + half
        end = end if stop is None else min(end, stop)
        if away >= reach or end <= begin:
            earliest = max(self.first.earliest_arrival, 0.0)
            when = earliest if away < reach else max(nearest, earliest)
            nearest_then = float(np.linalg.norm(there + when * velocity))
            raise UnreachableWaypoint(
                f"{self.ride.thing.id!r} is out of reach of {self.boardings.robot.id} from {earliest:g} s on: the pose "
                f"of waypoint {{waypoint}} is {nearest_then:.4g} m from its base at {when:.4g} s, and no pose beyond "
                f"{reach:.4g} m can be reached",
                waypoint=self.ride.first,
                value=nearest_then,
                limit=reach,
            )
        return np.linspace(begin, end, TIMES_TRIED + 1)

    def _attempt(self, boarding: Boarding, later: float = 0.0) -> Proposals[Outcome]:
        problem = self.boardings.problem_with(boarding, later)
        outcome = yield from improved(replace(self.attempt, problem=problem))
        if isinstance(outcome, Refused):
            self.is_spent = is_unmade(outcome)
            refusal = outcome.refusal.moved(requested_paths(problem))
            if isinstance(refusal, AT_ALL_TIMES):
                raise refusal
            if not self.is_spent:
                self.refusals.append((boarding.time, refusal))
        return outcome

    def _found(self, boarding: Boarding, outcome: Planned) -> _Found:
        problem, trajectory = outcome.plan.problem, outcome.plan.trajectory
        k = next(i for i in range(len(problem.waypoints)) if is_riding(problem, i))
        stop = last_stop(problem, k)
        requested = requested_paths(problem)[stop][1]
        dwell = self.problem.waypoints[int(requested)].dwell
        return _Found(boarding, outcome.plan, float(trajectory.departures[stop] - trajectory.arrivals[stop]) - dwell)

    def _tried(self, time: float) -> Proposals[_Found | PlanningError]:
        """Try a time of arrival, s, more slowly where limits of torques or of the tool are broken."""
        while True:
            boarding = self.boardings.at(time)
            if isinstance(boarding, PlanningError):
                self.refusals.append((time, boarding))
                return boarding
            soonest = self.boardings.travel_time(boarding)
            if soonest > boarding.begin:
                return self._not_there(soonest, boarding)
            outcome = yield from self._attempt(boarding)
            if isinstance(outcome, Planned):
                return self._found(boarding, outcome)
            refusal = outcome.refusal
            if isinstance(refusal, InfeasibleDuration) and refusal.limit is not None and self._is_at_ride(outcome):
                return self._not_there(refusal.limit, boarding)
            if not isinstance(refusal, LimitsUnsatisfiable) or self.boardings.slowness * SLOWER > SLOWEST:
                return refusal
            self.boardings.slowness *= SLOWER

    def _is_at_ride(self, refused: Refused) -> bool:
        """Tell whether a late arrival is that where the robot is to get on."""
        index = refused.refusal.waypoint
        path = requested_paths(refused.attempt.problem)
        return index is not None and int(path[index][1]) == self.ride.first

    def _not_there(self, soonest: float, boarding: Boarding) -> InfeasibleDuration:
        """Return the refusal of a ride that begins before the soonest time, s, at which the robot can be there."""
        arrival = soonest + boarding.path.lead_in
        return InfeasibleDuration(
            f"waypoint {{waypoint}} on {self.ride.thing.id!r} cannot be reached at {boarding.time:.6g} s: within the "
            f"limits and the requested durations, the robot would be there at {arrival:.6g} s",
            waypoint=self.ride.first,
            value=boarding.time,
            limit=arrival,
        )

    def _first(self, times: np.ndarray) -> Proposals[tuple[_Found | None, float]]:
        """Return the first ride with a plan, and the last time of arrival, s, before it that has none."""
        last = float(times[-1])
        time, failed = float(times[0]), float(times[0])
        late, beyond = -np.inf, last  # the robot is too late at one time, and the other may be out of reach
        while time <= last:
            found = yield from self._tried(time)
            if isinstance(found, _Found):
                return found, failed
            if self.is_spent:
                break
            failed = time
            if self._is_late(found):
                self.refusals.append((time, found))
                late, time = time, max((found.limit or 0.0) + AHEAD, time + AHEAD)
            else:
                beyond = time
            if late > -np.inf and time >= beyond and beyond - late > ARRIVAL_KNOWN_TO:
                failed, time = late, (late + beyond) / 2.0
            elif time >= beyond:
                time = min((at for at in times.tolist() if at > beyond), default=np.inf)
                late, beyond = -np.inf, last
        return None, failed

    def _is_late(self, refusal: PlanningError) -> bool:
        """Tell whether a ride is refused because it begins before the robot can be there."""
        return isinstance(refusal, InfeasibleDuration) and refusal.waypoint == self.ride.first

    def _sooner(self, found: _Found, failed: float) -> Proposals[_Found]:
        """Make the time of arrival sooner, down to one, s, that has no plan."""
        for _ in range(MOST_SOONER):
            time = found.boarding.time
            if found.slack <= ARRIVAL_KNOWN_TO or time - failed <= ARRIVAL_KNOWN_TO:
                break
            sooner = max(time - found.slack + AHEAD, (failed + time) / 2.0)
            tried = yield from self._tried(sooner)
            if isinstance(tried, _Found):
                found = tried
            elif self.is_spent:
                break
            else:
                failed = sooner
        return found

    def _latest_start(self, found: _Found, times: np.ndarray) -> Proposals[float]:
        """Return the longest rest at the first waypoint, s, with which a plan was made."""
        latest = self.first.latest_arrival
        last = float(times[-1]) if latest is None else min(float(times[-1]), latest)
        known = 0.0
        if found.slack > ARRIVAL_KNOWN_TO:
            known = yield from self._proved_start(found, known)
        if self.is_spent:
            return known
        time = self._last_boarding(found.boarding.time, last)
        for _ in range(MOST_LATE):
            self.boardings.slowness = 1.0
            tried = yield from self._tried(time)
            if self.is_spent:
                break
            if isinstance(tried, _Found):
                return (yield from self._proved_start(tried, known))
            time -= EARLIER * (time - found.boarding.time)
        return known

    def _proved_start(self, found: _Found, known: float) -> Proposals[float]:
        """Return a later start with a ride for which a plan was made, s; none such: the one known."""
        for share in SHARES_OF_SLACK:
            later = float(np.floor((found.slack - AHEAD) * share / AHEAD) * AHEAD)
            if later <= known or self.is_spent:
                break
            outcome = yield from self._attempt(found.boarding, later)
            if isinstance(outcome, Planned):
                return later
        return known

    def _last_boarding(self, first: float, last: float) -> float:
        """Return the last time of arrival, s, at which there is a ride, from one at which there is."""
        if isinstance(self.boardings.at(last), Boarding):
            return last
        while last - first > LAST_KNOWN_TO:
            middle = (first + last) / 2.0
            first, last = (middle, last) if isinstance(self.boardings.at(middle), Boarding) else (first, middle)
        return first

    def _late(self, latest: float, found: _Found) -> InfeasibleDuration:
        """Return the refusal of a ride that has to begin too soon, with the time that works."""
        arrival = float(np.ceil(found.boarding.time / AHEAD) * AHEAD)
        remedy = Remedy(
            ("waypoints", self.ride.first, "latest_arrival"),
            arrival,
            "the earliest arrival found on the object",
            found.plan.trajectory.duration,
        )
        return InfeasibleDuration(
            f"waypoint {{waypoint}} on {self.ride.thing.id!r} cannot be reached by {latest:g} s: the earliest arrival "
            f"found is at {found.boarding.time:.6g} s",
            waypoint=self.ride.first,
            value=latest,
            limit=found.boarding.time,
            remedies=[remedy],
        )

    def _refusal(self, times: np.ndarray) -> PlanningError:
        """Return the reason why no time of arrival has a plan."""
        middle = float(times.mean())
        late = [own for own in self.refusals if isinstance(own[1], InfeasibleDuration)]
        time, refusal = late[-1] if late else min(self.refusals, key=lambda own: float(abs(own[0] - middle)))
        within = f"on {self.ride.thing.id!r} from {times[0]:.4g} to {times[-1]:.4g} s"
        known = f"no time of arrival {within} has a plan"
        if self.is_spent:
            known = f"no plan was found for a time of arrival {within} before the budget of attempts ended"
        return refusal.with_fields(_text=f"{known}; at {time:.4g} s: {refusal._text}")


def _reach(robot: Robot) -> float:
    """Return a distance from the base, m, beyond which the tool cannot be."""
    placements = robot.model.jointPlacements.tolist()[1:]
    travels = [max(abs(joint.lower), abs(joint.upper)) for joint in robot.joints if not joint.is_angle]
    tip = robot.model.frames[robot.tool_frame_id].placement
    return float(sum(np.linalg.norm(one.translation) for one in (*placements, tip)) + sum(travels))
