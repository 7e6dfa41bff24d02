"""Limits of velocity, acceleration and jerk, and what takes the place of those that are not there."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.limits import SegmentLimits
    from planner.spatial import FloatArray


class RateLimits(NamedTuple):
    """Limits of each row and joint, each (rows, joints); infinite: none.

    Without a jerk limit the acceleration jumps, and those asked at the ends of a motion are not heeded.

    Attributes:
        velocity: The narrower of both directions.
        acceleration: The narrower of both directions.
        jerk: The same in both directions.
        wider: Factors (rows, 2, joints), 1 or more, by which the lower and the upper limits of a quantity are wider;
            quantities whose limits are the same in both directions are left out.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    wider: Mapping[str, FloatArray] = MappingProxyType({})

    @classmethod
    def of_segments(cls, limits: SegmentLimits) -> RateLimits:
        """Return the limits in force on some segments, each of them a row."""
        wider = {quantity: factors for quantity, factors in limits.wider.items() if quantity in cls._fields}
        return cls(limits.velocity, limits.acceleration, limits.jerk, wider)

    def by_direction(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return the magnitudes of the lower and of the upper limits of a quantity, each (rows, joints)."""
        narrower: FloatArray = getattr(self, quantity)
        if quantity not in self.wider:
            return narrower, narrower
        lower, upper = np.moveaxis(self.wider[quantity], 1, 0)
        return narrower * lower, narrower * upper

    def slowed(self, factors: FloatArray) -> RateLimits:
        """Return the limits to which the same motions in `factors` (rows,) times the time are as near as to these."""
        k = factors[:, None]
        return RateLimits(self.velocity / k, self.acceleration / k**2, self.jerk / k**3, self.wider)

    def no_faster(self, speeds: FloatArray) -> RateLimits:
        """Return the limits with none of the velocities above `speeds` (rows, joints)."""
        if "velocity" not in self.wider:
            return self._replace(velocity=np.minimum(self.velocity, speeds))
        both = np.minimum(np.stack(self.by_direction("velocity"), axis=1), speeds[:, None])
        narrower = both.min(axis=1)
        return self._replace(velocity=narrower, wider={**self.wider, "velocity": both / narrower[:, None]})

    def of(self, rows: np.ndarray) -> RateLimits:
        """Return the limits of some rows."""
        wider = {quantity: factors[rows] for quantity, factors in self.wider.items()}
        return RateLimits(self.velocity[rows], self.acceleration[rows], self.jerk[rows], wider)


def with_ramps(travels: FloatArray, limits: RateLimits, asked: FloatArray) -> RateLimits:
    """Add jerk limits where neither acceleration nor jerk is limited: the fastest motion would be a jump there.

    A joint with only a velocity limit reaches it in the middle of its travel, one without any limit takes as long as
    the others, or as is asked: T = 2 d / v and j = 32 d / T^3, four equal phases of jerk.

    Args:
        travels: Travels (rows, joints), rad or m, of any sign.
        limits: The limits of each row and joint.
        asked: Asked durations (rows,), s; NaN: as short as can be.
    """
    d = np.abs(travels)
    bare = np.isinf(limits.acceleration) & np.isinf(limits.jerk)
    if not bare.any():
        return limits
    times = np.where(bare, 2.0 * d / limits.velocity, least_times(travels, limits))
    longest = np.fmax(times.max(axis=1, keepdims=True), asked[:, None])
    times = np.where(times > 0.0, times, longest)
    d = np.where(d > 0.0, d, d.max(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = np.where((times > 0.0) & (d > 0.0), 32.0 * d / times**3, np.inf)
    return limits._replace(jerk=np.where(bare, ramps, limits.jerk))


def least_times(travels: FloatArray, limits: RateLimits) -> FloatArray:
    """Return times (rows, joints), s, that the tightest limit alone takes from rest to rest: most of the shortest time.

    Args:
        travels: Travels (rows, joints), rad or m, of any sign.
        limits: The limits of each row and joint.
    """
    d = np.abs(travels)
    bounds = (d / limits.velocity, 2.0 * np.sqrt(d / limits.acceleration), np.cbrt(32.0 * d / limits.jerk))
    longest: FloatArray = np.maximum.reduce(bounds)
    return longest
