"""The shortest durations of segments whose motions depend on each other's durations.

Each duration of a spline shapes the whole spline. All durations times k divide velocity by k, acceleration by k^2 and
jerk by k^3. They keep the positions, as for any motion of fixed shape. So the factor with which a motion keeps its rate
limits is exact, and the search varies only the ratios of the durations.

The search is a trust-region sequence of quadratic programs (Nocedal and Wright, Numerical Optimization, 2006,
ch. 18: linearised limits with a penalty on their excess) in the logarithms of the durations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from planner.kernels.quadratic_programs import Gap, QuadraticProgram, solve_quadratic_program
from planner.spatial import FloatArray

MOST_QUADRATIC_PROGRAMS = 45
"""Most quadratic programs in one search. Ten to fifty waypoints far apart need fewer than 14. Dense waypoints on one
line need more: after 14 their motions take up to 1.7 times as long, and rounding decides the factor."""

LEAST_MERIT_GAIN = 3e-3
"""Decrease of the merit (the logarithm of the total duration) that a step must promise to be worth it."""

LARGEST_STEP = 0.8
"""Radius of the trust region: the largest change of the logarithm of a duration in one step."""

PENALTY = 20.0
"""Weight of an excess over a limit against the logarithm of the total duration: many times the possible gain."""

MARGIN = 5e-4
"""Excess below 0 that is aimed at where scaling all durations does not mend a broken limit."""

DUALITY_GAP = 0.05
"""Duality gap, as a share of the gain, at which a quadratic program counts as solved."""

DIFFERENCE = 1e-6
"""Relative change of a duration by which its effect is measured."""

EFFECT_REACH = 7
"""Segments apart whose effects on a motion are measured at once: a spline forgets as fast as 0.43^segments."""

NEAR_RATIO = 0.5
"""Share of the largest ratio above which measured ratios are looked into."""

GROWS_ABOVE = 0.7
"""The share of the predicted success of a step above which the trust region grows."""


class LinearisedLimits(NamedTuple):
    """The limits that are nearly or not kept, to first order in the logarithms of the durations.

    Attributes:
        excess: Excesses (limits,): log(|rate| / limit) / order of a rate, overshoot of a position; positive: broken.
        slopes: Derivatives (limits, segments) of the excesses by the logarithms of the durations.
        is_rate: Whether (limits,) longer durations, all by the same factor, lower the excess.
    """

    excess: FloatArray
    slopes: FloatArray
    is_rate: np.ndarray


class Assessment(Protocol):
    """A motion with certain durations, checked against its limits."""

    @property
    def durations(self) -> FloatArray:
        """The durations (segments,), s."""

    @property
    def ratios(self) -> FloatArray:
        """The worst (segments,) of velocity, sqrt(acceleration) and cbrt(jerk) as ratios to their limits."""

    @property
    def overshoot(self) -> float:
        """The excess over the position limits, relative to the motion; 0: none."""

    def linearise(self) -> LinearisedLimits:
        """Return the limits that a change of the durations could break, and those broken."""


A = TypeVar("A", bound=Assessment)
"""A motion of any kind that is checked against its limits."""


class Evaluation(NamedTuple):
    """The ratios of a motion to its limits.

    Attributes:
        ratios: The positive ratios (segments,): the largest of velocity ratio, sqrt(acceleration ratio) and cbrt(jerk
            ratio) on each segment. All durations times k divide all ratios by k.
        near: A function from durations (segments,) near the motion's to their ratios, to first order. It may
            evaluate only the places where the ratios are reached.
    """

    ratios: FloatArray
    near: Callable[[FloatArray], FloatArray]


def shortest_durations(
    evaluate: Callable[[FloatArray], Evaluation], start: FloatArray, requested: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Find durations of least sum at which a motion keeps its rate limits; of any motion, by its ratios alone.

    A segment's ratio may depend on all durations, mostly on its few neighbours' durations. Slopes are measured, about
    `EFFECT_REACH` evaluations each time.

    Args:
        evaluate: A function from durations (segments,) to the ratios of the motion that has them.
        start: Durations (segments,), s, positive, where the search begins; requested durations replace them.
        requested: Requested durations (segments,), s; NaN where free.

    Returns:
        Durations and their ratios, both (segments,). Requested durations are kept; if a ratio is above 1, they
        cannot be, and all durations times the largest ratio are feasible.
    """
    free = np.isnan(requested)

    def assess(durations: FloatArray) -> _MeasuredMotion:
        return _MeasuredMotion(durations, *evaluate(durations))

    start = np.where(free, start, requested)
    motion = search_durations(assess, start, free) if free.any() else assess(start)
    if free.all():
        motion = assess(motion.durations * motion.ratios.max())
    return motion.durations, motion.ratios


@dataclass(frozen=True, eq=False)
class _MeasuredMotion:
    """A motion known by its ratios alone."""

    durations: FloatArray
    ratios: FloatArray
    near: Callable[[FloatArray], FloatArray]
    overshoot: float = 0.0

    def linearise(self) -> LinearisedLimits:
        """Change every REACH-th duration at once, and put each ratio's change down to the nearest of them."""
        segments = np.arange(len(self.durations))
        excess, slopes = np.log(self.ratios), np.zeros((len(segments), len(segments)))
        total = np.zeros(len(segments))
        for first in range(min(EFFECT_REACH, len(segments))):
            changed = segments[first::EFFECT_REACH]
            stretched = self.durations.copy()
            stretched[changed] *= 1.0 + DIFFERENCE
            nearest = changed[np.clip((segments - first + EFFECT_REACH // 2) // EFFECT_REACH, 0, len(changed) - 1)]
            effects = (np.log(self.near(stretched)) - excess) / DIFFERENCE
            slopes[segments, nearest] = effects
            total += effects
        # All durations times k divide every ratio by k: a segment's own has to make up for what is out of reach.
        slopes[segments, segments] -= 1.0 + total
        near = excess > excess.max() + np.log(NEAR_RATIO)
        return LinearisedLimits(excess[near], slopes[near], np.ones(np.count_nonzero(near), bool))


def search_durations(
    assess: Callable[[FloatArray], A], start: FloatArray, free: np.ndarray, *, may_scale: bool = True
) -> A:
    """Find the motion of least duration that keeps its limits, or else comes nearest to it.

    If all durations are free and may be scaled, the caller has to scale the returned ones by their largest ratio.

    Args:
        assess: A function from durations (segments,) to the motion.
        start: Durations (segments,), s, positive, where the search begins.
        free: Whether (segments,) a duration may change.
        may_scale: Whether all durations times k divide all ratios by k: not where a velocity is given.
    """
    scalable = may_scale and bool(free.all())

    def broken(motion: A) -> float:
        return max(motion.overshoot, 0.0 if scalable else float(np.log(motion.ratios.max())), 0.0)

    def merit(motion: A) -> float:
        stretch = float(motion.ratios.max()) if scalable else 1.0
        return float(np.log(motion.durations.sum() * stretch)) + PENALTY * broken(motion)

    best = assess(start)
    value = merit(best)
    radius = np.full(len(start), LARGEST_STEP)
    for _ in range(MOST_QUADRATIC_PROGRAMS):
        step, promised = _best_step(best, free, radius, scalable=scalable)
        if promised < LEAST_MERIT_GAIN:
            break
        trial = assess(best.durations * np.exp(step))
        excess = np.log(trial.ratios) - (np.log(best.ratios.max()) if scalable else 0.0)
        reached = merit(trial)
        radius = _next_radius(radius, step, excess, (value - reached) / promised)
        if value - reached < 0.7 * promised and excess.max() > 0.0:
            # Give back, only there, what linearised limits promised too much of.
            repaired = assess(trial.durations * np.exp(np.where(free, np.maximum(excess, 0.0), 0.0)))
            trial, reached = min((trial, reached), (repaired, merit(repaired)), key=itemgetter(1))
        if reached < value:
            best, value = trial, reached
    return best


def _next_radius(radius: FloatArray, step: FloatArray, excess: FloatArray, success: float) -> FloatArray:
    """Grow the trust region after a success; else shrink it around the segments whose limits broke."""
    if success > GROWS_ABOVE:
        return np.minimum(2.0 * radius, LARGEST_STEP)
    if excess.max() <= 0.0:
        return 0.5 * radius
    around, moved = _worst_nearby(excess), _worst_nearby(np.abs(step))
    return np.where(around > 0.2 * excess.max(), np.clip(0.5 * moved, 0.25 * radius, 0.7 * radius), radius)


def _worst_nearby(values: FloatArray) -> FloatArray:
    """Take the largest of each value and its two neighbours on either side."""
    worst = values.copy()
    for k in (1, 2):
        np.maximum(worst[k:], values[:-k], out=worst[k:])
        np.maximum(worst[:-k], values[k:], out=worst[:-k])
    return worst


def _best_step(motion: Assessment, free: np.ndarray, radius: FloatArray, *, scalable: bool) -> tuple[FloatArray, float]:
    """Find the best change (segments,) of the logarithms of the durations, and the gain that it promises."""
    durations, limits = motion.durations, motion.linearise()
    excess = limits.excess + np.where(limits.is_rate & scalable, -np.log(motion.ratios.max()), MARGIN)
    slopes = limits.slopes[:, free]
    reachable = excess + np.abs(slopes) @ radius[free] > 0.0
    excess, slopes = excess[reachable], slopes[reachable]
    shares = durations[free] / durations.sum()
    change, promised = _best_change(shares, slopes, excess, radius[free])
    step = np.zeros(len(durations))
    step[free] = change
    return step, promised


def _best_change(
    shares: FloatArray, slopes: FloatArray, excess: FloatArray, radius: FloatArray
) -> tuple[FloatArray, float]:
    """Minimise shares . (d + d^2 / 2) + PENALTY max(0, excess + slopes d) over |d| <= radius.

    The objective is the second-order model of a sum of exponentials. The last variable of the quadratic program is a
    bound on the excess, loose at the start.

    Returns:
        d and the decrease of the minimised function.
    """
    count, variables = slopes.shape
    worst = max(0.0, float(excess.max(initial=0.0)))
    program = QuadraticProgram(
        cost=np.append(shares, PENALTY),
        curvature=np.append(shares, 0.0),
        matrix=np.column_stack([slopes, np.full(count, -1.0)]),
        bounds=-excess,
        lower=np.append(-radius, 0.0),
        # The bound on the excess has no upper side; one that never binds keeps the arrays alike.
        upper=np.append(radius, 100.0 * (worst + 1.0)),
    )

    gap = Gap(0.1 * LEAST_MERIT_GAIN, DUALITY_GAP, PENALTY * worst)
    d = solve_quadratic_program(program, np.append(np.zeros(variables), worst + 0.1), gap)[:-1]
    after = max(0.0, float((excess + slopes @ d).max(initial=0.0)))
    return d, PENALTY * (worst - after) - float(shares @ (d + 0.5 * d * d))
