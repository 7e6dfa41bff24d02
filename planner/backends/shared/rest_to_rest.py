"""Straight joint motions from rest to rest: one scalar law s(t) moves all joints along the segment.

Joint j follows q_j(t) = q_j(0) + travel_j s(t / T) with s from 0 to 1, so every derivative of order k scales
with 1 / T^k, and the shortest duration that keeps a limit has a closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.shared.refusals import RAMPS, BindingLimit, infeasible_duration_error, no_duration_error
from planner.backends.shared.sampled_limits import SampledLimits
from planner.polynomials import SegmentedPolynomial, summing_to
from planner.tolerances import DURATION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.errors import InfeasibleDuration
    from planner.paths import StraightMotions
    from planner.spatial import FloatArray


MOST_STRETCHES = 50
"""Times that a segment is lengthened for its sampled limits, each time by less."""


@dataclass(frozen=True, eq=False)
class UnitLaws:
    """The law of each segment on unit time: s(tau) from 0 to 1 in pieces, each in its local time.

    Attributes:
        lengths: (segments, pieces), each row summing to 1; a piece of length 0 is not there.
        coefficients: (segments, pieces, order), ascending powers of local time.
    """

    lengths: FloatArray
    coefficients: FloatArray


@dataclass(frozen=True)
class PolynomialLaw:
    """A law of one polynomial, the same for every segment.

    Attributes:
        coefficients: Of s(tau) on [0, 1], ascending.
        velocity: Peak of |s'|.
        acceleration: Peak of |s''|.
        jerk: Peak of |s'''|, its limits kept; None: jerk is not limited.
    """

    coefficients: tuple[float, ...]
    velocity: float
    acceleration: float
    jerk: float | None = None

    def time(self, motions: StraightMotions) -> SegmentedPolynomial:
        """The motions under this law, at the asked durations or the shortest."""
        travels, limits = np.abs(motions.travels), motions.limits
        bounds = {
            "velocity": self.velocity * travels / limits.velocity,
            "acceleration": np.sqrt(self.acceleration * travels / limits.acceleration),
        }
        if self.jerk is not None:
            bounds["jerk"] = np.cbrt(self.jerk * travels / limits.jerk)
        count = len(travels)
        laws = UnitLaws(np.ones((count, 1)), np.tile(self.coefficients, (count, 1, 1)))
        return time_straight_motions(motions, bounds, lambda _durations: laws)


def time_straight_motions(
    motions: StraightMotions, bounds: dict[str, FloatArray], laws_of: Callable[[FloatArray], UnitLaws]
) -> SegmentedPolynomial:
    """Choose the durations and put the laws on the motions: see `choose_durations`."""
    durations = choose_durations(motions, bounds, laws_of)
    return _timed(motions, laws_of(durations), durations)


def choose_durations(
    motions: StraightMotions, bounds: dict[str, FloatArray], laws_of: Callable[[FloatArray], UnitLaws]
) -> FloatArray:
    """The asked durations (segments,), s, or the shortest that keep the limits.

    Args:
        motions: With asked durations, NaN where the shortest is wanted.
        bounds: Shortest durations (segments, joints), s, that keep each joint limit of closed form.
        laws_of: The laws of the segments at their durations (segments,).

    Raises:
        InfeasibleDuration: An asked duration is shorter than the shortest feasible one.
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit, or nothing limits a segment's duration.
    """
    shortest = np.max([bound.max(axis=1) for bound in bounds.values()], axis=0)
    asked = motions.durations
    free = np.isnan(asked)
    unlimited = np.flatnonzero(free & (shortest <= 0.0))
    if len(unlimited):
        raise no_duration_error(int(motions.segments[unlimited[0]]))
    start = np.where(free, shortest, np.maximum(shortest, asked))
    stretched, binding = _stretched(motions, start, laws_of)
    shortest = np.where(stretched > start, stretched, shortest)
    short = np.flatnonzero(asked < shortest * (1.0 - DURATION_TOLERANCE))
    if len(short):
        raise _infeasible_error(motions, bounds, binding, shortest, short)
    durations: FloatArray = np.where(free, shortest, asked)
    return durations


def _timed(motions: StraightMotions, laws: UnitLaws, durations: FloatArray) -> SegmentedPolynomial:
    segments, pieces, order = laws.coefficients.shape
    scaled = laws.coefficients / durations[:, None, None] ** np.arange(order)
    coefficients = scaled[:, :, None, :] * motions.travels[:, None, :, None]
    coefficients[..., 0] += motions.starts[:, None]
    return SegmentedPolynomial(
        lengths=summing_to(laws.lengths * durations[:, None], durations).ravel(),
        coefficients=coefficients.reshape(segments * pieces, motions.travels.shape[1], order),
        segments=np.repeat(motions.segments, pieces),
    )


def _stretched(
    motions: StraightMotions, durations: FloatArray, laws_of: Callable[[FloatArray], UnitLaws]
) -> tuple[FloatArray, dict[int, BindingLimit]]:
    """The shortest durations (segments,), s, from `durations` on, that keep the sampled limits, which set some of them.

    The second value holds these limits, by row.

    What a law needs does not depend on the duration. Laws whose shape does (a trapezoid with its own times)
    are looked at again at each longer duration, until nothing changes.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    sampled, durations = SampledLimits(motions.robot, motions.limits), durations.copy()
    laws: UnitLaws | None = None
    binding: dict[int, BindingLimit] = {}
    for _ in range(MOST_STRETCHES):
        before, laws = laws, laws_of(durations)
        if laws is before or not sampled.limited.any():
            break
        rows = np.flatnonzero(sampled.limited)
        pieces = _timed(motions, laws, durations)
        own = np.repeat(np.arange(len(durations)), laws.lengths.shape[1])
        there = sampled.limited[own] & (pieces.lengths > 0.0)
        factors, asks = sampled.stretch(pieces.of(there), own[there], np.searchsorted(rows, own[there]))
        limited = factors > 1.0 + DURATION_TOLERANCE
        binding |= {row: sampled.each[limit] for row, limit in zip(rows[limited], asks[limited], strict=True)}
        durations[rows[limited]] *= factors[limited]
    return durations, binding


def _infeasible_error(
    motions: StraightMotions,
    bounds: dict[str, FloatArray],
    binding: dict[int, BindingLimit],
    shortest: FloatArray,
    short: np.ndarray,
) -> InfeasibleDuration:
    row = int(short[0])
    by_joint = {quantity: float(bound[row].max()) for quantity, bound in bounds.items()}
    quantity = max(by_joint, key=by_joint.__getitem__)
    joint = None if quantity == RAMPS else motions.robot.joint_names[int(np.argmax(bounds[quantity][row]))]
    limit = binding.get(row, BindingLimit(quantity, joint))
    too_short = {int(motions.segments[k]): float(shortest[k]) for k in short}
    return infeasible_duration_error(float(motions.durations[row]), too_short, limit)
