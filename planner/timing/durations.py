"""Requested durations of the whole trajectory, and minimum durations of segments.

They work alike for all back ends. A trajectory that is too fast is planned again with longer segments or lower speeds,
or is stretched uniformly. A uniform stretch keeps all limits that the trajectory keeps. This includes torques with
gravity: at each position the torque lies between its value in motion and its value at rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.backends.base import BackEnd, enforced, without_search
from planner.errors import InfeasibleDuration, PlanningError, Remedy
from planner.guarantees import end_states
from planner.paths import JointPath, SegmentGroup
from planner.problems.problem import PlanningProblem
from planner.spatial import FloatArray
from planner.timing.own_path import slow_down
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.trajectory import Trajectory


def in_requested_durations(problem: PlanningProblem, backend: BackEnd, path: JointPath) -> Trajectory:
    """Compute a trajectory with the minimum durations of segments and the duration of the whole.

    Raises:
        InfeasibleDuration: The duration of a segment or of the whole is shorter than the limits allow.
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
    """Stretch a trajectory to the requested durations of its segments, and of the whole.

    Args:
        path: The path, with the requested durations of segments.
        fastest: A trajectory on it, whose segments take no longer than these durations.
        duration: The duration of the whole, s; None: no requested duration.

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


def _factors(trajectory: Trajectory, requested: FloatArray) -> FloatArray:
    """Return factors (segments,) from segments' durations to the requested ones, s; NaN: no requested duration."""
    own = _durations_of(trajectory)
    return np.divide(requested, own, out=np.ones_like(own), where=~np.isnan(requested) & (own > 0.0))


def durations_sharing(
    path: JointPath, fastest: Trajectory, duration: float, least: FloatArray | float = 0.0
) -> FloatArray:
    """Return segment durations (segments,), s, that give the whole trajectory its duration.

    Segments without a requested duration share the remaining time, in proportion to their shortest durations. A segment
    whose share is below its minimum duration gets the minimum duration.

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
        shared = np.where(free, own * left / own[free].sum(), durations) if free.any() else durations
        short = free & (shared < least)
        if not short.any():
            return shared
        durations = np.where(short, least, durations)


def duration_error(requested: float, shortest: float) -> InfeasibleDuration:
    """Return the refusal of a duration, s, with a shortest duration, s, that is known to work."""
    return InfeasibleDuration(
        f"the trajectory cannot be done in {requested:g} s: within its limits and the requested durations it takes "
        f"{shortest:.6g} s",
        value=requested,
        limit=shortest,
        remedies=[Remedy(("duration",), shortest, "a duration of the whole that keeps the limits")],
    )


def _durations_of(trajectory: Trajectory) -> FloatArray:
    """Return the duration of each segment (segments,), s, without the rests at its ends."""
    return trajectory.arrivals[1:] - trajectory.departures[:-1]


def _with_least_durations(backend: BackEnd, path: JointPath, least: FloatArray) -> tuple[Trajectory, FloatArray]:
    """Compute the trajectory with minimum durations of segments, and the durations passed to the back end.

    The back end gets the minimum durations as durations. If it cannot give them to a segment group, the function slows
    the motion there on its own path.
    """
    fastest = trajectory = backend.parametrize(path)
    requested = path.durations
    while True:
        short = _durations_of(trajectory) < least * (1.0 - DURATION_TOLERANCE)
        if not np.isnan(requested[short]).any():
            return trajectory, requested
        requested = np.where(short, least, requested)
        try:
            trajectory = backend.parametrize(replace(path, durations=requested))
        except PlanningError:
            slowed = _slowed(backend, path, fastest, least)
            if slowed is None:
                raise
            return slowed, path.durations


def slowed_to(problem: PlanningProblem, backend: BackEnd, path: JointPath, fastest: Trajectory) -> Trajectory | None:
    """Slow a trajectory on its own path to the minimum durations of a problem; None: it must not be slowed."""
    try:
        return _slowed(backend, path, fastest, minimum_durations(problem))
    except PlanningError:
        return None


def _slowed(backend: BackEnd, path: JointPath, fastest: Trajectory, least: FloatArray) -> Trajectory | None:
    """Return the motion slowed on its own path where segments take less than `least` (segments,), s.

    None: it must not be slowed.
    """
    own = _durations_of(fastest)
    short = own < least * (1.0 - DURATION_TOLERANCE)
    if any(short[group.segments].any() and is_rigid(backend, path, group) for group in path.every_group):
        return None
    longer = {k: float(least[k]) for k in np.flatnonzero(short).tolist()}
    return slow_down(path, fastest, enforced(backend), requested=longer)


def _lengthened(backend: BackEnd, path: JointPath, fastest: Trajectory, requested: FloatArray) -> Trajectory:
    """Compute the trajectory whose segments have the given durations (segments,), s.

    It is the stretched fastest trajectory, or the back end's own result for these durations if it has one.
    """
    rigid = any(is_rigid(backend, path, group) for group in path.every_group)
    if rigid or backend.capabilities.is_shaped_by_duration:
        try:
            return backend.parametrize(replace(path, durations=requested))
        except PlanningError:
            if rigid or requested[path.moving].sum() < _durations_of(fastest)[path.moving].sum():
                raise
    own = _durations_of(fastest)
    return _stretched(
        fastest, np.divide(requested, own, out=np.ones_like(own), where=np.isnan(path.durations) & (own > 0))
    )


def is_rigid(backend: BackEnd, path: JointPath, group: SegmentGroup) -> bool:
    """Tell whether no stretch fits a segment group: part of it has durations, or fixed velocities."""
    ends, moving, free = end_states(backend, path.robot.dof), path.moving, np.isnan(path.durations[group.segments])
    moves = (ends.starts_moving and group.first == moving[0]) or (ends.ends_moving and group.segments[-1] == moving[-1])
    moves = moves or not path.passed_at.keys().isdisjoint(group.segments.tolist())
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
