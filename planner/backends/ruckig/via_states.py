"""Velocities and accelerations at passed waypoints that minimise the total duration.

Between two waypoints each joint moves from state to state as fast as it can, and waits for the slowest. The states come
from the program of `via_program`, whose pieces of constant jerk have fixed ends. The exact motions can have two faults.
A joint may be unable to arrive at some times after its shortest one; then all joints wait longer. And a joint may leave
its position limits. Slower single joints at single waypoints remove both faults.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.ruckig.state_to_state import Rates
from planner.backends.ruckig.via_passages import BetweenWaypoints, MendedPassages
from planner.backends.ruckig.via_program import passing_states
from planner.backends.ruckig.viable_speeds import ViableSpeeds

if TYPE_CHECKING:
    from planner.backends.ruckig.via_problem import ViaMotion, ViaProblem
    from planner.spatial import FloatArray

USED_SHARE = 1.0 - 1e-4
"""Share of the possible velocities and accelerations that a waypoint is passed with."""


def pass_waypoints(problem: ViaProblem, *, stopping: bool) -> ViaMotion | None:
    """Find a fast motion that may miss requested durations and position limits; the caller checks both.

    Args:
        problem: The problem in SI units.
        stopping: Whether to come to rest at each inner waypoint.

    Returns:
        None: The motions at the ends are impossible.
    """
    cleaned = problem.without_rounding()
    length, time = cleaned.units()
    scaled = cleaned.in_units(length, time)
    possible, between = _PossibleRates(scaled), BetweenWaypoints(scaled)
    if stopping or len(problem.requested) == 1:
        return MendedPassages(between, possible.at_rest).motion(problem, length, time)
    passages = MendedPassages(between, possible.nearest(passing_states(scaled)))
    passages.mend()
    return passages.motion(problem, length, time)


class _PossibleRates:
    """The possible velocities and accelerations at the inner waypoints, in units in which everything is about 1."""

    def __init__(self, problem: ViaProblem) -> None:
        self.problem = problem
        travels, limits = problem.travels, problem.limits
        velocity, acceleration, jerk = (np.minimum(limit[1:], limit[:-1]) for limit in problem.narrower)
        (downward, upward), (braking, gaining) = (
            [np.minimum(limit[1:], limit[:-1]) for limit in np.abs(bounds)]
            for bounds in (limits.velocity, limits.acceleration)
        )
        # No faster than a joint can be that travels all the way in one direction, which bounds infinite limits.
        way = np.maximum(np.abs(travels).sum(axis=0), 1.0)
        most = np.minimum(np.cbrt(4.0 * jerk * way**2), 2.0 * np.sqrt(np.maximum(gaining, braking) * way))
        velocity, upward, downward = (np.minimum(limit, most) * USED_SHARE for limit in (velocity, upward, downward))
        # It must not lead beyond the velocity limit of either direction.
        eased = np.sqrt(2.0 * jerk * velocity)
        self._gaining, self._braking = (
            np.where(np.isfinite(jerk), np.minimum(limit, eased) * USED_SHARE, 0.0) for limit in (gaining, braking)
        )
        inner = problem.positions[1:-1]
        above, below = limits.position.upper - inner, inner - limits.position.lower
        self._viable = ViableSpeeds(above, below, upward, downward, acceleration, jerk)

    @property
    def at_rest(self) -> Rates:
        """The rates (waypoints, joints) with all inner waypoints at rest."""
        inner = np.zeros((len(self.problem.positions) - 2, self.problem.positions.shape[1]))
        return self._with_ends(inner, inner)

    def nearest(self, rates: Rates) -> Rates:
        """Return the nearest possible rates (waypoints, joints) to some."""
        velocity, acceleration = (rate[1:-1] for rate in rates)
        acceleration = np.clip(acceleration, -self._braking, self._gaining)
        highest = self._viable.highest(acceleration, velocity)
        return self._with_ends(np.clip(velocity, -highest, highest), acceleration)

    def _with_ends(self, velocity: FloatArray, acceleration: FloatArray) -> Rates:
        """Return the rates (waypoints, joints), given the rates at inner waypoints."""
        start, end = self.problem.start, self.problem.end
        return Rates(
            np.vstack([start.velocity, velocity, end.velocity]),
            np.vstack([start.acceleration, acceleration, end.acceleration]),
        )
