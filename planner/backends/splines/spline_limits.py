"""A spline held against its limits: its peaks, exactly, and how they change with the durations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.splines.shortest_durations import LinearisedLimits
from planner.guarantees import JOINT_DERIVATIVES
from planner.tolerances import DURATION_TOLERANCE, LIMIT_TOLERANCE
from planner.trajectories.polynomials import bernstein_matrix, differentiate, horner

if TYPE_CHECKING:
    from planner.backends.splines.interpolation import InterpolatingSpline
    from planner.limits import SegmentLimits
    from planner.spatial import FloatArray

HIGHEST_LIMITED_ORDER = {3: 2, 5: 3}
"""Order of the highest derivative, by degree of the spline, that has no jumps and whose limits the spline keeps."""

NEAR = 0.65
"""Share of the worst rate (all brought to first order) above which rates are looked into."""

NEAR_POSITION = 0.1
"""Distance from a position limit, relative to the joint's travel, up to which positions are looked into."""

OVERSHOOT_TOLERANCE = 0.1 * LIMIT_TOLERANCE
"""Excess over a position limit, relative to the joint's travel, that is rounding. The certificate measures it by half
of the joint's range, and the travel may be twice as long as that."""

LEAST_LOG_RATIO = -50.0
"""Logarithm of the ratio that stands for none, of a segment that nothing limits: far below all others, and finite."""

MOST_ROOT_STEPS = 30
"""Number of steps of Newton's method or of bisection to a root, at most."""

ROOT_TOLERANCE = 1e-6
"""Change of a root, in unit time, that ends the search: the value of an extremum changes by the square of that."""

AT_WAYPOINT = 10.0 * ROOT_TOLERANCE
"""Distance of an extremum from a waypoint, in unit time, that may be the rounding of a root."""


@dataclass(eq=False)
class DurationsTooShort(Exception):
    """The asked durations break a limit, and longer free ones are no help worth their length.

    All durations times a factor keep the limits: not always by the least factor that would, where some are free.

    Attributes:
        segment: Index of the segment with the worst excess.
        joint: Index of its joint.
        quantity: `velocity`, `acceleration` or `jerk`.
        value: The peak magnitude of the quantity there.
        limit: The limit of the quantity there.
        factor: The factor by which all durations have to be longer.
        durations: (segments,), s, that keep the limits: asked ones times `factor`, free ones to go with them.
    """

    segment: int
    joint: int
    quantity: str
    value: float
    limit: float
    factor: float
    durations: FloatArray


@dataclass(eq=False)
class PositionOvershoot(Exception):
    """The spline leaves the position limits between waypoints, whatever the free durations.

    Attributes:
        segment: Index of the segment with the worst excess.
        joint: Index of its joint.
        value: The position there.
        limit: The limit that it breaks.
    """

    segment: int
    joint: int
    value: float
    limit: float


@dataclass(frozen=True, eq=False)
class SplineAgainstLimits:
    """A spline and its peaks: where rates and positions may come nearest to their limits.

    Attributes:
        spline: The spline, at certain durations.
        limits: The limits of each segment and joint.
        segment: Index (peaks,) of the segment.
        joint: Index (peaks,) of the joint.
        order: Order (peaks,) of the derivative; 0: position.
        u: Unit time (peaks,) on the segment.
        value: Value (peaks,) of the derivative there, rad or m by powers of s.
        excess: Excess (peaks,): log(|rate| / limit) / order, or a position's overshoot relative to the joint's range.
        weight: Derivative (peaks,) of the excess by the value.
    """

    spline: InterpolatingSpline
    limits: SegmentLimits
    segment: np.ndarray
    joint: np.ndarray
    order: np.ndarray
    u: FloatArray
    value: FloatArray
    excess: FloatArray
    weight: FloatArray

    @property
    def durations(self) -> FloatArray:
        """The durations (segments,), s."""
        return self.spline.durations

    @cached_property
    def ratios(self) -> FloatArray:
        """The worst (segments,) of velocity, sqrt(acceleration) and cbrt(jerk) as ratios to their limits."""
        rates = self.order > 0
        worst = np.full(len(self.durations), LEAST_LOG_RATIO)
        np.maximum.at(worst, self.segment[rates], self.excess[rates])
        ratios: FloatArray = np.exp(worst)
        return ratios

    @cached_property
    def excesses(self) -> FloatArray:
        """The worst excess (segments,) of a rate or a position, less what is rounding; up to 0: all limits are kept."""
        worst = np.full(len(self.durations), LEAST_LOG_RATIO)
        rounding = np.where(self.order > 0, DURATION_TOLERANCE, OVERSHOOT_TOLERANCE)
        np.maximum.at(worst, self.segment, self.excess - rounding)
        return worst

    @cached_property
    def overshoot(self) -> float:
        """The excess over the position limits, relative to the range of the joint's waypoints; 0: none."""
        overshoot = float(self.excess[self.order == 0].max(initial=0.0))
        return overshoot if overshoot > OVERSHOOT_TOLERANCE else 0.0

    def linearise(self) -> LinearisedLimits:
        """Return the peaks that a change of the durations could bring over their limits, and those over them."""
        near = np.where(self.order > 0, self.excess > np.log(NEAR * self.ratios.max()), self.excess > -NEAR_POSITION)
        peaks = (self.segment[near], self.joint[near], self.order[near], self.u[near])
        slopes = self.spline.sensitivities(*peaks) * self.weight[near, None]
        return LinearisedLimits(self.excess[near], slopes, self.order[near] > 0)

    def refuse_overshoot(self) -> None:
        """Raise PositionOvershoot where the spline leaves the position limits by most, if it does."""
        if self.overshoot == 0.0:
            return
        positions = np.flatnonzero(self.order == 0)
        worst = int(positions[np.argmax(self.excess[positions])])
        segment, joint, value = int(self.segment[worst]), int(self.joint[worst]), float(self.value[worst])
        raise PositionOvershoot(segment, joint, value, self.limit_at(worst))

    def too_short_error(self) -> DurationsTooShort:
        """Return the error that names the worst rate."""
        rates = np.flatnonzero(self.order > 0)
        worst = int(rates[np.argmax(self.excess[rates])])
        factor = float(self.ratios.max())
        return DurationsTooShort(
            segment=int(self.segment[worst]),
            joint=int(self.joint[worst]),
            quantity=JOINT_DERIVATIVES[self.order[worst]],
            value=float(abs(self.value[worst])),
            limit=abs(self.limit_at(worst)),
            factor=factor,
            durations=self.durations * factor,
        )

    def limit_at(self, peak: int) -> float:
        """Return the limit that a peak comes nearest to, or breaks."""
        segment, joint, upward = int(self.segment[peak]), int(self.joint[peak]), bool(self.weight[peak] > 0.0)
        if self.order[peak] == 0:
            return float(self.limits.position[upward][joint])
        return float(self.limits.bounds(JOINT_DERIVATIVES[self.order[peak]])[upward][segment, joint])


def hold_against_limits(
    spline: InterpolatingSpline, positions: FloatArray, limits: SegmentLimits
) -> SplineAgainstLimits:
    """Find the peaks of a spline: its rates at the waypoints, and every extremum that could matter.

    What matters is held against the rest of its own part: the waypoints with velocities that are given cut the spline.
    Such a velocity is no peak: no duration changes it.
    """
    degree, h = spline.degree, spline.durations
    rates = JOINT_DERIVATIVES[1 : HIGHEST_LIMITED_ORDER[degree] + 1]
    by_order = [spline.unit]
    for _ in range(degree - 1):
        by_order.append(differentiate(by_order[-1]))
    span = np.ptp(positions, axis=0)
    span = np.where(span > 0.0, span, 1.0)

    allowed = [limits.magnitudes(quantity) * h[:, None] ** order for order, quantity in enumerate(rates, start=1)]
    at_waypoints = [
        _ratios_at_ends(by_order[order], allowed[order - 1], limits.bounds(quantity).weights)
        for order, quantity in enumerate(rates, start=1)
    ]
    largest = [ratios.max(axis=(1, 2)) ** (1.0 / order) for order, ratios in enumerate(at_waypoints, start=1)]
    parts = np.append(0, np.cumsum(spline.given))  # which know nothing of each other
    of_parts = np.maximum.reduceat(np.max(largest, axis=0), np.flatnonzero(np.diff(parts, prepend=-1)))
    near = NEAR * of_parts[parts, None]
    matters = np.zeros(span.shape, bool)
    for order, measure in enumerate(allowed, start=1):
        bounds = np.abs(by_order[order] @ bernstein_matrix(degree + 1 - order))
        matters = matters | (bounds.max(axis=2) / measure > near**order)
    control, room = spline.unit @ bernstein_matrix(degree + 1), NEAR_POSITION * span
    may_leave = control.max(axis=2) > limits.position.upper - room
    may_leave |= control.min(axis=2) < limits.position.lower + room

    found = [_waypoint_peaks(order, ratios, spline.given) for order, ratios in enumerate(at_waypoints, start=1)]
    segments, joints = np.nonzero(matters | may_leave)
    leaving = may_leave[segments, joints]
    pieces = [coefficients[segments, joints] for coefficients in by_order]
    # The extrema of each derivative lie between those of the next.
    brackets = np.tile([0.0, 1.0], (len(segments), 1))
    for order in range(degree - 2, -1, -1):
        if order == 0:
            segments, joints, brackets = segments[leaving], joints[leaving], brackets[leaving]
            pieces = [piece[leaving] for piece in pieces]
        extrema = _roots(pieces[order + 1], brackets)
        brackets = np.sort(np.column_stack([brackets[:, :1], extrema, brackets[:, -1:]]), axis=1)
        if order <= len(rates):
            rows, columns = np.nonzero(extrema)
            if order == 1:
                apart = ~_is_given(spline.given, segments[rows], extrema[rows, columns])
                rows, columns = rows[apart], columns[apart]
            found.append((segments[rows], joints[rows], np.full(len(rows), order), extrema[rows, columns]))
    segment, joint, orders, u = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    value = _values(by_order, segment, joint, orders, u) / h[segment] ** orders
    excess, weight = _excess(segment, joint, orders, value, limits, rates, span)
    return SplineAgainstLimits(spline, limits, segment, joint, orders, u, value, excess, weight)


def _ratios_at_ends(coefficients: FloatArray, allowed: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the magnitudes (segments, joints, 2) at unit times 0 and 1, as ratios to what is allowed.

    Args:
        coefficients: Of a derivative, (segments, joints, order).
        allowed: What is allowed in the narrower direction, (segments, joints).
        weights: Shares (2, segments, joints) that this is of the lower and of the upper limit.
    """
    values: FloatArray = np.stack([coefficients[..., 0], coefficients.sum(axis=2)], axis=2)
    return np.abs(values) / allowed[..., None] * np.where(values < 0.0, *weights[..., None])


def _waypoint_peaks(
    order: int, ratios: FloatArray, given: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, FloatArray]:
    """Segments, joints, order and unit times of the rates at waypoints, on the side where the limit is narrower.

    Where the velocity is given, all other rates may jump: there they are looked at on both sides.
    """
    kept = np.ones(ratios.shape, bool)
    kept[1:, :, 0] = ratios[1:, :, 0] > ratios[:-1, :, 1]
    kept[:-1, :, 1] = ~kept[1:, :, 0]
    kept[1:][given, :, 0] = kept[:-1][given, :, 1] = order > 1
    segments, joints, ends = np.nonzero(kept)
    return segments, joints, np.full(len(ends), order), ends.astype(np.float64)


def _is_given(given: np.ndarray, segment: np.ndarray, u: FloatArray) -> np.ndarray:
    """Whether (peaks,) extrema of the velocity, by segment and unit time, are one that is given, but for rounding."""
    starts, ends = np.append(False, given)[segment], np.append(given, False)[segment]
    is_one: np.ndarray = (starts & (u < AT_WAYPOINT)) | (ends & (u > 1.0 - AT_WAYPOINT))
    return is_one


def _values(
    by_order: list[FloatArray], segment: np.ndarray, joint: np.ndarray, order: np.ndarray, u: FloatArray
) -> FloatArray:
    """Evaluate derivatives (peaks,) by unit time at the peaks."""
    value = np.empty(len(u))
    for k in np.unique(order).tolist():
        here = order == k
        value[here] = horner(by_order[k][segment[here], joint[here]], u[here])
    return value


def _excess(
    segment: np.ndarray,
    joint: np.ndarray,
    order: np.ndarray,
    value: FloatArray,
    limits: SegmentLimits,
    rates: tuple[str, ...],
    span: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Compute `excess` and `weight` of `SplineAgainstLimits`."""
    above, below = value - limits.position.upper[joint], limits.position.lower[joint] - value
    upward = np.where(above > below, 1.0, -1.0)
    excess, weight = np.maximum(above, below) / span[joint], upward / span[joint]
    with np.errstate(divide="ignore", over="ignore"):  # of rates that are as good as none
        for k, quantity in enumerate(rates, start=1):
            here = order == k
            lower, upper = (bound[segment[here], joint[here]] for bound in limits.bounds(quantity))
            excess[here] = np.log(value[here] / np.where(value[here] < 0.0, lower, upper)) / k
            weight[here] = 1.0 / (k * value[here])
    return excess, weight


def _roots(polynomials: FloatArray, brackets: FloatArray) -> FloatArray:
    """Find the root between each two neighbouring brackets, by Newton's method kept inside; 0 where there is none.

    Args:
        polynomials: Coefficients (N, order), ascending powers.
        brackets: Arguments (N, count), between which each polynomial is monotone.

    Returns:
        The roots (N, count - 1).
    """
    low, high = brackets[:, :-1], brackets[:, 1:]
    at_low, at_high = horner(polynomials[:, None], low), horner(polynomials[:, None], high)
    rows, columns = np.nonzero(at_low * at_high < 0.0)
    roots = np.zeros(low.shape)
    if len(rows) == 0:
        return roots
    f, low, high = polynomials[rows], low[rows, columns], high[rows, columns]
    at_low, at_high = at_low[rows, columns], at_high[rows, columns]
    slope, rising = differentiate(f), at_low < 0.0
    x = low - at_low * (high - low) / (at_high - at_low)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(MOST_ROOT_STEPS):
            value = horner(f, x)
            before = (value < 0.0) == rising
            low, high = np.where(before, x, low), np.where(before, high, x)
            newton = x - value / horner(slope, x)
            x, last = np.where((newton >= low) & (newton <= high), newton, (low + high) / 2.0), x
            if np.abs(x - last).max() < ROOT_TOLERANCE:
                break
    roots[rows, columns] = x
    return roots
