"""Motions slowed where the robot is near to objects: the same path, timed anew within the limits of its speed zones.

Where the planned motion comes within the clearance of a zone is found first; on the path that does not depend on time.
There the highest speed of all points of the robot is a constraint like any other.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from planner.backends.base import BackEnd, enforced
from planner.certificate.clearance import segment_checkers
from planner.errors import InfeasibleDuration, InvalidProblem, Remedy
from planner.fields import BACK_END, FieldPath
from planner.guarantees import END_OPTIONS, RAMP_OPTIONS, end_states
from planner.paths import JointPath, SegmentGroup
from planner.problems.problem import PlanningProblem
from planner.scene.bodies import Bodies
from planner.spatial import FloatArray
from planner.speed_zones import DECIDED_TO, SPEED_BOUND_EXCESS, PointSpeed, most_speed, moving_bodies, near_intervals
from planner.timing.durations import in_longer_durations, in_requested_durations
from planner.timing.own_path import Part, slow_down
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial
from planner.trajectories.trajectory import Trajectory

WIDER = 4e-3
"""Distance, m, by which zones are widened for slowing, so that they contain the certificate's zones."""

SHARE = 1.0 - 1.5 * SPEED_BOUND_EXCESS
"""Fraction of a zone's speed to which motions are slowed; the certificate's bound exceeds the speed by that much."""


def slowed(problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Slow a trajectory on its own path in speed zones; return it unchanged if it is slow enough.

    Raises:
        InvalidProblem: A segment group that must be slowed has a requested passing, initial or final velocity,
            requested ramps, or requested durations of single segments.
        InfeasibleDuration: A requested duration is too short for the speeds in the zones.
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    if not problem.speed_zones or not len(path.moving):
        return trajectory
    slow = _slowed(problem, backend, path, trajectory)
    requested = ~np.isnan(path.durations)
    if slow is trajectory or (problem.duration is None and not requested[path.moving].any()):
        return slow
    free = replace(path, durations=np.where(np.isin(np.arange(len(requested)), path.moving), np.nan, path.durations))
    fastest = _slowed(problem, backend, free, in_requested_durations(replace(problem, duration=None), backend, free))
    _refuse_short_durations(path, fastest)
    return in_longer_durations(path, fastest, problem.duration)


def _refuse_short_durations(path: JointPath, fastest: Trajectory) -> None:
    """Refuse durations of segments that the zones make impossible, or that belong to longer segment groups.

    Raises:
        InvalidProblem: A segment with a requested duration has no stop before or after it.
        InfeasibleDuration: A duration is too short.
    """
    requested = path.durations
    for group in path.every_group:
        among = group.segments[~np.isnan(requested[group.segments])].tolist()
        if among and len(group.segments) > 1:
            message = "in speed zones a segment keeps a duration only if the robot stops before it and after it"
            raise InvalidProblem([(("waypoints", k + 1, "duration"), message) for k in among])
    took = fastest.arrivals[1:] - fastest.departures[:-1]
    short = [k for k in path.moving.tolist() if requested[k] < took[k] * (1.0 - DURATION_TOLERANCE)]
    if short:
        k = short[0]
        explanation = "the shortest duration of this segment that keeps the limits and the speeds of the zones"
        raise InfeasibleDuration(
            f"segment {{segment}} cannot be done in {requested[k]:g} s: with the speeds of the zones near objects it "
            f"takes {took[k]:.6g} s",
            waypoint=k + 1,
            segment=k,
            value=float(requested[k]),
            limit=float(took[k]),
            remedies=[Remedy(("waypoints", i + 1, "duration"), float(took[i]), explanation) for i in short],
        )


def _slowed(problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory slowed in the zones, the same one if it is slow there; ignore requested durations."""
    checkers = segment_checkers(problem, path.positions)

    def parts_of(group: SegmentGroup, motion: SegmentedPolynomial) -> list[Part]:
        """Return where the robot is near to objects, if it is too fast there."""
        checker = checkers[group.first]
        bodies = moving_bodies(path.dynamics.robot_on(group.first), checker)
        fastest, parts = PointSpeed(bodies), []
        for zone in problem.speed_zones:
            near = near_intervals(checker, motion, zone.clearance + WIDER, zone.objects)
            if len(near):
                parts.append(Part(near, fastest, zone.speed * SHARE, partial(_excess, bodies, zone.speed)))
        if all(part.excess(motion, part.intervals) <= 1.0 for part in parts):
            return []
        _refuse_what_cannot_be_slowed(backend, path, group)
        return parts

    return slow_down(path, trajectory, enforced(backend), parts_of)


def _refuse_what_cannot_be_slowed(backend: BackEnd, path: JointPath, group: SegmentGroup) -> None:
    """Refuse segment groups with requested velocities or ramps, which slowing would change.

    Raises:
        InvalidProblem: A velocity or a ramp is requested; it names the options or the waypoints.
    """
    faults: list[tuple[FieldPath, str]] = []
    ends, moving = end_states(backend, path.robot.dof), path.moving
    is_first, is_last = group.first == moving[0], group.segments[-1] == moving[-1]
    for name, concerned in zip(END_OPTIONS, (is_first, is_first, is_last), strict=True):
        if concerned and any(getattr(backend, name, None) or ()) and (ends.starts_moving or ends.ends_moving):
            faults.append(((BACK_END, name), "a motion is slowed in speed zones only from rest to rest"))
    ramps = [name for name in RAMP_OPTIONS if getattr(backend, name, None) is not None]
    message = "ramps of given times cannot be kept where speed zones slow the motion"
    faults += [((BACK_END, name), message) for name in ramps]
    for segment in sorted(path.passed_at.keys() & set(group.segments.tolist())):
        message = "a velocity here cannot be kept where speed zones slow the motion"
        faults.append((("waypoints", segment, "transition", "velocity"), message))
    if faults:
        raise InvalidProblem(faults)


def _excess(bodies: Bodies, speed: float, motion: PiecewisePolynomial, intervals: FloatArray) -> float:
    """Bound the share of a speed, m/s, that is used within intervals (N, 2), s, so that the certificate agrees."""
    limit = speed / (1.0 + DECIDED_TO)
    return most_speed(bodies, motion, intervals, limit)[0] / limit
