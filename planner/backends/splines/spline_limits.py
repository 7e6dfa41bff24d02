"""A spline checked against its limits: its exact peaks, and their derivatives by the durations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.backends.splines.interpolation import Degree, InterpolatingSpline, interpolate
from planner.backends.splines.shortest_durations import LinearisedLimits
from planner.guarantees import JOINT_DERIVATIVES
from planner.kernels.splines import peaks
from planner.limits import SegmentLimits
from planner.spatial import FloatArray
from planner.tolerances import DURATION_TOLERANCE, LIMIT_TOLERANCE

HIGHEST_LIMITED_ORDER = {3: 2, 5: 3}
"""Order of the highest derivative, by degree of the spline, that has no jumps and whose limits the spline keeps."""

NEAR_RATE = 0.65
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
    """The requested durations break a limit, and longer free ones are no help worth their length.

    All durations times a factor keep the limits: not always by the least factor that would, where some are free.

    Attributes:
        segment: Index of the segment with the worst excess.
        joint: Index of its joint.
        quantity: `velocity`, `acceleration` or `jerk`.
        value: The peak magnitude of the quantity there.
        limit: The limit of the quantity there.
        factor: The factor by which all durations have to be longer.
        durations: (segments,), s, that keep the limits: requested ones times `factor`, free ones to go with them.
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
        """The worst excess (segments,) of a rate or a position, less rounding; up to 0: all limits are kept."""
        worst = np.full(len(self.durations), LEAST_LOG_RATIO)
        rounding = np.where(self.order > 0, DURATION_TOLERANCE, OVERSHOOT_TOLERANCE)
        np.maximum.at(worst, self.segment, self.excess - rounding)
        return worst

    @cached_property
    def overshoot(self) -> float:
        """The excess over the position limits, relative to the range of the joint's waypoints; 0: none."""
        overshoot = float(self.excess[self.order == 0].max(initial=0.0))
        return overshoot if overshoot > OVERSHOOT_TOLERANCE else 0.0

    def of(self, segments: np.ndarray) -> SplineAgainstLimits:
        """Return the spline with its peaks on some segments (segments,), bool, alone."""
        own = segments[self.segment]
        fields = ("segment", "joint", "order", "u", "value", "excess", "weight")
        return replace(self, **{name: getattr(self, name)[own] for name in fields})

    def linearise(self) -> LinearisedLimits:
        """Return the peaks that a change of the durations could bring over their limits, and those over them."""
        near = np.where(
            self.order > 0, self.excess > np.log(NEAR_RATE * self.ratios.max()), self.excess > -NEAR_POSITION
        )
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


def checked_splines(
    positions: FloatArray, limits: SegmentLimits, degree: Degree, velocities: FloatArray | None = None
) -> Callable[[FloatArray], SplineAgainstLimits]:
    """Return a function from durations (segments,) to the spline with its peaks; for the arguments see `interpolate`.

    The peaks are the rates at the waypoints, and every extremum that could matter. An extremum matters compared with
    the rest of its own part: waypoints with given velocities cut the spline into parts. A given velocity is no peak: no
    duration changes it.
    """
    rates = [limits.bounds(quantity) for quantity in JOINT_DERIVATIVES[1 : HIGHEST_LIMITED_ORDER[degree] + 1]]
    sides = np.stack([bounds.lower for bounds in rates]), np.stack([bounds.upper for bounds in rates])
    span = np.ptp(positions, axis=0)
    span[span == 0.0] = 1.0

    def checked(durations: FloatArray) -> SplineAgainstLimits:
        spline = interpolate(positions, durations, degree, velocities)
        (segment, joint, order), (u, value, excess, weight) = peaks(
            durations,
            spline.given,
            spline.unit,
            span,
            sides,
            limits.position,
            (NEAR_RATE, NEAR_POSITION, AT_WAYPOINT, ROOT_TOLERANCE, MOST_ROOT_STEPS),
        )
        return SplineAgainstLimits(spline, limits, segment, joint, order, u, value, excess, weight)

    return checked
