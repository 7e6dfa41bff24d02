"""The estimated duration of a path through joint positions, as a sum of largest values that are nearly linear."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kinematics.turns import counted_velocity
from planner.paths import JointPath
from planner.spatial import FloatArray

SHORTEST_LEG = 1e-6
"""The time, s, that a leg counts at least: legs without length have no direction."""


UNLIMITED = 1e9
"""The acceleration, rad/s^2 or m/s^2, that counts for a joint without an acceleration limit."""

UNLIMITED_JERK = 1e15
"""The jerk, rad/s^3 or m/s^3, that counts for a joint without a jerk limit."""


class Parts(NamedTuple):
    """The times of a path, joint by joint and with signs.

    Attributes:
        values: (..., parts, joints), s: times of legs, then half the times of corners at full acceleration.
        weights: (..., parts): the estimate is the sum of these times the largest magnitude in each row.
    """

    values: FloatArray
    weights: FloatArray

    @property
    def total(self) -> FloatArray:
        """The estimated durations (...), s."""
        found: FloatArray = (self.weights * np.abs(self.values).max(axis=-1)).sum(axis=-1)
        return found


class LegTimes:
    """Estimates of `planner.free_motion.objectives.Estimate` from stop to stop, with the limits of each segment.

    A change u of a velocity takes |u| / a + a / j with a jerk limit j. It takes 2 sqrt(|u| / j) if it does not reach
    the acceleration limit a.
    """

    def __init__(self, path: JointPath, *, keeps_jerk: bool) -> None:
        """Prepare for paths with the limits and the stops of a path; segments without length stay."""
        self.moving = path.moving
        limits = path.limits
        self._velocity = counted_velocity(limits.velocity.narrower[self.moving])
        acceleration = np.minimum(limits.acceleration.narrower[self.moving], UNLIMITED)
        jerk = limits.jerk.narrower[self.moving] if keeps_jerk else np.full_like(acceleration, np.inf)
        legs = len(self.moving)
        group_of = {segment: k for k, group in enumerate(path.every_group) for segment in group.segments.tolist()}
        groups = np.array([group_of[segment] for segment in self.moving.tolist()], dtype=int)
        changes: list[tuple[int, int]] = []
        for k in range(legs + 1):
            before, after = k - 1, k if k < legs else -1
            if before >= 0 and after >= 0 and groups[before] == groups[after]:
                changes.append((before, after))
            else:
                changes += [(one, -1) for one in (before, after) if one >= 0]
        self._corners = np.zeros((len(changes), legs))
        for row, (one, other) in enumerate(changes):
            self._corners[row, one] = 1.0
            if other >= 0:
                self._corners[row, other] = -1.0
        both = [[k for k in pair if k >= 0] for pair in changes]
        self._acceleration = np.array([acceleration[pair].min(axis=0) for pair in both])
        self._jerk = np.array([np.minimum(jerk, UNLIMITED_JERK)[pair].min(axis=0) for pair in both])
        of_corners = groups[[one for one, _ in changes]]
        every = np.arange(len(path.every_group))
        self._legs_of, self._corners_of = (every[:, None] == groups, every[:, None] == of_corners)

    def __call__(self, positions: FloatArray) -> Parts:
        """Estimate paths (..., waypoints, joints), rad or m."""
        steps = positions[..., self.moving + 1, :] - positions[..., self.moving, :]
        legs = steps / self._velocity
        times = np.maximum(np.abs(legs).max(axis=-1), SHORTEST_LEG)
        changes = self._corners @ (steps / times[..., None])
        sizes, ramp = np.abs(changes), self._acceleration / self._jerk
        is_short = sizes < ramp * self._acceleration
        lasting = np.where(is_short, 2.0 * np.sqrt(sizes / self._jerk), sizes / self._acceleration + ramp)
        corners = 0.5 * np.sign(changes) * lasting
        turns = np.abs(corners).max(axis=-1)
        going, turning = times @ self._legs_of.T, turns @ self._corners_of.T
        slower = np.sqrt(np.maximum(1.0, turning / np.maximum(going, SHORTEST_LEG)))
        weights = np.concatenate([slower @ self._legs_of, (1.0 / slower) @ self._corners_of], axis=-1)
        return Parts(np.concatenate([legs, corners], axis=-2), weights)
