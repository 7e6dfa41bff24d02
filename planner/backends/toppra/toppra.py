"""Time-optimal on the exact path, by reachability analysis."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from planner.backends.base import enforced
from planner.backends.jerk_limited.straight_lines import along_lines
from planner.backends.jerk_limited.time_law import time_run
from planner.backends.shared.assembly import assemble
from planner.backends.shared.refusals import duration_of_run, infeasible_duration_error, no_duration_error
from planner.backends.shared.sampled_limits import SampledLimits
from planner.backends.shared.smooth_curve import smooth_curve, smoothed
from planner.backends.shared.straight_lines import time_lines
from planner.backends.shared.time_laws import MOST_HALVINGS
from planner.backends.shared.time_scaling import slowest, time_scalings
from planner.backends.toppra.intervals import FEWEST, cut, law_limits
from planner.backends.toppra.reachability import fastest_law
from planner.backends.trapezoidal.trapezoidal import fastest_trapezoids
from planner.guarantees import ALL_HARD, Guarantee
from planner.polynomials import SegmentedPolynomial, horner, quintic_hermite
from planner.tolerances import DURATION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.backends.shared.time_scaling import TimeScaling
    from planner.backends.toppra.intervals import Intervals
    from planner.paths import JointPath, Run
    from planner.polynomials import PiecewisePolynomial
    from planner.spatial import FloatArray
    from planner.trajectory import Trajectory

LOOSE, WASTE = 0.025, 0.03
"""Share of the limits that may be unused on average; until then intervals are cut where this share of the mean time of
an interval is wasted. A third to a half of it is lost in time."""

MOST_REFINEMENTS, MOST_PARTS = 3, 4
"""Times that intervals are cut, and parts that one is cut into at once."""

FEW, HANDICAP = 8, 1.15
"""Intervals between waypoints for a first look at how fast another curve is, and the factor by which it may be slower
then and yet be compared in earnest: so few intervals lose 4 to 13 %."""

MOST_REPAIRS, REPAIR = 3, 1.003
"""Times that limits are tightened on segments that break them by a factor on time; less is left to all segments."""


@dataclass(frozen=True)
class Toppra:
    """The time-optimal motion along the exact path: at every instant some joint is at a limit.

    A straight joint motion that only velocity and acceleration limit is a trapezoid, in closed form. Everything else
    is found by reachability analysis; and through waypoints, where what lies between is free, on a smoother curve.

    Attributes:
        jerk_limited: Whether to keep the jerk limits, too, by the fastest law found on the same path that does.
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
        if self.jerk_limited:
            lines = time_lines(path, path.straight, along_lines, partial(time_run, path))
            return assemble(path, [*lines, *(time_run(path, smoothed(path, run)) for run in path.runs)])
        straight = path.straight
        easy = ~SampledLimits(path.robot, straight.limits).limited
        parts = [fastest_trapezoids(straight.of(easy))] if easy.any() else []
        done = set(straight.segments[easy].tolist())
        runs = [run for run in path.every_run if run.first not in done]
        if runs:
            parts.append(_time(path, runs, enforced(self)))
        return assemble(path, parts)


def _time(path: JointPath, runs: Sequence[Run], kept: frozenset[str]) -> SegmentedPolynomial:
    """All runs at once, each at its asked duration or the shortest.

    An even stretch of a motion keeps all limits that the motion keeps; torques with their gravity, too: at each place
    they come to lie between those of the motion and those of standing still.
    """
    asked = np.array([duration_of_run(path, run) for run in runs])
    owner = np.repeat(np.arange(len(runs)), [len(run.segments) for run in runs])
    segments = np.concatenate([run.segments for run in runs])
    pieces, needed = _within_limits(path, _fastest(path, runs), np.array([run.tolerance for run in runs]), kept)
    rows = np.searchsorted(segments, pieces.segments)
    own = owner[rows]
    factors = np.zeros(len(runs))
    for segment, scaling in needed.items():
        run = owner[np.searchsorted(segments, segment)]
        factors[run] = max(factors[run], scaling.factor)
    times = np.bincount(own, pieces.lengths)
    shortest = factors * times
    free = np.isnan(asked)
    for k in np.flatnonzero(free & (factors <= 0.0)).tolist():
        raise no_duration_error(runs[k].first)
    short = np.flatnonzero(asked < shortest * (1.0 - DURATION_TOLERANCE)).tolist()
    if short:
        binding = slowest(needed[segment] for segment in runs[short[0]].segments.tolist()).binding
        too_short = {runs[k].first: float(shortest[k]) for k in short}
        raise infeasible_duration_error(float(asked[short[0]]), too_short, binding)
    return pieces.stretched(np.where(free, factors, asked / times)[own])


class Law(NamedTuple):
    """Constant s'' on each interval of curves.

    Attributes:
        intervals: Of the curves.
        x: (intervals + 1,), s'^2 at their breakpoints.
        u: (intervals,), s'' on each.
    """

    intervals: Intervals
    x: FloatArray
    u: FloatArray

    @property
    def times(self) -> FloatArray:
        """(intervals,), s."""
        speeds = np.sqrt(self.x)
        times: FloatArray = 2.0 * self.intervals.lengths / (speeds[:-1] + speeds[1:])
        return times

    @property
    def durations(self) -> FloatArray:
        """(runs,), s."""
        durations: FloatArray = np.bincount(self.intervals.runs, self.times).astype(np.float64)
        return durations


def _fastest(path: JointPath, runs: Sequence[Run]) -> Law:
    """The fastest law along the runs; where what lies between waypoints is free, along the faster of two curves.

    That is nearly always the smoother one, and a look at the other on few intervals settles it.
    """

    def fastest(
        of: Sequence[Run],
        curves: Sequence[PiecewisePolynomial],
        fewest: int = FEWEST,
        refinements: int = MOST_REFINEMENTS,
    ) -> Law:
        intervals = cut(of, curves, path.limits.velocity, fewest)
        return fastest_on(path, intervals, np.ones(len(path.durations)), refinements)

    curves = [smooth_curve(path, run) if run.is_spline else run.curve for run in runs]
    law = fastest(runs, curves)
    durations = law.durations
    rivals = [k for k, run in enumerate(runs) if run.is_spline and curves[k] is not run.curve]
    for fewest, refinements, handicap in ((FEW, 0, HANDICAP), (FEWEST, MOST_REFINEMENTS, 1.0)):
        if rivals:
            own = fastest([runs[k] for k in rivals], [runs[k].curve for k in rivals], fewest, refinements).durations
            rivals = [k for k, duration in zip(rivals, own, strict=True) if duration < handicap * durations[k]]
    if not rivals:
        return law
    return fastest(runs, [run.curve if k in rivals else curves[k] for k, run in enumerate(runs)])


def _within_limits(
    path: JointPath, law: Law, tolerances: FloatArray, kept: frozenset[str]
) -> tuple[SegmentedPolynomial, dict[int, TimeScaling]]:
    """The fastest motion, and how its segments are still to be scaled in time: hardly at all.

    Limits that are computed at samples may be broken between them. Where one is broken by more than a little, it is
    tightened on that segment only.
    """
    factors = np.ones(len(path.durations))
    for repair in range(MOST_REPAIRS):
        if repair:
            law = fastest_on(path, law.intervals, factors)
        pieces = _pieces(law, tolerances)
        needed = time_scalings(path, pieces, kept)
        if max(scaling.factor for scaling in needed.values()) <= REPAIR:
            break
        for segment, scaling in needed.items():
            factors[segment] *= max(scaling.factor, 1.0)
    return pieces, needed


def fastest_on(path: JointPath, intervals: Intervals, factors: FloatArray, refinements: int = MOST_REFINEMENTS) -> Law:
    """The fastest law with constant s'' on each interval, where they are cut until little is lost by that."""
    for refinement in range(refinements + 1):
        limits = law_limits(path.robot, path.limits, intervals, factors)
        law = Law(intervals, *fastest_law(intervals.lengths, limits.rows, limits.most, intervals.rests))
        if refinement == refinements:
            break
        times = law.times
        lost = times * limits.looseness(law.x, law.u)
        loose = np.bincount(intervals.runs, lost) / np.bincount(intervals.runs, times) > LOOSE
        if not loose.any():
            break
        mean = np.bincount(intervals.runs, times) / np.bincount(intervals.runs)
        worth = np.where(loose, 1.0 / (WASTE * mean), 0.0)[intervals.runs]
        parts = np.clip(np.ceil(np.sqrt(lost * worth)), 1, MOST_PARTS).astype(int)
        if (parts == 1).all():
            break
        intervals = intervals.split(parts)
    return law


def _pieces(law: Law, tolerances: FloatArray) -> SegmentedPolynomial:
    """Quintics in time that meet the curves, their velocity and acceleration at both ends of each interval.

    Intervals are halved until the quintics keep to the curves within their tolerances (runs,).
    """
    for _ in range(MOST_HALVINGS):
        intervals, x, u = law
        speeds, d, times = np.sqrt(x), intervals.lengths, law.times
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
        # Within an interval x is linear in s.
        x = np.insert(x, np.flatnonzero(rough) + 1, (x[:-1] + x[1:])[rough] / 2.0)
        law = Law(intervals.split(1 + rough), x, np.repeat(u, 1 + rough))
    return SegmentedPolynomial(times, coefficients, intervals.segments)
