"""Arrivals at waypoints within their time windows: the robot waits at the last stop before a window that is not open.

A wait keeps every limit that the trajectory keeps: it is a rest where the robot rests already. Where a wait would make
the arrival at a passed waypoint too late, the segments after that waypoint take longer instead.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from planner.errors import InfeasibleDuration, InvalidProblem, Remedy
from planner.paths import JointPath
from planner.problems.problem import PlanningProblem, ViaWaypoint
from planner.problems.rides import RideMotion, is_riding
from planner.problems.transitions import StopTransition
from planner.tolerances import LIMIT_TOLERANCE, POSITION_TOLERANCE
from planner.trajectories.trajectory import Trajectory


def with_waits(
    problem: PlanningProblem, path: JointPath, trajectory: Trajectory
) -> tuple[PlanningProblem, JointPath, Trajectory]:
    """Wait at stops until no waypoint is reached before its earliest arrival.

    Returns:
        The problem and the path with the waits as dwells, and the trajectory with them.

    Raises:
        InvalidProblem: The robot would have to wait where it starts in motion.
    """
    for k, waypoint in enumerate(problem.waypoints):
        wait = waypoint.earliest_arrival - float(trajectory.arrivals[k])
        if wait <= 0.0:
            continue
        stop = last_stop(problem, k)
        if np.abs(trajectory.evaluate(trajectory.departures[stop], [1])[0]).max() > POSITION_TOLERANCE:
            message = "must be left out: the robot starts in motion, and does not stop before this waypoint"
            raise InvalidProblem([(("waypoints", k, "earliest_arrival"), message)])
        waypoints, dwells = list(problem.waypoints), path.dwells.copy()
        waypoints[stop] = replace(waypoints[stop], dwell=waypoints[stop].dwell + wait)
        dwells[stop] += wait
        problem, path = replace(problem, waypoints=waypoints), replace(path, dwells=dwells)
        trajectory = with_wait(trajectory, stop, wait)
    return problem, path, trajectory


def with_longer_segments(problem: PlanningProblem, trajectory: Trajectory) -> PlanningProblem | None:
    """Return a problem whose segments take as long as the windows of passed waypoints require.

    From stop to stop, each arrival i is put off by D_i: D_1 by a wait, D_i - D_(i-1) by a longer segment. The arrival
    is r_i before its earliest, and h_i before its latest. D_i = min(max r, h_i, h_(i+1), ...) is the longest possible
    wait. It must be at least r_i.

    Args:
        problem: The problem.
        trajectory: Its trajectory without waits.

    Returns:
        The problem with minimum durations; None: no longer segments help.
    """
    waypoints, arrivals = list(problem.waypoints), trajectory.arrivals
    durations = arrivals[1:] - trajectory.departures[:-1]
    stops = [*sorted({last_stop(problem, k) for k in range(1, len(waypoints))}), len(waypoints) - 1]
    put_off, is_longer = 0.0, False
    for first, last in pairwise(stops):
        inner = range(first + 1, last + 1)
        needed = np.array([max(put_off, waypoints[k].earliest_arrival - arrivals[k]) for k in inner])
        latest = [waypoints[k].latest_arrival for k in inner]
        allowed = np.array([np.inf if at is None else at - arrivals[k] for k, at in zip(inner, latest, strict=True)])
        delays = np.minimum(needed.max(), np.minimum.accumulate(allowed[::-1])[::-1])
        if (delays < needed - LIMIT_TOLERANCE).any():
            return None
        for k, extra in zip(inner[1:], np.diff(delays).tolist(), strict=True):
            if extra > LIMIT_TOLERANCE:
                if waypoints[k].duration is not None or isinstance(waypoints[k].motion, RideMotion):
                    return None
                waypoints[k] = replace(waypoints[k], minimum_duration=float(durations[k - 1]) + extra)
                is_longer = True
        put_off = float(delays[-1])
    return replace(problem, waypoints=tuple(waypoints)) if is_longer else None


def last_stop(problem: PlanningProblem, waypoint: int) -> int:
    """Return the last waypoint before another one at which the robot stops; 0: only the start."""
    waypoints = problem.waypoints
    stops = (
        k
        for k in range(waypoint - 1, 0, -1)
        if isinstance(waypoints[k].transition, StopTransition)
        and not isinstance(waypoints[k], ViaWaypoint)
        and not is_riding(problem, k)
    )
    return next(stops, 0)


def refuse_late_arrivals(problem: PlanningProblem, trajectory: Trajectory) -> None:
    """Refuse a trajectory that reaches a waypoint after its latest arrival.

    Raises:
        InfeasibleDuration: Naming the first such waypoint, with its arrival.
    """
    for k, waypoint in enumerate(problem.waypoints):
        latest, arrival = waypoint.latest_arrival, float(trajectory.arrivals[k])
        if latest is not None and arrival > latest * (1.0 + LIMIT_TOLERANCE):
            remedy = Remedy(("waypoints", k, "latest_arrival"), arrival, "the arrival within the limits")
            raise InfeasibleDuration(
                f"waypoint {{waypoint}} cannot be reached by {latest:g} s: within the limits, the requested durations "
                f"and the earliest arrivals, the robot is there at {arrival:.6g} s",
                waypoint=k,
                value=latest,
                limit=arrival,
                remedies=[remedy],
            )


def with_wait(trajectory: Trajectory, waypoint: int, wait: float) -> Trajectory:
    """Return a trajectory that rests for a time, s, longer before it leaves a waypoint at which it stops."""
    at = float(trajectory.departures[waypoint])
    row = int(np.abs(trajectory.breakpoints - at).argmin())
    rest = np.zeros((1, *trajectory.coefficients.shape[1:]))
    rest[0, :, 0] = trajectory.evaluate(at, [0])[0]
    later = np.arange(len(trajectory.arrivals))
    return replace(
        trajectory,
        lengths=np.insert(trajectory.lengths, row, wait),
        coefficients=np.concatenate([trajectory.coefficients[:row], rest, trajectory.coefficients[row:]]),
        segments=np.insert(trajectory.segments, row, max(waypoint - 1, 0)),
        arrivals=trajectory.arrivals + np.where(later > waypoint, wait, 0.0),
        departures=trajectory.departures + np.where(later >= waypoint, wait, 0.0),
    )
