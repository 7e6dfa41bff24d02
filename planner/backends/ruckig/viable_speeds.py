"""The speeds with which a joint may pass a position, so that it stays within its position limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

NO_LIMIT = 1e6
"""Number that stands for an infinite limit, in units in which everything is about 1, so that 0 times it is 0."""


class ViableSpeeds:
    """Speeds from which a joint can stop before its position limits, and to which it can have come from rest.

    Args:
        above: Room (waypoints, joints) below the upper position limits.
        below: Room (waypoints, joints) above the lower position limits.
        upward: Upper velocity limits (waypoints, joints), valid before and after each waypoint.
        downward: Magnitudes of the lower velocity limits (waypoints, joints), valid there.
        acceleration: Acceleration limits (waypoints, joints), valid there.
        jerk: Jerk limits (waypoints, joints), valid there.
    """

    def __init__(
        self,
        above: FloatArray,
        below: FloatArray,
        upward: FloatArray,
        downward: FloatArray,
        acceleration: FloatArray,
        jerk: FloatArray,
    ) -> None:
        self._rooms = np.minimum([above, below], NO_LIMIT)
        self._upward, self._downward, self._jerk = upward, downward, jerk
        self._acceleration = np.minimum(acceleration, NO_LIMIT)
        self._finite_jerk = np.minimum(jerk, NO_LIMIT**2)
        # Below this speed the acceleration limit is not reached.
        self._eased = self._acceleration**2 / self._finite_jerk
        self._at_rest = self._stopping(self._rooms)

    def highest(self, acceleration: FloatArray, velocity: FloatArray) -> FloatArray:
        """Compute the highest speed (..., waypoints, joints) with an acceleration, in the direction of a velocity.

        It must keep its limit just before and just after. Let t = |acceleration| / j. The joint reaches the speed
        v + j t^2 / 2 when the acceleration ends, after the time t and the distance v t + j t^3 / 3. If the acceleration
        opposes the motion, the joint had that speed earlier, when the acceleration began.

        Args:
            acceleration: Accelerations (..., waypoints, joints).
            velocity: Velocities (..., waypoints, joints), of which the sign matters only.
        """
        up = velocity > 0.0
        onward = np.where(up, acceleration, -acceleration)
        t = onward / self._jerk
        change = np.abs(onward * t) / 2.0
        speed = np.where(up, self._upward, self._downward)
        for side, sign in ((0, 1.0), (1, -1.0)):
            room, own = (np.where(up, x[side], x[1 - side]) for x in (self._rooms, self._at_rest))
            # One step to the fixed point that the speed is, from without acceleration: it ends on the safe side.
            speed = np.minimum(speed, self._stopping(room - sign * t * (own + change / 1.5)))
        return np.maximum(speed - change, 0.0)

    def _stopping(self, room: FloatArray) -> FloatArray:
        """Return the highest speed (..., joints) without acceleration from which a joint stops within its room."""
        room = np.maximum(room, 0.0)
        eased = np.cbrt(room**2 * self._finite_jerk)
        half = self._eased / 2.0
        speed: FloatArray = np.where(
            eased <= self._eased, eased, np.sqrt(half**2 + 2.0 * self._acceleration * room) - half
        )
        return speed
