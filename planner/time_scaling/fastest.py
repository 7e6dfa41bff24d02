"""The fastest time scaling along a curve that keeps every limit, of jerk, too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.guarantees import QUANTITIES
from planner.kernels.retiming import retime_scaling
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.time_scaling.compose import follow_curve, split_at_knots
from planner.time_scaling.limits_on_curve import LimitsOnCurve, limits_on
from planner.time_scaling.linear_limits import LinearLimits
from planner.time_scaling.refusals import duration_of_group
from planner.time_scaling.retiming import RequestedDurations, fastest_retiming
from planner.time_scaling.uniform import scaled_to_duration
from planner.trajectories.polynomials import (
    PiecewisePolynomial,
    SegmentedPolynomial,
)

TIME_ROUNDS = ((50, 5, 3e-2), (31, 24, 3e-3), (250, 0, 1e-3))
"""Rounds of the search: the number of pieces of the time scaling, additional pieces of each segment, and the largest
relative gap to the optimum.

The last round is for short lists: without it five blended lines took up to 2 % longer.
"""

IDLE_LIMIT_SHARE = 0.5
"""Share of a limit that a time scaling uses at most where the limit is left out of the next round."""

MOST_EXTRA_ROUNDS = 10
"""Rounds after these, while a limit is exceeded by more than it may be."""

ENOUGH = 1.003
"""Share of a limit that the time scaling may use between the points that a round looks at: one factor on all times
mends it."""

ENOUGH_OF_DENSE = 1.05
"""The same along a curve with more pieces than the rounds have, such as 2,000 noisy points.

One factor on all times costs up to 1.6 %, and each further round takes seconds.
"""

DENSE_PARTS = 4
"""Number of pieces of the time scaling on each piece of such a curve: with 2 or 3 it is slower by 2 and 1 %."""

HALVING_EXCESS = 1.001
"""Share of a limit above which a piece that uses it is cut in two."""

QUARTERING_EXCESS = 1.05
"""Share of a limit above which a piece is cut in four: the jerk may end long before such a piece does."""

IDLE = 0.9
"""Share of every limit below which a piece waits for a finer grid: it is cut in two, too."""

MOST_IDLE = 0.03
"""Share of the duration that idle pieces may fill: for more of them alone, one round is made."""

MOST_IDLE_PIECES = 400
"""Number of its like in the duration above which an idle piece stays whole: little time can be gained on it."""

GAUSS_POINTS = 5
"""Number of Gauss points on each piece of a time scaling, to integrate the time that it takes after retiming."""

GAUSS_RULE = (np.polynomial.legendre.leggauss(GAUSS_POINTS) + np.array([[1.0], [0.0]])) / 2.0
"""These points, as shares of a piece, and their weights."""

ENFORCED = frozenset(QUANTITIES)
"""The quantities whose limits the time scaling keeps: all there are."""


def time_group(path: JointPath, group: SegmentGroup) -> SegmentedPolynomial:
    """Move along a group's curve from rest to rest by the fastest time scaling s(t) that keeps every limit.

    The time scaling is C2, and its jerk is limited. The search begins with one quintic over the whole group. Each round
    splits its longest pieces and retimes it. The retiming is a smooth function of time even at the ends. There the path
    velocity has a singularity as a function of the path position. One exact factor on all times removes excesses
    between the gridpoints of the search.

    Raises:
        InvalidProblem: A segment that is not alone in its group has a duration.
        InfeasibleDuration: The requested duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    requested = duration_of_group(path, group)
    return scaled_to_duration(path, group, requested, follow_curve(group, fastest_scaling(path, group)), ENFORCED)


def fastest_scaling(path: JointPath, group: SegmentGroup) -> SegmentedPolynomial:
    """Find the time scaling, which may exceed limits slightly between the gridpoints of the search.

    Raises:
        LimitsUnsatisfiable: Gravity exceeds a torque limit.
    """
    scaling, limits = _quintic(group), limits_on(path, group)
    counts = [count + each * len(group.segments) for count, each, _ in TIME_ROUNDS]
    is_dense = len(scaling.lengths) > max(counts)
    if is_dense:  # a time scaling that has nothing to do with its limits would be cut everywhere, time and again
        within = limits.along(scaling)
        if not within.binds:
            return limits.on_segments(scaling)
        scaling = retimed(scaling, fastest_retiming(scaling.lengths, within, TIME_ROUNDS[0][2]))
        scaling = scaling.split(np.full(len(scaling.lengths), DENSE_PARTS))
        scaling = retimed(
            scaling, fastest_retiming(scaling.lengths, near_limits(limits.along(scaling)), TIME_ROUNDS[1][2])
        )
    for number, ((_, _, gap), wanted) in enumerate(zip(TIME_ROUNDS, counts, strict=True)):
        if wanted < len(scaling.lengths):
            continue
        scaling = scaling.split(np.ceil(scaling.lengths / scaling.lengths.sum() * wanted).astype(int))
        within = limits.along(scaling)
        if not within.binds:
            return limits.on_segments(scaling)  # any time scaling will do
        within = near_limits(within) if number else within
        scaling = retimed(scaling, fastest_retiming(scaling.lengths, within, gap))
    enough, gap = (ENOUGH_OF_DENSE, TIME_ROUNDS[1][2]) if is_dense else (ENOUGH, TIME_ROUNDS[-1][2])
    return limits.on_segments(refined(limits, scaling, gap, enough))


def refined(
    limits: LimitsOnCurve,
    scaling: PiecewisePolynomial,
    gap: float,
    enough: float = ENOUGH,
    requested: Callable[[PiecewisePolynomial], RequestedDurations | None] = lambda _: None,
) -> PiecewisePolynomial:
    """Refine a time scaling that is near to the fastest, until it keeps its limits between gridpoints, too.

    Args:
        limits: The limits.
        scaling: The time scaling.
        gap: Relative gap to the optimum that may be left.
        enough: Share of a limit that may be used between gridpoints.
        requested: The requested durations of parts of a time scaling; None: none.
    """
    best, shortest = scaling, np.inf
    for refinement in range(MOST_EXTRA_ROUNDS + 1):
        most, least = limits.used(scaling)
        stretched = float(scaling.lengths.sum() * max(1.0, most.max()) ** 0.5)
        best, shortest = (scaling, stretched) if stretched < shortest else (best, shortest)
        idle = (least < IDLE) & (scaling.lengths > scaling.lengths.sum() / MOST_IDLE_PIECES)
        is_done = most.max() < enough and (
            refinement or scaling.lengths[idle].sum() < MOST_IDLE * scaling.lengths.sum()
        )
        if is_done or refinement == MOST_EXTRA_ROUNDS:
            break
        scaling = scaling.split(np.where(most > QUARTERING_EXCESS, 4, np.where((most > HALVING_EXCESS) | idle, 2, 1)))
        scaling = retimed(
            scaling, fastest_retiming(scaling.lengths, near_limits(limits.along(scaling)), gap, requested(scaling))
        )
    return best


def near_limits(limits: LinearLimits) -> LinearLimits:
    """Return the limits that a nearly fastest time scaling uses to a good part; all, if there are none.

    Whether the others are kept is looked at after each round. With requested durations it may be slow everywhere.
    """
    near = limits.used().max(axis=1) > IDLE_LIMIT_SHARE
    return limits.of(near) if near.any() else limits


def _quintic(group: SegmentGroup) -> PiecewisePolynomial:
    """Return one quintic from rest to rest in 1 s, with the breakpoints of the curve."""
    knots = group.curve.breakpoints
    inner = knots[1:-1]
    whole = PiecewisePolynomial(np.ones(1), knots[-1] * np.array([[[0.0, 0.0, 0.0, 10.0, -15.0, 6.0]]]))
    scaling = split_at_knots(whole, inner, np.zeros(len(inner) + 1, dtype=int))
    scaling.coefficients[1:, 0, 0] = inner
    return scaling


def retimed(scaling: PiecewisePolynomial, unknowns: FloatArray) -> PiecewisePolynomial:
    """Return the time scaling after retiming: quintics with exact speed and acceleration at its nodes."""
    lengths, quintics = retime_scaling(scaling.lengths, scaling.coefficients[:, 0], unknowns, GAUSS_RULE)
    return PiecewisePolynomial(lengths, quintics[:, None])
