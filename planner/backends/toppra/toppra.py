"""The time-optimal motion along the exact path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import ClassVar

import numpy as np

from planner.backends.base import enforced
from planner.backends.jerk_limited.s_curves import along_lines, time_through_waypoints
from planner.backends.shared.assembly import assemble
from planner.backends.shared.straight_lines import smooth_curve, time_lines
from planner.backends.toppra.intervals import LEAST_GRID_INTERVALS, cut
from planner.backends.toppra.profile import (
    MOST_GRID_REFINEMENTS,
    MOST_PROFILE_REPAIRS,
    Profile,
    fastest_on,
    pieces_of,
    solved_again,
)
from planner.backends.toppra.solvers import Solver, SolverFailed  # Solver: the schema of the options is made from it
from planner.backends.trapezoidal.trapezoidal import fastest_trapezoids, reciprocal_accelerations
from planner.guarantees import ALL_BUT_JERK, ALL_HARD, Capabilities, Guarantee
from planner.paths import JointPath, SegmentGroup, StraightMotions
from planner.spatial import FloatArray
from planner.time_scaling.fastest import time_group
from planner.time_scaling.refusals import duration_of_group, infeasible_duration_error, no_duration_error
from planner.time_scaling.uniform import TimeScaling, slowest, time_scalings
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import SegmentedPolynomial, joined
from planner.trajectories.trajectory import PlanWarning, Trajectory

FEW_INTERVALS = 12
"""Least number of intervals between waypoints for a first look at how fast another curve is."""

HANDICAP = 1.09
"""Ratio of durations up to which a curve that is slower on few intervals is compared on all intervals.

Few intervals lose up to 8.4 % on 168 random lists.
"""

MOST_ATTEMPTS = 4
"""Largest number of profiles that are solved for segments whose motion breaks limits."""

TIGHTENED = 1.001
"""Factor on the time of a segment above which the profile is solved again. Less than that is given to all segments:
half of it is the margin of limits that are sampled."""

NEARLY_MET = 1e-9
"""Relative change of s'^2 up to which a motion counts as the one that is known."""

SLOWED = 1.0
"""Factor on the duration of a trapezoid above which a straight motion is solved like other curves."""


@dataclass(frozen=True)
class Toppra:
    """The time-optimal motion along the exact path: at every instant some joint is at a limit.

    If only velocity and acceleration limit a straight joint motion, it is a trapezoid in closed form. Every other path
    has a velocity profile on our gridpoints, within our values of the limits. Spline groups take a smoother curve
    through their waypoints.

    Attributes:
        jerk_limited: Whether to keep the jerk limits, too, by the fastest time scaling found on the same path that
            does.
        solver: The solver of the velocity profile: the compiled `kernel`, or the `package` toppra.
    """

    kind: ClassVar[str] = "toppra"
    summary: ClassVar[str] = (
        "Time-optimal on the exact path within velocity, acceleration, torque and tool speed limits, C1."
    )
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_BUT_JERK
    capabilities: ClassVar[Capabilities] = Capabilities()

    jerk_limited: bool = field(
        default=False,
        metadata={
            "description": "Keep the jerk limits, too, by the fastest time scaling found along the same path, C2."
        },
    )
    solver: Solver = field(
        default="kernel",
        metadata={
            "description": "The solver of the velocity profile: the compiled `kernel`, or the `package` toppra, which "
            "takes longer. With `jerk_limited` there is no such profile."
        },
    )

    def __post_init__(self) -> None:
        """Let an instance with jerk limited promise more than its class."""
        if self.jerk_limited:
            object.__setattr__(self, "guarantees", ALL_HARD)

    def parametrize(self, path: JointPath) -> Trajectory:
        """Return the fastest motion along the path; where a duration is requested, the same stretched evenly."""
        if self.jerk_limited:
            return _with_limited_jerk(path)
        try:
            return _time_optimal(path.keeping(enforced(self)), self)
        except SolverFailed:
            message = (
                "the solver of the package toppra failed on this path; the motion keeps the jerk limits, too, and is "
                "slower for it"
            )
            return replace(_with_limited_jerk(path), warnings=(PlanWarning("solver_failed", message),))


def _with_limited_jerk(path: JointPath) -> Trajectory:
    """Return the fastest motion found along the path that keeps the jerk limits, too."""
    lines = time_lines(path, path.straight, along_lines, partial(time_group, path))
    return assemble(path, [*lines, *(time_through_waypoints(path, group) for group in path.groups)])


def _time_optimal(path: JointPath, backend: Toppra) -> Trajectory:
    """Return the fastest motion along the path.

    Raises:
        SolverFailed: The package's solver found no profile.
    """
    parts = _lines(path, path.straight, backend)
    solver = backend.solver if path.groups or len(parts) > 1 else None  # all lines in closed form are one part
    if path.groups:
        timed = _time(path, path.groups, backend)
        parts += [_unless_stopping_is_faster(path, group, timed, backend) for group in path.groups]
    return replace(assemble(path, parts), solver=solver)


def _lines(path: JointPath, motions: StraightMotions, backend: Toppra) -> list[SegmentedPolynomial]:
    """Time straight motions from rest to rest: trapezoids, unless torque or the tool's speed binds."""
    return time_lines(path, motions, fastest_trapezoids, lambda group: _time(path, [group], backend), noticed=SLOWED)


def _unless_stopping_is_faster(
    path: JointPath, group: SegmentGroup, timed: SegmentedPolynomial, backend: Toppra
) -> SegmentedPolynomial:
    """Return the timed motion of a group; a spline group stops at each waypoint if that is faster.

    If velocity limits alone bind, straight lines are fastest, and stops cost little.
    """
    own = timed.of(np.isin(timed.segments, group.segments))
    if not group.is_spline or len(group.segments) == 1 or not np.isnan(path.durations[group.segments]).all():
        return own
    motions, duration = path.straight_motions(group.segments), float(own.lengths.sum())
    slowness = (np.abs(motions.travels) / motions.limits.velocity.upper).max(axis=1)
    gaining, braking = reciprocal_accelerations(motions)
    sluggishness = (gaining.max(axis=1) + braking.max(axis=1)) / 2.0
    if not (slowness > 0.0).all():
        return own
    cruises = slowness**2 > sluggishness
    least = np.where(cruises, slowness + sluggishness / slowness, 2.0 * np.sqrt(sluggishness))
    if least.sum() >= duration:
        return own
    stopping = joined(_lines(path, motions, backend))
    return stopping if stopping.lengths.sum() < duration else own


def _time(path: JointPath, groups: Sequence[SegmentGroup], backend: Toppra) -> SegmentedPolynomial:
    """Time all groups at once, each in its requested duration or the shortest.

    A motion that is stretched evenly keeps every limit that it kept before. That includes torques with gravity: each
    torque comes to lie between its value in motion and its value at rest.
    """
    requested = np.array([duration_of_group(path, group) for group in groups])
    group_of = np.repeat(np.arange(len(groups)), [len(group.segments) for group in groups])
    segments = np.concatenate([group.segments for group in groups])
    profile, tolerances = _fastest(path, groups, backend.solver), np.array([group.tolerance for group in groups])
    pieces, needed = _within_limits(path, profile, tolerances, backend)
    rows = np.searchsorted(segments, pieces.segments)
    own = group_of[rows]
    factors = np.zeros(len(groups))
    for segment, scaling in needed.items():
        group = group_of[np.searchsorted(segments, segment)]
        factors[group] = max(factors[group], scaling.factor)
    times = np.bincount(own, pieces.lengths)
    shortest = factors * times
    free = np.isnan(requested)
    for k in np.flatnonzero(free & (factors <= 0.0)).tolist():
        raise no_duration_error(groups[k].first)
    short = np.flatnonzero(requested < shortest * (1.0 - DURATION_TOLERANCE)).tolist()
    if short:
        binding = slowest(needed[segment] for segment in groups[short[0]].segments.tolist()).binding
        too_short = {groups[k].first: float(shortest[k]) for k in short}
        raise infeasible_duration_error(float(requested[short[0]]), too_short, binding)
    return pieces.stretched(np.where(free, factors, requested / times)[own])


def _fastest(path: JointPath, groups: Sequence[SegmentGroup], solver: Solver) -> Profile:
    """Return the fastest profile of the groups; spline groups take the faster of two curves.

    The smoother curve is nearly always faster. A profile of the other one on few intervals decides.
    """

    def fastest(
        curves: Sequence[SegmentedPolynomial],
        fewest: int = LEAST_GRID_INTERVALS,
        steps: tuple[int, int] = (MOST_GRID_REFINEMENTS, MOST_PROFILE_REPAIRS),
    ) -> Profile:
        intervals = cut(curves, path.limits.velocity.narrower, fewest)
        return fastest_on(path, intervals, np.ones(len(path.durations)), *steps, solver=solver)

    curves = [smooth_curve(path, group) if group.is_spline else group.curve for group in groups]
    profile = fastest(curves)
    durations = profile.durations
    rivals = [k for k, group in enumerate(groups) if group.is_spline and curves[k] is not group.curve]
    in_earnest = LEAST_GRID_INTERVALS, (MOST_GRID_REFINEMENTS, MOST_PROFILE_REPAIRS)
    for how, handicap in (((FEW_INTERVALS, (0, 0)), HANDICAP), (in_earnest, 1.0)):
        if rivals:
            rival = fastest([groups[k].curve for k in rivals], *how)
            own = zip(rivals, rival.durations, strict=True)
            rivals = [k for k, duration in own if duration < handicap * durations[k]]
    if not rivals:
        return profile
    if len(rivals) == len(groups):
        return rival
    return fastest([group.curve if k in rivals else curves[k] for k, group in enumerate(groups)])


def _within_limits(
    path: JointPath, profile: Profile, tolerances: FloatArray, backend: Toppra
) -> tuple[SegmentedPolynomial, dict[int, TimeScaling]]:
    """Return the fastest motion, and how its segments are still to be scaled in time: hardly at all.

    Between the places where limits are computed they may be broken. Where one is, by more than a little, the intervals
    of that segment are halved; if that does not help, its limits are tightened. Of very many intervals it is slowed.
    """
    factors = np.ones(len(path.durations))
    needed: dict[int, TimeScaling] = {}
    another = np.unique(profile.intervals.segments)  # segments whose motion is not known yet
    for attempt in range(MOST_ATTEMPTS):
        pieces = pieces_of(profile, tolerances)
        needed |= time_scalings(path, pieces.of(np.isin(pieces.segments, another)), enforced(backend))
        broken = [segment for segment, scaling in needed.items() if scaling.factor > TIGHTENED]
        if not broken or attempt == MOST_ATTEMPTS - 1 or profile.intervals.are_many:
            break
        changed = np.isin(profile.intervals.segments, broken)
        if attempt:
            for segment in broken:
                factors[segment] *= needed[segment].factor
        parts, before = 1 + (changed & (attempt == 0)), profile
        profile = solved_again(path, profile, parts, changed, factors, backend.solver)
        x, own = before.x_at_ends[~changed], profile.x_at_ends[np.repeat(~changed, parts)]
        differs = (np.abs(own - x) > NEARLY_MET * x).any(axis=1)
        another = np.union1d(broken, before.intervals.segments[~changed][differs])
    return pieces, needed
