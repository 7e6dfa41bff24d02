"""The search for one ride: the earliest and the last time at which the robot can get on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.errors import (
    ClearanceUnproved,
    Collision,
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
from planner.planning.rides.boarded import until_next_ride, with_boarding
from planner.planning.rides.boarding import Boarding, Boardings
from planner.plans.result import Plan
from planner.problems.any_of import ProblemWithOptions, requested_paths
from planner.problems.rides import is_riding, rides_of
from planner.robots import Robot
from planner.timing.arrivals import last_stop

TIMES_TRIED = 48
"""The number of times of arrival, all over the time within reach, between which an interval may be missed."""

ARRIVAL_KNOWN_TO = 5e-3
"""How well the earliest time of arrival is found, s."""

AHEAD = 1e-3
"""Time by which the robot is to be there sooner than it just could, s."""

MOST_SOONER = 12
"""The most attempts that make the time of arrival sooner."""

LAST_KNOWN_TO = 2e-2
"""How well the last time of arrival is found, s."""

SLOWER = 1.3
"""The factor on the durations of a ride that breaks a limit which is not compared before, such as that of a torque."""

SLOWEST = 4.0
"""The largest product of such factors."""


AT_ALL_TIMES = (InvalidProblem, MissingDynamics, PayloadExceeded, StartInCollision)
"""Refusals that no other time of arrival avoids."""


@dataclass(frozen=True, eq=False)
class Found:
    """A plan with a ride.

    Attributes:
        boarding: The ride.
        plan: The plan.
        slack: Time that the robot waits for the ride at the stop before, s.
    """

    boarding: Boarding
    plan: Plan
    slack: float


class Search:
    """The search for the first ride of an attempt that has a plan up to the next ride.

    Attributes:
        attempt: The attempt. Earlier rides have their times: see `planner.planning.rides.boarded`.
        boardings: The ride at any time.
        first: Its first waypoint.
        refusals: The reasons against times of arrival, s.
        is_spent: Whether the budget has ended the search.
    """

    def __init__(self, attempt: Attempt) -> None:
        self.attempt, self.problem = attempt, attempt.problem
        self.ride, *_ = rides_of(self.problem)
        self.boardings = Boardings(self.problem, self.ride)
        self.number = self.boardings.number
        self.first = self.problem.waypoints[self.ride.first]
        self.refusals: list[tuple[float, PlanningError]] = []
        self.is_spent = False

    def earliest(self) -> Proposals[Found]:
        """Return the earliest ride found that has a plan.

        Raises:
            PlanningError: None has: the reason at the time of arrival that came nearest to one.
        """
        found, failed = yield from self._first(self.times)
        if found is None:
            raise self._refusal(self.times)
        found = yield from self._sooner(found, failed)
        latest = self.first.latest_arrival
        if latest is not None and found.boarding.time > latest:
            raise self._late(latest, found)
        return found

    @cached_property
    def times(self) -> np.ndarray:
        """Times of arrival (N,), s, from the earliest to the last within reach.

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
                waypoint=self.number,
                value=nearest_then,
                limit=reach,
            )
        return np.linspace(begin, end, TIMES_TRIED + 1)

    def _attempt(self, boarding: Boarding) -> Proposals[Outcome]:
        outcome = yield from attempted(self.attempt, until_next_ride(with_boarding(self.boardings, boarding)))
        if isinstance(outcome, Refused):
            self.is_spent = is_unmade(outcome)
            if not self.is_spent:
                self.refusals.append((boarding.time, outcome.refusal))
        return outcome

    def _found(self, boarding: Boarding, outcome: Planned) -> Found:
        problem, trajectory = outcome.plan.problem, outcome.plan.trajectory
        paths = requested_paths(problem)
        k = next(i for i, path in enumerate(paths) if path[1] == self.number and is_riding(problem, i))
        stop = last_stop(problem, k)
        dwell = outcome.attempt.problem.waypoints[problem.numbers[stop]].dwell
        return Found(boarding, outcome.plan, float(trajectory.departures[stop] - trajectory.arrivals[stop]) - dwell)

    def tried(self, time: float) -> Proposals[Found | PlanningError]:
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
            if self._is_late(refusal) and refusal.limit is not None:
                return self._not_there(refusal.limit, boarding)
            if not isinstance(refusal, LimitsUnsatisfiable) or self.boardings.slowness * SLOWER > SLOWEST:
                return refusal
            self.boardings.slowness *= SLOWER

    def _not_there(self, soonest: float, boarding: Boarding) -> InfeasibleDuration:
        """Return the refusal of a ride that begins before the soonest time, s, at which the robot can be there."""
        arrival = soonest + boarding.path.lead_in
        return InfeasibleDuration(
            f"waypoint {{waypoint}} on {self.ride.thing.id!r} cannot be reached at {boarding.time:.6g} s: within the "
            f"limits and the requested durations, the robot would be there at {arrival:.6g} s",
            waypoint=self.number,
            value=boarding.time,
            limit=arrival,
        )

    def _first(self, times: np.ndarray) -> Proposals[tuple[Found | None, float]]:
        """Return the first ride with a plan, and the last time of arrival, s, before it that has none."""
        last = float(times[-1])
        time, failed = float(times[0]), float(times[0])
        late, beyond = -np.inf, last  # the robot is too late at one time, and the other may be out of reach
        while time <= last:
            found = yield from self.tried(time)
            if isinstance(found, Found):
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
        return isinstance(refusal, InfeasibleDuration) and refusal.waypoint == self.number

    def _sooner(self, found: Found, failed: float) -> Proposals[Found]:
        """Make the time of arrival sooner, down to one, s, that has no plan."""
        for _ in range(MOST_SOONER):
            time = found.boarding.time
            if found.slack <= ARRIVAL_KNOWN_TO or time - failed <= ARRIVAL_KNOWN_TO:
                break
            sooner = max(time - found.slack + AHEAD, (failed + time) / 2.0)
            tried = yield from self.tried(sooner)
            if isinstance(tried, Found):
                found = tried
            elif self.is_spent:
                break
            else:
                failed = sooner
        return found

    def not_before(self, time: float) -> Proposals[Found | PlanningError]:
        """Try a time of arrival, s, and soon after it where the robot cannot be there in time."""
        tried = yield from self.tried(time)
        for _ in range(MOST_SOONER):
            if not isinstance(tried, PlanningError) or not self._is_late(tried) or self.is_spent:
                break
            time = max((tried.limit or 0.0) + AHEAD, time + AHEAD)
            if self.first.latest_arrival is not None and time > self.first.latest_arrival:
                break
            tried = yield from self.tried(time)
        return tried

    def last(self, found: Found) -> float:
        """Return the last time of arrival, s, at which there is a ride; `found` is one."""
        latest, first = self.first.latest_arrival, found.boarding.time
        last = float(self.times[-1]) if latest is None else min(float(self.times[-1]), latest)
        if isinstance(self.boardings.at(last), Boarding):
            return last
        while last - first > LAST_KNOWN_TO:
            middle = (first + last) / 2.0
            first, last = (middle, last) if isinstance(self.boardings.at(middle), Boarding) else (first, middle)
        return first

    def _late(self, latest: float, found: Found) -> InfeasibleDuration:
        """Return the refusal of a ride that has to begin too soon, with the time that works."""
        arrival = float(np.ceil(found.boarding.time / AHEAD) * AHEAD)
        remedy = Remedy(
            ("waypoints", self.number, "latest_arrival"),
            arrival,
            "the earliest arrival found on the object",
            found.plan.trajectory.duration,
        )
        return InfeasibleDuration(
            f"waypoint {{waypoint}} on {self.ride.thing.id!r} cannot be reached by {latest:g} s: the earliest arrival "
            f"found is at {found.boarding.time:.6g} s",
            waypoint=self.number,
            value=latest,
            limit=found.boarding.time,
            remedies=[remedy],
        )

    def _refusal(self, times: np.ndarray) -> PlanningError:
        """Return the reason why no time of arrival has a plan."""
        middle = float(times.mean())
        blocked = [own for own in self.refusals if isinstance(own[1], Collision | ClearanceUnproved)]
        late = [own for own in self.refusals if isinstance(own[1], InfeasibleDuration)]
        nearest = sorted(self.refusals, key=lambda own: float(abs(own[0] - middle)))
        within = f"on {self.ride.thing.id!r} from {times[0]:.4g} to {times[-1]:.4g} s"
        known = f"no time of arrival {within} has a plan"
        if self.is_spent:
            known = f"no plan was found for a time of arrival {within} before the budget of attempts ended"
        if not self.refusals:
            return InfeasibleDuration(known, waypoint=self.number)
        time, refusal = (blocked[:1] or late[-1:] or nearest)[0]
        return refusal.with_fields(_text=f"{known}; at {time:.4g} s: {refusal._text}")


def attempted(attempt: Attempt, problem: ProblemWithOptions) -> Proposals[Outcome]:
    """Plan a problem with rides at given times; a refusal names the waypoints as requested.

    Raises:
        PlanningError: No plan at any other time avoids the reason.
    """
    outcome = yield from improved(replace(attempt, problem=problem))
    if isinstance(outcome, Planned):
        return outcome
    refusal = outcome.refusal.moved(requested_paths(problem))
    if isinstance(refusal, AT_ALL_TIMES):
        raise refusal
    return replace(outcome, refusal=refusal)


def _reach(robot: Robot) -> float:
    """Return a distance from the base, m, beyond which the tool cannot be."""
    placements = robot.model.jointPlacements.tolist()[1:]
    travels = [max(abs(joint.lower), abs(joint.upper)) for joint in robot.joints if not joint.is_angle]
    tip = robot.model.frames[robot.tool_frame_id].placement
    return float(sum(np.linalg.norm(one.translation) for one in (*placements, tip)) + sum(travels))
