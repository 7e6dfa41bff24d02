"""Motions slowed where the robot is near to objects: the same path, timed anew within the limits of its speed zones.

The motion q(x) that a back end made, from rest to rest, is passed at q(x(t)) with x' <= 1, so that it is nowhere faster
than planned. Where the planned motion comes within the clearance of a zone is found first. On the path that does not
depend on time, so the highest speed w(x) of all points of the robot, at x' = 1, limits x'^2 there to (v / w)^2. The
fastest x(t) within that, and within all limits that the back end keeps, is that of `jerk_limited`.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.base import enforced
from planner.certificate.clearance import segment_checkers
from planner.errors import InfeasibleDuration, InvalidProblem, Remedy
from planner.fields import BACK_END
from planner.guarantees import END_OPTIONS, end_states
from planner.speed_zones import DECIDED_TO, KNOWN_TO, most_speed, moving_bodies, near_intervals, point_speeds
from planner.time_scaling.compose import compose
from planner.time_scaling.linear_limits import GRIDPOINTS, LinearLimits
from planner.time_scaling.retiming import fastest_retiming
from planner.time_scaling.time_law import LimitsOnCurve, retimed
from planner.time_scaling.uniform import slowest, time_scalings
from planner.timing.durations import in_asked_durations, in_longer_durations
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.backends.base import BackEnd
    from planner.fields import FieldPath
    from planner.paths import JointPath, Run
    from planner.problems.problem import PlanningProblem
    from planner.scene.bodies import Bodies
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory

WIDER = 4e-3
"""Distance, m, by which zones are widened to slow a motion down: what the certificate counts as near lies within."""

SHARE = 1.0 - 1.5 * KNOWN_TO
"""Share of a zone's speed that a motion is slowed to: the certificate's bound of it is that much higher."""

INTERVALS = (120, 240, 480)
"""Numbers of intervals of the law, at least, tried until limits are kept between its gridpoints, too."""

ENOUGH = 1.003
"""Excess over a limit between gridpoints, as a factor on all times, that a finer law is not tried for."""

GAP = 1e-3
"""Relative gap to the fastest law that may be left."""

CLOSEST = 0.05
"""Least distance of two nodes of the law, but for the breakpoints of the motion, as a share of an even interval."""

RAMP_OPTIONS = ("acceleration_time", "deceleration_time")
"""Names of the options that give the times of acceleration and of braking."""


def slowed(problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Slow a trajectory on its own path where the robot is in its speed zones; it is the same one where that is not.

    Args:
        problem: What is asked.
        backend: What put time on the path.
        path: The solved path of the problem.
        trajectory: The motion of the back end, in the durations that are asked.

    Raises:
        InvalidProblem: What is to be slowed is asked to be passed or left with a velocity, with ramps of its own, or in
            durations of single segments without a stop between them.
        InfeasibleDuration: A duration that is asked is too short for the speeds in the zones.
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    if not problem.speed_zones or not len(path.moving):
        return trajectory
    slow = _slowed(problem, backend, path, trajectory)
    asked = ~np.isnan(path.durations)
    if slow is trajectory or (problem.duration is None and not asked[path.moving].any()):
        return slow
    free = replace(path, durations=np.where(np.isin(np.arange(len(asked)), path.moving), np.nan, path.durations))
    fastest = _slowed(problem, backend, free, in_asked_durations(replace(problem, duration=None), backend, free))
    _refuse_short_durations(path, fastest)
    return in_longer_durations(path, fastest, problem.duration)


def _refuse_short_durations(path: JointPath, fastest: Trajectory) -> None:
    """Refuse durations of segments that are too short in the zones, or that no even stretch of a run gives.

    Raises:
        InvalidProblem: A duration is asked of a segment that is not alone between two stops.
        InfeasibleDuration: One is too short.
    """
    asked = path.durations
    for run in path.every_run:
        among = run.segments[~np.isnan(asked[run.segments])].tolist()
        if among and len(run.segments) > 1:
            message = "in speed zones a segment keeps a duration only if the robot stops before it and after it"
            raise InvalidProblem([(("waypoints", k + 1, "duration"), message) for k in among])
    took = fastest.arrivals[1:] - fastest.departures[:-1]
    short = [k for k in path.moving.tolist() if asked[k] < took[k] * (1.0 - DURATION_TOLERANCE)]
    if short:
        k = short[0]
        explanation = "the shortest duration of this segment that keeps the limits and the speeds of the zones"
        raise InfeasibleDuration(
            f"segment {{segment}} cannot be done in {asked[k]:g} s: with the speeds of the zones near objects it takes "
            f"{took[k]:.6g} s",
            waypoint=k + 1,
            segment=k,
            value=float(asked[k]),
            limit=float(took[k]),
            remedies=[Remedy(("waypoints", i + 1, "duration"), float(took[i]), explanation) for i in short],
        )


class _Slow(NamedTuple):
    """The part of a motion that is near to objects of a zone.

    Attributes:
        intervals: (N, 2), s.
        speed: The highest speed allowed there, m/s.
    """

    intervals: FloatArray
    speed: float


def _slowed(problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory slowed in the zones, the same one if it is slow there; durations are not looked at."""
    kept = enforced(backend)
    path = path.keeping(kept)
    if "jerk" not in kept:
        path = replace(path, limits=path.limits.without(["jerk"]))
    middles, segments = trajectory.breakpoints[:-1] + trajectory.lengths / 2.0, trajectory.segments
    moves = (middles > trajectory.departures[segments]) & (middles < trajectory.arrivals[segments + 1])
    checkers = segment_checkers(problem, path.positions)
    motions = [trajectory.of(np.array([row])) for row in range(len(segments))]
    changed = False
    for run in path.every_run:
        rows = np.flatnonzero(moves & np.isin(segments, run.segments))
        if not len(rows):
            continue
        motion, checker = trajectory.of(rows), checkers[run.first]
        bodies = moving_bodies(path.dynamics.robot_on(run.first), checker)
        zones = [
            _Slow(near_intervals(checker, motion, zone.clearance + WIDER, zone.objects), zone.speed)
            for zone in problem.speed_zones
        ]
        zones = [zone for zone in zones if len(zone.intervals)]
        if all(_excess(bodies, motion, zone.intervals, zone.speed) <= 1.0 for zone in zones):
            continue
        _refuse_what_cannot_be_slowed(backend, path, run)
        for row, own in zip(rows.tolist(), _retimed(path, run, motion, bodies, zones, kept), strict=True):
            motions[row] = own
        changed = True
    return _assembled(trajectory, motions) if changed else trajectory


def _refuse_what_cannot_be_slowed(backend: BackEnd, path: JointPath, run: Run) -> None:
    """Refuse runs whose velocities or ramps are asked, which would be others.

    Raises:
        InvalidProblem: Naming the options or the waypoints.
    """
    faults: list[tuple[FieldPath, str]] = []
    ends, moving = end_states(backend, path.robot.dof), path.moving
    is_first, is_last = run.first == moving[0], run.segments[-1] == moving[-1]
    for name, concerned in zip(END_OPTIONS, (is_first, is_first, is_last), strict=True):
        if concerned and any(getattr(backend, name, None) or ()) and (ends.starts_moving or ends.ends_moving):
            faults.append(((BACK_END, name), "a motion is slowed in speed zones only from rest to rest"))
    ramps = [name for name in RAMP_OPTIONS if getattr(backend, name, None) is not None]
    message = "ramps of given times cannot be kept where speed zones slow the motion"
    faults += [((BACK_END, name), message) for name in ramps]
    for segment in sorted(path.passed_at.keys() & set(run.segments.tolist())):
        message = "a velocity here cannot be kept where speed zones slow the motion"
        faults.append((("waypoints", segment, "transition", "velocity"), message))
    if faults:
        raise InvalidProblem(faults)


def _retimed(
    path: JointPath,
    run: Run,
    motion: SegmentedPolynomial,
    bodies: Bodies,
    zones: Sequence[_Slow],
    kept: frozenset[str],
) -> list[SegmentedPolynomial]:
    """Return what takes the place of each piece of the motion of a run, slowed in zones.

    Args:
        path: The path, with the limits that are kept.
        run: One of its runs.
        motion: The motion of the run.
        bodies: What moves.
        zones: Where it is near to objects.
        kept: The quantities whose limits are kept.
    """
    limits = LimitsOnCurve(path.dynamics.robot_on(run.first), path.limits, motion)
    for count in INTERVALS:
        law = _as_planned(motion, [zone.intervals for zone in zones], count)
        within = [_overlaps(law, zone.intervals) for zone in zones]
        speeds = np.full(len(law.lengths), np.inf)
        for own, zone in zip(within, zones, strict=True):
            speeds[own] = np.minimum(speeds[own], zone.speed * SHARE)
        unknowns = fastest_retiming(law.lengths, _with_speeds(limits.along(law), bodies, motion, law, speeds), GAP)
        timed, of = compose(motion, retimed(law, unknowns), run.tolerance)
        under = motion.locate(law.coefficients[:, 0, 0] + law.lengths / 2.0)[0][of]  # the pieces of the motion
        pieces = timed.of_segments(motion.segments[under])
        factor = slowest(time_scalings(path, pieces, kept).values()).factor
        for own, zone in zip(within, zones, strict=True):
            times = np.column_stack([pieces.breakpoints[:-1], pieces.breakpoints[1:]])[own[of]]
            factor = max(factor, _excess(bodies, pieces, times, zone.speed))
        if factor <= ENOUGH:
            break
    pieces = pieces.stretched(max(factor, 1.0))
    return [pieces.of(np.flatnonzero(under == k)) for k in range(len(motion.lengths))]


def _excess(bodies: Bodies, motion: PiecewisePolynomial, intervals: FloatArray, speed: float) -> float:
    """Bound the share of a speed, m/s, that is used within intervals (N, 2), s, so that the certificate agrees."""
    limit = speed / (1.0 + DECIDED_TO)
    return most_speed(bodies, motion, intervals, limit)[0] / limit


def _as_planned(motion: PiecewisePolynomial, zones: Sequence[FloatArray], count: int) -> PiecewisePolynomial:
    """Return the law x(t) = t, in pieces that end where those of the motion and intervals (N, 2) in zones do.

    Args:
        motion: The motion.
        zones: Intervals (N, 2) of each zone, s.
        count: The number of pieces, at least.
    """
    nodes = motion.breakpoints.tolist()
    even = np.linspace(0.0, nodes[-1], count + 1)
    for at in np.concatenate([*map(np.ravel, zones), even]).tolist():
        k = bisect(nodes, at)
        if min(abs(at - node) for node in nodes[max(k - 1, 0) : k + 1]) > CLOSEST * even[1]:
            nodes.insert(k, at)
    lengths = np.diff(nodes)
    coefficients = np.zeros((len(lengths), 1, 2))
    coefficients[:, 0, 0], coefficients[:, 0, 1] = nodes[:-1], 1.0
    return PiecewisePolynomial(lengths, coefficients)


def _overlaps(law: PiecewisePolynomial, intervals: FloatArray) -> np.ndarray:
    """Return whether pieces (N,) of a law of one to one meet any of some intervals (M, 2), s."""
    starts = law.coefficients[:, 0, 0]
    ends = np.append(starts[1:], law.breakpoints[-1])
    first = np.searchsorted(intervals[:, 1], starts, side="right")
    meets = np.append(intervals[:, 0], np.inf)[first] < ends
    return np.asarray(meets, dtype=bool)


def _with_speeds(
    limits: LinearLimits, bodies: Bodies, motion: PiecewisePolynomial, law: PiecewisePolynomial, speeds: FloatArray
) -> LinearLimits:
    """Add to limits those of the speeds (pieces of the law,), m/s, and that nothing is faster than it was planned."""
    times = (law.coefficients[:, 0, 0] + GRIDPOINTS[:, None] * law.lengths).ravel()
    used = point_speeds(bodies, *motion.evaluate(times, [0, 1])) / np.tile(speeds, len(GRIDPOINTS))
    none = np.zeros((2, len(times)))
    yes = none + 1.0
    rows = (np.stack([used**2, yes[0]]), none, none, none, yes, none)
    own = (limits.by_b, limits.by_a, limits.by_c, limits.offset, limits.constant, limits.inverse)
    return LinearLimits(*(np.concatenate(parts) for parts in zip(own, rows, strict=True)))


def _assembled(trajectory: Trajectory, motions: Sequence[SegmentedPolynomial]) -> Trajectory:
    """Return a trajectory with motions in the place of its pieces; waypoints stay at the breakpoints where they are."""
    whole = joined(motions)
    last = np.cumsum([0, *(len(motion.lengths) for motion in motions)])
    times = whole.breakpoints[last]
    arrivals, departures = (
        np.interp(at, trajectory.breakpoints, times) for at in (trajectory.arrivals, trajectory.departures)
    )
    return replace(
        trajectory,
        lengths=whole.lengths,
        coefficients=whole.coefficients,
        segments=whole.segments,
        arrivals=arrivals,
        departures=departures,
    )
