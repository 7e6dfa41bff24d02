"""Limits of velocity, acceleration and jerk, and what takes the place of those that are not there."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray


class RateLimits(NamedTuple):
    """Limits of each row and joint, each (rows, joints); infinite: none.

    Without a jerk limit the acceleration jumps, and those asked at the ends of a motion are not heeded.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def slowed(self, factors: FloatArray) -> RateLimits:
        """Return the limits to which the same motions in `factors` (rows,) times the time are as near as to these."""
        k = factors[:, None]
        return RateLimits(self.velocity / k, self.acceleration / k**2, self.jerk / k**3)

    def of(self, rows: np.ndarray) -> RateLimits:
        """Return the limits of some rows."""
        return RateLimits(self.velocity[rows], self.acceleration[rows], self.jerk[rows])


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
