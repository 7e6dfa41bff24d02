"""Straight joint motions from rest to rest: one time scaling s(t) moves all joints along the segment.

Joint j follows q_j(t) = q_j(0) + travel_j s(t / T) with s from 0 to 1. So every derivative of order k scales with
1 / T^k, and the shortest duration that keeps a limit has a closed form.

Time scalings on unit time are a `SegmentedPolynomial` of one joint: s(tau), with the row of the motion that each piece
moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import InfeasibleDuration
from planner.paths import StraightMotions
from planner.spatial import FloatArray
from planner.time_scaling.refusals import RAMPS, BindingLimit, infeasible_duration_error, no_duration_error
from planner.time_scaling.sampled_limits import SampledLimits
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import SegmentedPolynomial

MOST_STRETCHES = 50
"""Number of times that a segment is lengthened, at most, for its sampled limits; each time by less."""


def unit_scalings(lengths: FloatArray, coefficients: FloatArray) -> SegmentedPolynomial:
    """Make the time scalings of several motions on unit time, each of the same number of pieces.

    Args:
        lengths: Lengths (motions, pieces), each row summing to 1; a piece of length 0 is left out.
        coefficients: Coefficients (motions, pieces, order), ascending powers of local time.
    """
    there = lengths > 0.0
    return SegmentedPolynomial(lengths[there], coefficients[there][:, None], np.nonzero(there)[0])


@dataclass(frozen=True)
class PolynomialScaling:
    """A time scaling of one polynomial, the same for every segment.

    Attributes:
        coefficients: Coefficients of s(tau) on [0, 1], ascending powers.
        velocity: The peak of |s'|.
        acceleration: The peak of |s''|.
        jerk: The peak of |s'''|, its limits kept; None: jerk is not limited.
    """

    coefficients: tuple[float, ...]
    velocity: float
    acceleration: float
    jerk: float | None = None

    def time(self, motions: StraightMotions) -> list[SegmentedPolynomial]:
        """Time motions, if there are any, by this time scaling, at the requested durations or the shortest."""
        if not len(motions.segments):
            return []
        travels, limits = np.abs(motions.travels), motions.limits
        bounds = {
            "velocity": self.velocity * travels / limits.velocity.upper,
            "acceleration": np.sqrt(self.acceleration * travels / limits.acceleration.narrower),
        }
        if self.jerk is not None:
            bounds["jerk"] = np.cbrt(self.jerk * travels / limits.jerk.upper)
        count = len(travels)
        scalings = unit_scalings(np.ones((count, 1)), np.tile(self.coefficients, (count, 1, 1)))
        return [time_straight_motions(motions, bounds, lambda _durations: scalings)]


def time_straight_motions(
    motions: StraightMotions, bounds: dict[str, FloatArray], scalings_of: Callable[[FloatArray], SegmentedPolynomial]
) -> SegmentedPolynomial:
    """Time the motions by these time scalings, in the durations of `_choose_durations`."""
    durations = _choose_durations(motions, bounds, scalings_of)
    return _moved(motions, scalings_of(durations), durations)


def _choose_durations(
    motions: StraightMotions, bounds: dict[str, FloatArray], scalings_of: Callable[[FloatArray], SegmentedPolynomial]
) -> FloatArray:
    """Choose the durations (segments,), s: those requested, or the shortest that keep the limits.

    Args:
        motions: The motions, with requested durations, NaN where the shortest is wanted.
        bounds: Shortest durations (motions, joints), s, that keep each joint limit of closed form.
        scalings_of: The time scalings of the motions on unit time at their durations (motions,).

    Raises:
        InfeasibleDuration: A requested duration is shorter than the shortest feasible one.
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit, or nothing limits a segment's duration.
    """
    shortest = np.max([bound.max(axis=1) for bound in bounds.values()], axis=0)
    requested = motions.durations
    free = np.isnan(requested)
    unlimited = np.flatnonzero(free & (shortest <= 0.0))
    if len(unlimited):
        raise no_duration_error(int(motions.segments[unlimited[0]]))
    start = np.where(free, shortest, np.maximum(shortest, requested))
    stretched, binding = _stretched(motions, start, scalings_of)
    shortest = np.where(stretched > start, stretched, shortest)
    short = np.flatnonzero(requested < shortest * (1.0 - DURATION_TOLERANCE))
    if len(short):
        raise _infeasible_error(motions, bounds, binding, shortest, short)
    return np.where(free, shortest, requested)


def _moved(motions: StraightMotions, scalings: SegmentedPolynomial, durations: FloatArray) -> SegmentedPolynomial:
    """Move the joints by time scalings on unit time, in these durations (motions,), s."""
    rows = scalings.segments
    timed = scalings.stretched(durations[rows])
    coefficients = timed.coefficients * motions.travels[rows][..., None]
    coefficients[..., 0] += motions.starts[rows]
    return replace(timed, coefficients=coefficients, segments=motions.segments[rows])


def _stretched(
    motions: StraightMotions, durations: FloatArray, scalings_of: Callable[[FloatArray], SegmentedPolynomial]
) -> tuple[FloatArray, dict[int, BindingLimit]]:
    """Lengthen durations (segments,), s, until they keep the sampled limits.

    The time that a time scaling needs does not depend on its duration. Time scalings whose shape does (a trapezoid with
    its own times) are looked at again at each longer duration, until nothing changes.

    Returns:
        The durations (segments,), s, and the limits that set some of them, by row.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    sampled, durations = SampledLimits(motions.dynamics, motions.limits), durations.copy()
    scalings: SegmentedPolynomial | None = None
    binding: dict[int, BindingLimit] = {}
    for _ in range(MOST_STRETCHES):
        before, scalings = scalings, scalings_of(durations)
        if scalings is before or not sampled.limited.any():
            break
        rows = np.flatnonzero(sampled.limited)
        there = sampled.limited[scalings.segments]
        own, pieces = scalings.segments[there], _moved(motions, scalings, durations).of(there)
        factors, limits = sampled.stretch(pieces, own, np.searchsorted(rows, own), above=1.0)
        limited = factors > 1.0 + DURATION_TOLERANCE
        binding |= {row: sampled.each[limit] for row, limit in zip(rows[limited], limits[limited], strict=True)}
        durations[rows[limited]] *= factors[limited]
    return durations, binding


def _infeasible_error(
    motions: StraightMotions,
    bounds: dict[str, FloatArray],
    binding: dict[int, BindingLimit],
    shortest: FloatArray,
    short: np.ndarray,
) -> InfeasibleDuration:
    """Return the error for requested durations, of the rows `short`, below the shortest (segments,), s."""
    row = int(short[0])
    by_joint = {quantity: float(bound[row].max()) for quantity, bound in bounds.items()}
    quantity = max(by_joint, key=by_joint.__getitem__)
    joint = None if quantity == RAMPS else motions.robot.joint_names[int(np.argmax(bounds[quantity][row]))]
    limit = binding.get(row, BindingLimit(quantity, joint))
    too_short = {int(motions.segments[k]): float(shortest[k]) for k in short}
    return infeasible_duration_error(float(motions.durations[row]), too_short, limit)
