"""Time-optimal on the exact path, by reachability analysis."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from planner.backends.along_curve import DURATION_TOLERANCE, MOST_HALVINGS, demands, most_demanding, stretched
from planner.backends.assembly import TimedPieces, assemble
from planner.backends.base import ALL_HARD, Guarantee, enforced
from planner.backends.demands import SampledLimits, duration_of_run, infeasible_duration, nothing_limits
from planner.backends.intervals import FEWEST, Intervals, cut, law_limits
from planner.backends.jerk_limited import time_run
from planner.backends.jerk_limited_joints import along_lines
from planner.backends.reachability import fastest_law
from planner.backends.smooth_curve import smooth_curve
from planner.backends.trapezoidal import fastest_trapezoids
from planner.polynomials import PiecewisePolynomial, horner, quintic_hermite

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.backends.along_curve import Demand
    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run
    from planner.trajectory import Trajectory

LOOSE, WASTE = 0.025, 0.03
"""Share of the limits that may be unused on average; until then intervals are cut where this share of the mean time of
an interval is wasted. A third to a half of it is lost in time."""

MOST_REFINEMENTS, MOST_PARTS = 3, 4
"""Times that intervals are cut, and parts that one is cut into at once."""

COMPARISONS = ((8, 0, 1.13), (FEWEST, MOST_REFINEMENTS, 1.0))
"""Of two curves through waypoints: fewest intervals between waypoints, times that intervals are cut, and by what factor
the less smooth one may be slower and yet stay in the race; it loses more by few intervals, 4 to 12 %."""

MOST_REPAIRS, REPAIR = 3, 1.003
"""Times that limits are tightened on segments that break them by a factor on time; less is left to all segments."""


@dataclass(frozen=True)
class TimeOptimal:
    """As fast as the path allows: at every instant some joint is at a limit.

    A straight joint motion that only velocity and acceleration limit is a trapezoid, in closed form. Everything else
    is found by reachability analysis; and through waypoints, where what lies between is free, on a smoother curve.
    """

    kind: ClassVar[str] = "toppra"
    summary: ClassVar[str] = (
        "Time-optimal on the exact path within velocity, acceleration, torque and tool speed limits, C1."
    )
    guarantees: ClassVar[Mapping[str, Guarantee]] = {**ALL_HARD, "jerk": Guarantee.REPORTED}

    jerk_limited: bool = field(
        default=False,
        metadata={
            "description": "Keep the jerk limits, too: the fastest law found that does, along the same path, C2."
        },
    )

    def __post_init__(self) -> None:
        """With jerk limited, this instance promises more than its class."""
        if self.jerk_limited:
            object.__setattr__(self, "guarantees", ALL_HARD)

    def parametrize(self, path: JointPath) -> Trajectory:
        """The fastest motion along the path; where a duration is asked, the same stretched evenly."""
        straight = path.straight
        easy = ~SampledLimits(path.robot, straight.limits).limited
        closed_form = along_lines if self.jerk_limited else fastest_trapezoids
        parts = [closed_form(straight.of(easy))] if easy.any() else []
        done = set(straight.segments[easy].tolist())
        runs = [run for run in path.every_run if run.first not in done]
        if self.jerk_limited:
            parts += [time_run(path, _smoothed(path, run)) for run in runs]
        elif runs:
            parts.append(_time(path, runs, enforced(self)))
        return assemble(path, parts)


def _smoothed(path: JointPath, run: Run) -> Run:
    """The run on a smoother curve, where what lies between its waypoints is free."""
    return replace(run, curve=smooth_curve(path, run)) if run.is_spline else run


def _time(path: JointPath, runs: Sequence[Run], kept: frozenset[str]) -> TimedPieces:
    """All runs at once, each at its asked duration or the shortest.

    An even stretch of a motion keeps all limits that the motion keeps; torques with their gravity, too: at each place
    they come to lie between those of the motion and those of standing still.
    """
    asked = np.array([duration_of_run(path, run) for run in runs])
    owner = np.repeat(np.arange(len(runs)), [len(run.segments) for run in runs])
    segments = np.concatenate([run.segments for run in runs])
    intervals = cut(runs, _faster_curves(path, runs), path.limits.velocity)
    pieces, needed = _within_limits(path, intervals, np.array([run.tolerance for run in runs]), kept)
    rows = np.searchsorted(segments, pieces.segments)
    own = owner[rows]
    factors = np.zeros(len(runs))
    for segment, demand in needed.items():
        run = owner[np.searchsorted(segments, segment)]
        factors[run] = max(factors[run], demand.factor)
    times = np.bincount(own, pieces.lengths)
    shortest = factors * times
    free = np.isnan(asked)
    for k in np.flatnonzero(free & (factors <= 0.0)).tolist():
        raise nothing_limits(runs[k].first)
    short = np.flatnonzero(asked < shortest * (1.0 - DURATION_TOLERANCE)).tolist()
    if short:
        demand = most_demanding(needed[segment] for segment in runs[short[0]].segments.tolist())
        too_short = {runs[k].first: float(shortest[k]) for k in short}
        raise infeasible_duration(float(asked[short[0]]), too_short, demand.cause, demand.joint)
    return stretched(pieces, np.where(free, factors, asked / times)[own])


def _within_limits(
    path: JointPath, intervals: Intervals, tolerances: FloatArray, kept: frozenset[str]
) -> tuple[TimedPieces, dict[int, Demand]]:
    """The fastest motion, and what its segments still demand: hardly anything.

    Limits that are computed at samples may be broken between them. Where one is broken by more than a little, it is
    tightened on that segment only.
    """
    factors = np.ones(len(path.durations))
    for _ in range(MOST_REPAIRS):
        intervals, x, u = fastest_on(path, intervals, factors)
        pieces = _pieces(intervals, x, u, tolerances)
        needed = demands(path, pieces, kept)
        if max(demand.factor for demand in needed.values()) <= REPAIR:
            break
        for segment, demand in needed.items():
            factors[segment] *= max(demand.factor, 1.0)
    return pieces, needed


def fastest_on(
    path: JointPath, intervals: Intervals, factors: FloatArray, refinements: int = MOST_REFINEMENTS
) -> tuple[Intervals, FloatArray, FloatArray]:
    """The fastest law with constant s'' on each interval, where they are cut until little is lost by that.

    Returns:
        The intervals, s'^2 at their breakpoints, s'' on each.
    """
    for refinement in range(refinements + 1):
        limits = law_limits(path.robot, path.limits, intervals, factors)
        x, u = fastest_law(intervals.lengths, limits.rows, limits.most, intervals.rests)
        times = _times(intervals, x)
        lost = times * limits.looseness(x, u)
        loose = np.bincount(intervals.runs, lost) / np.bincount(intervals.runs, times) > LOOSE
        if refinement == refinements or not loose.any():
            break
        mean = np.bincount(intervals.runs, times) / np.bincount(intervals.runs)
        worth = np.where(loose, 1.0 / (WASTE * mean), 0.0)[intervals.runs]
        parts = np.clip(np.ceil(np.sqrt(lost * worth)), 1, MOST_PARTS).astype(int)
        if (parts == 1).all():
            break
        intervals = intervals.split(parts)
    return intervals, x, u


def _pieces(intervals: Intervals, x: FloatArray, u: FloatArray, tolerances: FloatArray) -> TimedPieces:
    """Quintics in time that meet the curves, their velocity and acceleration at both ends of each interval.

    Intervals are halved until the quintics keep to the curves within their tolerances (runs,).
    """
    for _ in range(MOST_HALVINGS):
        speeds, d, times = np.sqrt(x), intervals.lengths, _times(intervals, x)
        q, first, second = intervals.at(np.array([0.0, 1.0]))
        v = np.array([speeds[:-1], speeds[1:]])[..., None]
        states = q, first * v, second * v**2 + first * u[:, None]
        coefficients = quintic_hermite(times, *(tuple(rows[end] for rows in states) for end in (0, 1)))
        middle = (speeds[:-1] + u * times / 4.0) * times / 2.0 / d
        due = horner(intervals.coefficients, (middle * d)[:, None])
        missed = np.abs(horner(coefficients, times[:, None] / 2.0) - due).max(axis=1)
        rough = missed > tolerances[intervals.runs]
        if not rough.any():
            break
        intervals, u = intervals.split(1 + rough), np.repeat(u, 1 + rough)
        # Within an interval x is linear in s.
        x = np.insert(x, np.flatnonzero(rough) + 1, (x[:-1] + x[1:])[rough] / 2.0)
    return TimedPieces(times, coefficients, intervals.segments)


def _faster_curves(path: JointPath, runs: Sequence[Run]) -> list[PiecewisePolynomial]:
    """The curve of each run; where what lies between the waypoints is free, the faster of its own and a smoother one.

    A comparison on few intervals settles most cases.
    """
    curves = [smooth_curve(path, run) if run.is_spline else run.curve for run in runs]
    undecided = [k for k, run in enumerate(runs) if run.is_spline]
    for fewest, refinements, handicap in COMPARISONS:
        if undecided:
            rivals = [runs[k] for k in undecided]
            own, smooth = (
                _durations(path, cut(rivals, options, path.limits.velocity, fewest), refinements)
                for options in ([run.curve for run in rivals], [curves[k] for k in undecided])
            )
            undecided = np.array(undecided)[own < smooth * handicap].tolist()
    for k in undecided:
        curves[k] = runs[k].curve
    return curves


def _durations(path: JointPath, intervals: Intervals, refinements: int) -> FloatArray:
    """The shortest of each run, about."""
    intervals, x, _ = fastest_on(path, intervals, np.ones(len(path.durations)), refinements)
    durations: FloatArray = np.bincount(intervals.runs, _times(intervals, x)).astype(np.float64)
    return durations


def _times(intervals: Intervals, x: FloatArray) -> FloatArray:
    """(intervals,), s, at constant s''."""
    speeds = np.sqrt(x)
    times: FloatArray = 2.0 * intervals.lengths / (speeds[:-1] + speeds[1:])
    return times
