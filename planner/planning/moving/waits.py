"""Waits at a stop until an object that moves has passed.

The motion after a stop is cut into intervals of one length, and so is the clock. A wait of some intervals may do if the
robot is clear in the middles of all intervals of its rest and its motion. The clearance at all times is proved for a
few of these waits, and the first one with a proof is shortened.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np

from planner.certificate.clearance import parts_of, segment_checkers
from planner.certificate.moving_objects import clearances_of_objects, meetings
from planner.errors import ClearanceUnproved, Collision, Remedy
from planner.planning.attempts import Refused
from planner.planning.proofs import Change
from planner.planning.variants import is_of_moving_object
from planner.problems.problem import PlanningProblem, ViaWaypoint
from planner.problems.rides import is_riding
from planner.problems.transitions import StopTransition
from planner.scene.blocks import BLOCKED_SHARE, not_free
from planner.scene.checker import CollisionChecker
from planner.scene.phases import Phase
from planner.scene.scene import SceneObject
from planner.spatial import FloatArray
from planner.timing.arrivals import with_wait
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.trajectory import Trajectory

LONGEST_WAITS = (5.0, 60.0)
"""The longest waits that are looked at, s, one after the other: shorter waits get shorter intervals."""

CLOCK_INTERVALS = 512
"""The number of intervals into which the longest wait and the trajectory are cut together."""

MOST_STOPS = 6
"""The most stops before a collision at which waits are looked at, the latest first."""

MOST_LEGS = 100
"""The most parts of the motions of all moving objects for which waits are looked at: each part is proved by itself."""

MOST_LEGS_AT_STOPS = 24
"""The number of such parts, times stops, for which waits are looked at; one stop always is."""

PROVED_WAITS = (0, 1, 2, 4, 8, 16, 32, 64)
"""The waits at a stop whose clearance is proved until one is, by their places among the waits that may do."""

WAIT_MILLISECONDS = 1000
"""Number of steps a second to which waits are rounded."""


def waits_for_objects(refused: Refused) -> Iterator[Change]:
    """Yield waits before a collision with an object that moves, the shortest first; none for other refusals."""
    attempt, refusal, trajectory = refused.attempt, refused.refusal, refused.trajectory
    problem, scene = attempt.with_detours, attempt.problem.scene
    if scene is None or trajectory is None or refusal.segment is None or not is_of_moving_object(problem, refusal):
        return
    legs = sum(1 for thing in scene.moving if thing.motion is not None for _ in thing.motion.legs(thing.pose))
    if legs > MOST_LEGS:
        return
    checkers = segment_checkers(problem, attempt.solved.positions)
    numbers, found = problem.numbers, []
    for stop in islice(_stops(problem, refusal.segment), max(1, MOST_LEGS_AT_STOPS // legs)):
        steps = _shortest_wait(checkers, scene.objects, trajectory, stop)
        if steps is not None:
            found.append((steps, stop))
    for steps, stop in sorted(found):
        wait, number = steps / WAIT_MILLISECONDS, numbers[stop]
        dwell = attempt.problem.waypoints[number].dwell
        rest = float(trajectory.departures[stop] - trajectory.arrivals[stop])  # longer if an arrival requires it
        dwell = (dwell if rest <= dwell * (1.0 + DURATION_TOLERANCE) else rest) + wait
        text = f"the robot waits {wait:g} s longer here, until {refusal.pair[1]} has passed"  # type: ignore[attr-defined]
        change = [Remedy(("waypoints", number, "dwell"), dwell, text)]
        if attempt.problem.duration is not None:
            longer = attempt.problem.duration + wait
            change.append(Remedy(("duration",), longer, "the requested duration with the wait"))
        yield change


def _stops(problem: PlanningProblem, segment: int) -> Iterator[int]:
    """Yield the waypoints at which the robot stops before a requested segment ends, the latest first."""
    stops = [
        k
        for k, (waypoint, number) in enumerate(zip(problem.waypoints[:-1], problem.numbers, strict=False))
        if number <= segment and not isinstance(waypoint, ViaWaypoint) and not is_riding(problem, k)
        if k == 0 or isinstance(waypoint.transition, StopTransition)
    ]
    yield from stops[::-1][:MOST_STOPS]


def _shortest_wait(
    checkers: tuple[CollisionChecker, ...], given: Sequence[SceneObject], trajectory: Trajectory, stop: int
) -> int | None:
    """Return the shortest wait found at a stop that keeps the robot clear, in steps; None: none is found."""

    def is_clear(steps: int) -> bool:
        waited = with_wait(trajectory, stop, steps / WAIT_MILLISECONDS)
        try:
            for checker, part, begin in parts_of(checkers, waited):
                for _ in clearances_of_objects(checker, given, part, begin, None):
                    pass
        except (Collision, ClearanceUnproved):
            return False
        return True

    for longest in LONGEST_WAITS:
        waits, low = _free_waits(checkers, given, trajectory, stop, longest), 0
        for wait in (waits[k] for k in PROVED_WAITS if k < len(waits)):
            high = int(np.ceil(wait * WAIT_MILLISECONDS))
            if is_clear(high):
                while high - low > 1:
                    middle = (low + high) // 2
                    low, high = (low, middle) if is_clear(middle) else (middle, high)
                return high
            low = high
    return None


def _free_waits(
    checkers: tuple[CollisionChecker, ...],
    given: Sequence[SceneObject],
    trajectory: Trajectory,
    stop: int,
    longest: float,
) -> FloatArray:
    """Return the waits at a stop, s, ascending, with which the middles of all intervals are clear."""
    start, step = float(trajectory.departures[stop]), (longest + trajectory.duration) / CLOCK_INTERVALS
    count = max(1, int(np.ceil((trajectory.duration - start) / step)))
    edges = np.minimum(start + step * np.arange(count + 1), trajectory.duration)
    rows = np.vstack([[[start, start]], np.column_stack([edges[:-1], edges[1:]])])
    clock = start + step * np.arange(count + int(longest / step) + 1)
    columns = np.column_stack([clock[:-1], clock[1:]])
    blocked = np.zeros((len(rows), len(columns)), dtype=bool)
    for checker, part, begin in parts_of(checkers, trajectory):
        end = begin + part.duration
        of_part = np.flatnonzero((rows[:, 1] >= begin) & (rows[:, 0] <= end))
        for meeting in meetings(checker, given, 0.0, float(clock[-1])):
            if meeting.are_contacts:
                continue  # where the robot holds an object, both may overlap
            own = Phase(meeting.phase.bodies, part, begin, begin, end, np.zeros(0))
            of_phase = np.flatnonzero((columns[:, 1] >= meeting.begin) & (columns[:, 0] <= meeting.end))
            if len(of_part) and len(of_phase):
                whole = (of_part[0], of_part[-1] + 1, of_phase[0], of_phase[-1] + 1)
                found = not_free(meeting.checker, own, meeting.phase, rows, columns, whole, shares=(0.0,))
                for those, when, share in found:
                    blocked[those, when] |= share == BLOCKED_SHARE
    waits = np.arange(len(columns) - count + 1)
    moves = np.arange(count)
    is_free = ~blocked[1 + moves, waits[:, None] + moves].any(axis=1)
    rests = np.append(True, ~np.logical_or.accumulate(blocked[0]))[: len(waits)]
    return np.asarray(waits[is_free & rests & (waits > 0)] * step)
