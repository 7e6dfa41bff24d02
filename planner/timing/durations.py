"""Durations asked beyond those of single segments: of the whole trajectory, and the least ones of segments.

They are the same for all back ends: a motion that is too quick for them is planned again with longer durations of its
segments, or with lower speeds, or stretched evenly. An even stretch of a motion keeps all limits that the motion keeps;
torques with their gravity, too: at each position they come to lie between those of the motion and those of rest.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.base import enforced, without_search
from planner.errors import InfeasibleDuration, PlanningError, Remedy
from planner.guarantees import end_states
from planner.timing.own_path import slow_down
from planner.tolerances import DURATION_TOLERANCE

if TYPE_CHECKING:
    from planner.backends.base import BackEnd
    from planner.paths import JointPath, Run
    from planner.problems.problem import PlanningProblem
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory


def in_asked_durations(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Trajectory:
    """Put time on a path, in no less than the minimum durations of segments and in the duration of the whole.

    Args:
        problem: What is asked.
        backend: What puts time on the path.
        path: The solved path of the problem, on which something moves.

    Raises:
        InfeasibleDuration: A duration that is asked, of a segment or of the whole, is shorter than the limits allow.
        PlanningError: Another refusal of the back end.
    """
    least = minimum_durations(problem)
    at_once = without_search(backend)
    if problem.duration is None:
        if at_once is not backend and least.any():
            path = replace(path, durations=_with_least_durations(at_once, path, least)[1])
        return _with_least_durations(backend, path, least)[0]
    fastest = _with_least_durations(at_once, path, least)[0]
    if not np.isnan(path.durations[path.moving]).any():
        return fastest
    if problem.duration < fastest.duration * (1.0 - DURATION_TOLERANCE) and at_once is backend:
        raise duration_error(problem.duration, fastest.duration)
    try:
        trajectory = _lengthened(backend, path, fastest, durations_sharing(path, fastest, problem.duration, least))
        return _ending_at(trajectory, problem.duration)
    except InfeasibleDuration:
        raise duration_error(problem.duration, fastest.duration) from None


def minimum_durations(problem: PlanningProblem) -> FloatArray:
    """Return the minimum duration of each segment (segments,), s; 0: none."""
    return np.array([waypoint.minimum_duration for waypoint in problem.waypoints[1:]])


def in_longer_durations(path: JointPath, fastest: Trajectory, duration: float | None) -> Trajectory:
    """Stretch a trajectory to the durations asked of its segments, and in what is left to that of the whole.

    Args:
        path: The path, with the durations that are asked of segments.
        fastest: A trajectory on it, no segment of which takes longer than that.
        duration: The duration of the whole, s; None: none is asked.

    Raises:
        InfeasibleDuration: The duration of the whole is too short.
    """
    trajectory = _stretched(fastest, _factors(fastest, path.durations))
    if duration is None:
        return trajectory
    if duration < trajectory.duration * (1.0 - DURATION_TOLERANCE):
        raise duration_error(duration, trajectory.duration)
    return _ending_at(
        _stretched(trajectory, _factors(trajectory, durations_sharing(path, trajectory, duration))), duration
    )


def _factors(trajectory: Trajectory, asked: FloatArray) -> FloatArray:
    """Return the factors (segments,) on the time of each segment to what is asked of it, s; NaN: its own."""
    own = _durations_of(trajectory)
    return np.divide(asked, own, out=np.ones_like(own), where=~np.isnan(asked) & (own > 0.0))


def durations_sharing(
    path: JointPath, fastest: Trajectory, duration: float, least: FloatArray | float = 0.0
) -> FloatArray:
    """Return the durations (segments,), s, with which a trajectory takes so long as a whole.

    Segments without a duration of their own share what is left, each in the proportion of the time that it takes; those
    whose share is shorter than their minimum duration get that.

    Args:
        path: The path, with the durations of single segments.
        fastest: A trajectory on it.
        duration: The duration of the whole, s.
        least: (segments,), the minimum durations of segments, or of all of them, s.
    """
    own, durations = _durations_of(fastest), path.durations
    while True:
        free = np.isnan(durations) & (own > 0.0)
        fixed = np.where(np.isnan(durations), own, durations)[~free].sum()
        left = max(duration - (fastest.duration - own.sum()) - float(fixed), 0.0)
        shared = np.where(free, own * left / max(float(own[free].sum()), np.finfo(float).tiny), durations)
        short = free & (shared < least)
        if not short.any():
            return shared
        durations = np.where(short, least, durations)


def duration_error(asked: float, shortest: float) -> InfeasibleDuration:
    """Return the error where the trajectory cannot take so long as is asked, s, but a duration, s, that is known."""
    return InfeasibleDuration(
        f"the trajectory cannot be done in {asked:g} s: within its limits and the durations asked it takes "
        f"{shortest:.6g} s",
        value=asked,
        limit=shortest,
        remedies=[Remedy(("duration",), shortest, "a duration of the whole that keeps the limits")],
    )


def _durations_of(trajectory: Trajectory) -> FloatArray:
    """Return how long each segment (segments,) takes, s, without the rests at its ends."""
    durations: FloatArray = trajectory.arrivals[1:] - trajectory.departures[:-1]
    return durations


def _with_least_durations(backend: BackEnd, path: JointPath, least: FloatArray) -> tuple[Trajectory, FloatArray]:
    """Return the motion in which no segment takes less than its least duration, and the durations asked for it.

    The back end is asked for the least durations; where it cannot give them to segments that are passed without
    stopping, the motion is slowed there on its own path.

    Args:
        backend: What puts time on the path.
        path: The path, with the durations that are asked of it.
        least: (segments,), s.
    """
    fastest = trajectory = backend.parametrize(path)
    asked = path.durations
    while True:
        short = _durations_of(trajectory) < least * (1.0 - DURATION_TOLERANCE)
        if not np.isnan(asked[short]).any():
            return trajectory, asked
        asked = np.where(short, least, asked)
        try:
            trajectory = backend.parametrize(replace(path, durations=asked))
        except PlanningError:
            slowed = _slowed(backend, path, fastest, least)
            if slowed is None:
                raise
            return slowed, path.durations


def _slowed(backend: BackEnd, path: JointPath, fastest: Trajectory, least: FloatArray) -> Trajectory | None:
    """Return the motion slowed on its own path where segments take less than `least` (segments,), s.

    None: it must not be slowed.
    """
    own = _durations_of(fastest)
    short = own < least * (1.0 - DURATION_TOLERANCE)
    if any(short[run.segments].any() and _is_rigid(backend, path, run) for run in path.every_run):
        return None
    longer = {k: float(least[k]) for k in np.flatnonzero(short).tolist()}
    return slow_down(path, fastest, enforced(backend), asked=longer)


def _lengthened(backend: BackEnd, path: JointPath, fastest: Trajectory, asked: FloatArray) -> Trajectory:
    """Return the motion whose segments take as long as is asked (segments,), s.

    That is the fastest one stretched, or what the back end makes of these durations if it can.
    """
    rigid = any(_is_rigid(backend, path, run) for run in path.every_run)
    if rigid or backend.capabilities.is_shaped_by_duration:
        try:
            return backend.parametrize(replace(path, durations=asked))
        except PlanningError:
            if rigid or asked[path.moving].sum() < _durations_of(fastest)[path.moving].sum():
                raise
    own = _durations_of(fastest)
    return _stretched(fastest, np.divide(asked, own, out=np.ones_like(own), where=np.isnan(path.durations) & (own > 0)))


def _is_rigid(backend: BackEnd, path: JointPath, run: Run) -> bool:
    """Tell whether a run has a duration in part, or a motion at its ends or at a waypoint: no stretch keeps that."""
    ends, moving, free = end_states(backend, path.robot.dof), path.moving, np.isnan(path.durations[run.segments])
    moves = (ends.starts_moving and run.first == moving[0]) or (ends.ends_moving and run.segments[-1] == moving[-1])
    moves = moves or not path.passed_at.keys().isdisjoint(run.segments.tolist())
    return bool(free.any()) and (moves or not bool(free.all()))


def _stretched(trajectory: Trajectory, factors: FloatArray) -> Trajectory:
    """Stretch the motion of each segment by its factor (segments,); rests keep their time."""
    if (factors == 1.0).all():
        return trajectory
    return trajectory.stretched(np.where(trajectory.moves, factors[trajectory.segments], 1.0))


def _ending_at(trajectory: Trajectory, duration: float) -> Trajectory:
    """Make a trajectory that ends after this time, s, but for rounding, end exactly then."""
    lengths, end = trajectory.lengths.copy(), trajectory.breakpoints[-1]
    lengths[-1] = np.longdouble(duration) - lengths[:-1].sum(dtype=np.longdouble)
    arrivals, departures = (np.where(at == end, duration, at) for at in (trajectory.arrivals, trajectory.departures))
    return replace(trajectory, lengths=lengths, arrivals=arrivals, departures=departures)
