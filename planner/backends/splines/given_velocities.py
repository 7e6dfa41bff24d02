"""Splines in time through waypoints, C2 of degree 3 or C4 of degree 5, some of them passed with given velocities.

Where a velocity is given, all durations times k do not divide the rates by k: a slow motion swings back before such a
waypoint. The durations that keep the limits may form several ranges. The waypoints with velocities cut the spline into
parts that know nothing of each other. All parts are slowed down together, step by step, until each
keeps its limits; the least factors are then found by bisection. The search of `shortest_durations` begins there for
parts of several segments, and where a part comes near to its limits before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.backends.splines.interpolation import Degree, interpolate
from planner.backends.splines.shortest_durations import search_durations
from planner.backends.splines.spline_limits import (
    DurationsTooShort,
    SplineAgainstLimits,
    checked_splines,
)
from planner.guarantees import JOINT_DERIVATIVES
from planner.limits import SegmentLimits
from planner.spatial import FloatArray
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial


class NothingLimits(Exception):
    """Durations are free, and there is no limit, or no travel, that would set one."""


def timed_spline(
    positions: FloatArray, limits: SegmentLimits, requested: FloatArray, degree: Degree
) -> PiecewisePolynomial:
    """Find the spline that keeps the limits, at the requested durations, and at the shortest for the others.

    The shortest is a local minimum. Between waypoints within the position limits the spline may overshoot them;
    only other ratios of the durations help against that.

    Args:
        positions: Positions (segments + 1, joints), rad or m, within the position limits.
        limits: The limits of each segment and joint.
        requested: Requested durations (segments,), s, positive; NaN: the shortest.
        degree: 3 or 5.

    Raises:
        DurationsTooShort: The requested durations break a limit.
        PositionOvershoot: Position limits are left between waypoints.
        NothingLimits: Nothing sets the free durations.
    """
    free, assess = np.isnan(requested), checked_splines(positions, limits, degree)
    start = np.where(free, _first_guess(positions, limits, degree), requested)
    if free.any() and not (start[free] > 0.0).any():
        raise NothingLimits
    # A segment that nothing limits, or without travel, has a duration only for its neighbours' sake.
    start = np.where(start > 0.0, start, 0.2 * start.max())
    motion = search_durations(assess, start, free) if free.any() else assess(start)
    motion.refuse_overshoot()
    factor = float(motion.ratios.max())
    if free.all():
        return interpolate(positions, motion.durations * factor, degree).curve
    if factor > 1.0 + DURATION_TOLERANCE:
        raise motion.too_short_error()
    return motion.spline.curve


def _first_guess(positions: FloatArray, limits: SegmentLimits, degree: Degree) -> FloatArray:
    """Guess the durations (segments,), s, that the segments would need in a smooth motion."""
    travels = np.abs(np.diff(positions, axis=0))
    velocity, acceleration, jerk = (limits.magnitudes(quantity) for quantity in JOINT_DERIVATIVES[1:])
    needed = np.maximum(travels / velocity, 2.0 * np.sqrt(travels / acceleration))
    if degree == 5:
        needed = np.maximum(needed, 3.0 * np.cbrt(travels / jerk))
    guess: FloatArray = needed.max(axis=1)
    return guess


DURATION_TRIAL_FACTOR = 1.12
"""Factor on the time of a part from one trial to the next. Narrower ranges of durations that keep the limits are
searched for where the trials come near to their limits and go away again."""

PROMISING = 0.2
"""Excess, in the logarithm, up to which a search begins at a trial that is nearer to the limits than its neighbours."""

TIME_BISECTIONS = 14
"""Steps of bisection between a time that is too short and one that is not: to 1e-5 of it."""

LARGEST_REACH = 4.0
"""Multiple of the time in which a smooth motion would do, where the slowing down ends: rates change no more."""


@dataclass(eq=False)
class VelocityOutOfReach(Exception):
    """No durations were found with which a velocity that is given, or two of them, can be had within the limits.

    Attributes:
        segment: Index of the segment with the worst excess, at the durations that come nearest.
        joint: Index of its joint.
        quantity: `position`, `velocity`, `acceleration` or `jerk`.
        value: The value of the quantity there.
        limit: The limit that it breaks.
    """

    segment: int
    joint: int
    quantity: str
    value: float
    limit: float


@dataclass(frozen=True, eq=False)
class PassingSpline:
    """A spline of some degree in search of its durations.

    Attributes:
        positions: Positions (segments + 1, joints), rad or m, within the position limits.
        velocities: Velocities (segments - 1, joints) at the inner waypoints, rad/s or m/s; NaN: not given.
        limits: The limits of each segment and joint.
        degree: 3 or 5.
    """

    positions: FloatArray
    velocities: FloatArray
    limits: SegmentLimits
    degree: Degree

    def durations(self, requested: FloatArray) -> FloatArray:
        """Return durations (segments,), s, with which all limits are kept.

        Args:
            requested: Requested durations (segments,), s, positive; NaN: the shortest.

        Raises:
            DurationsTooShort: The requested durations break a limit that longer ones keep.
            VelocityOutOfReach: No durations were found that keep the limits.
        """
        free = np.isnan(requested)
        slowed, dips = self._slowed(self._first_trial(np.where(free, self._least_durations(), requested), free), free)
        parts, found = self.parts, slowed
        for part in np.unique(parts[free & ((dips != slowed) | (self.excesses(slowed) > 0.0)[parts])]):
            found = self._shorter(found, np.where(parts == part, dips, slowed), free & (parts == part))
        several = free & (np.bincount(parts, weights=free)[parts] > 1.0)
        found = self._shorter(found, slowed, several)
        found = self._shorter(found, found, several)
        excess = self.excesses(found)
        if (excess > 0.0).any():
            raise self._refusal(found, ~free, int(excess.argmax()))
        return found

    def _shorter(self, found: FloatArray, start: FloatArray, free: np.ndarray) -> FloatArray:
        """Return the durations (segments,), s, of the search from `start`, or `found` where these break limits."""
        if not free.any():
            return found
        own = np.isin(self.parts, self.parts[free])
        better = search_durations(lambda h: self.held(h).of(own), start, free, may_scale=False).durations
        excess, shorter = self.excesses(found), np.add.reduceat(better - found, self._firsts) < 0.0
        taken = (self.excesses(better) <= np.maximum(excess, 0.0)) & (shorter | (excess > 0.0))
        return np.where(taken[self.parts], better, found)

    @property
    def parts(self) -> np.ndarray:
        """Index (segments,) of the part between velocities that are given, of each segment."""
        return np.append(0, np.cumsum(~np.isnan(self.velocities).any(axis=1)))

    @cached_property
    def held(self) -> Callable[[FloatArray], SplineAgainstLimits]:
        """A function from durations (segments,) to the spline with these, checked against its limits."""
        return checked_splines(self.positions, self.limits, self.degree, self.velocities)

    def excesses(self, durations: FloatArray) -> FloatArray:
        """Return the worst excesses (parts,) of the spline with these durations (segments,); up to 0: none."""
        worst: FloatArray = np.maximum.reduceat(self.held(durations).excesses, self._firsts)
        return worst

    @property
    def _firsts(self) -> np.ndarray:
        """Index (parts,) of the first segment of each part."""
        return np.flatnonzero(np.diff(self.parts, prepend=-1))

    def _least_durations(self) -> FloatArray:
        """Return durations (segments,), s, that none can be shorter than: at the velocity limits all the way."""
        travels, gains = np.diff(self.positions, axis=0), np.nan_to_num(np.diff(self._at_waypoints(), axis=0))
        times = [_times(travels, self.limits, "velocity"), _times(gains, self.limits, "acceleration")]
        least: FloatArray = np.max(times, axis=(0, 2))
        if not least.any():  # nothing limits them: at the velocities that are given
            speeds = np.nan_to_num(np.abs(self.velocities)).max()
            least = np.abs(travels).max(axis=1) / speeds
        return np.where(least > 0.0, least, 0.2 * least.max())

    def _first_trial(self, least: FloatArray, free: np.ndarray) -> FloatArray:
        """Return durations (segments,), s, whole steps above the least ones, without the impossible ones.

        Let T be the time of a part, and v the higher speed of a joint at its ends. The speed of the joint is at most
        v + a min(t, T - t), so its travel is at most v T + a T^2 / 4. So T is at least 2 d / (v + sqrt(v^2 + a d)).

        Args:
            least: Durations (segments,), s, none of which is to be shorter.
            free: Whether (segments,) a duration may change.
        """
        parts, firsts = self.parts, self._firsts
        travels = np.add.reduceat(np.abs(np.diff(self.positions, axis=0)), firsts)
        accelerations = np.maximum.reduceat(np.maximum(*np.abs(self.limits.acceleration)), firsts)
        speeds = np.abs(self._at_waypoints()[np.append(firsts, -1)])
        fastest, moves = np.maximum(speeds[:-1], speeds[1:]), travels > 0.0
        gained = np.sqrt(np.multiply(accelerations, travels, out=np.zeros_like(travels), where=moves))
        average = (fastest + np.hypot(fastest, gained)) / 2.0
        needed = np.divide(travels, average, out=np.zeros_like(travels), where=moves).max(axis=1)
        kept, own = (np.bincount(parts, weights=np.where(mask, least, 0.0)) for mask in (~free, free))
        factors = np.divide(needed - kept, own, out=np.ones_like(own), where=own > 0.0)
        steps = np.floor(np.log(np.maximum(factors, 1.0)) / np.log(DURATION_TRIAL_FACTOR))
        return np.where(free, least * DURATION_TRIAL_FACTOR ** steps[parts], least)

    def _longest_durations(self) -> FloatArray:
        """Return durations (segments,), s, at which rates are as low as durations can make them."""
        travels, speeds = np.abs(np.diff(self.positions, axis=0)), np.nan_to_num(np.abs(self._at_waypoints()))
        swings = speeds[:-1] + speeds[1:]
        velocity, acceleration, jerk = (self.limits.magnitudes(quantity) for quantity in JOINT_DERIVATIVES[1:])
        needed = travels / velocity + 2.0 * np.sqrt(travels / acceleration)
        needed += 6.0 * swings / acceleration
        if self.degree == 5:
            needed += 3.0 * np.cbrt(travels / jerk) + np.sqrt(60.0 * swings / jerk)
        longest: FloatArray = LARGEST_REACH * needed.max(axis=1)
        return longest

    def _at_waypoints(self) -> FloatArray:
        """Return the velocities (segments + 1, joints) at all waypoints; NaN: not given."""
        return np.pad(self.velocities, ((1, 1), (0, 0)))

    def _slowed(self, least: FloatArray, free: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """Return durations whose free ones are least factors times those given, so that each part keeps its limits.

        Args:
            least: Durations (segments,), s, none of which is to be shorter.
            free: Whether (segments,) a duration may change.

        Returns:
            Such durations, or the nearest ones. Then shorter durations, if trials come near to the limits and move away
            again; otherwise the same.
        """
        parts = self.parts
        can_change = np.bincount(parts, weights=free) > 0.0

        def durations(steps: FloatArray) -> FloatArray:
            return np.where(free, least * DURATION_TRIAL_FACTOR ** steps[parts], least)

        ratio = float((self._longest_durations() / least)[free].max(initial=1.0))
        seen: list[FloatArray] = []
        for step in range(int(np.ceil(np.log(max(ratio, 1.0)) / np.log(DURATION_TRIAL_FACTOR))) + 2):
            seen.append(self.excesses(durations(np.full(len(can_change), float(step)))))
            if ((np.min(seen, axis=0) <= 0.0) | ~can_change).all():
                break
        trials = np.array(seen)
        within = trials <= 0.0
        found = within.any(axis=0) & can_change
        high = np.where(found, within.argmax(axis=0), trials.argmin(axis=0)).astype(np.float64)
        around = np.pad(trials, ((1, 1), (0, 0)), constant_values=((np.inf, -np.inf), (0.0, 0.0)))
        dips = (trials <= around[:-2]) & (trials <= around[2:]) & (trials < PROMISING)
        dips &= ~within.cumsum(axis=0, dtype=bool)
        dip = np.where(dips.any(axis=0), np.where(dips, trials, np.inf).argmin(axis=0), np.nan)
        low = np.where(found, np.maximum(high - 1.0, 0.0), high)
        for _ in range(TIME_BISECTIONS if (low < high).any() else 0):
            middle = (low + high) / 2.0
            kept = self.excesses(durations(middle)) <= 0.0
            low, high = np.where(kept, low, middle), np.where(kept, middle, high)
        return durations(high), durations(np.where(np.isnan(dip), high, dip))

    def _refusal(
        self, durations: FloatArray, requested: np.ndarray, part: int
    ) -> DurationsTooShort | VelocityOutOfReach:
        """Return the refusal where these durations (segments,), some of them requested, break a limit on a part."""
        own, motion = self.parts == part, self.held(durations)
        peaks = np.flatnonzero(own[motion.segment])
        worst = int(peaks[np.argmax(motion.excess[peaks])])
        segment, joint, order = int(motion.segment[worst]), int(motion.joint[worst]), int(motion.order[worst])
        quantity, value, limit = JOINT_DERIVATIVES[order], float(motion.value[worst]), motion.limit_at(worst)
        if (own & requested).any():
            longer, _ = self._slowed(durations, own)
            if self.excesses(longer)[part] <= 0.0:
                factor = float(longer[segment] / durations[segment])
                return DurationsTooShort(segment, joint, quantity, abs(value), abs(limit), factor, longer)
        return VelocityOutOfReach(segment, joint, quantity, value, limit)


def _times(changes: FloatArray, limits: SegmentLimits, quantity: str) -> FloatArray:
    """Return the times (segments, joints), s, that changes (segments, joints) take at the limits of their rate."""
    lower, upper = limits.bounds(quantity)
    times: FloatArray = changes / np.where(changes < 0.0, lower, upper)
    return times
