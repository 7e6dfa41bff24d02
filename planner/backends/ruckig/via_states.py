"""The velocities and accelerations with which waypoints are passed, so that the whole takes the least time.

Between two waypoints each joint moves from state to state as fast as it can, and waits for the slowest: a segment
takes the longest of its joints' shortest times. States near to the best come from the program of `via_program`, whose
pieces of constant jerk have fixed ends; the exact times then move each joint's state at each waypoint a little.

Two things these times do not show: a joint may be unable to arrive later than its shortest time but for a range of
durations (then all wait longer), and it may leave its position limits on the way. Such a joint keeps the program's
states, which are away from both; what is left is mended by slowing single joints at single waypoints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.ruckig.state_to_state import Rates, ShortestTimes
from planner.backends.ruckig.via_passages import BetweenWaypoints, MendedPassages
from planner.backends.ruckig.via_problem import LATE, ViaMotion, ViaProblem
from planner.backends.ruckig.via_program import passing_states
from planner.backends.ruckig.viable_speeds import ViableSpeeds
from planner.tolerances import LIMIT_TOLERANCE

if TYPE_CHECKING:
    from planner.spatial import FloatArray

EXPONENT = 200.0
"""Exponent of the norm that stands for the longest time: joints that hardly wait are not to hold up the others."""

AROUND = np.array([[0.0, 0.0], *([np.cos(angle), np.sin(angle)] for angle in 0.1 + np.arange(6) * np.pi / 3.0)])
"""Changes of the two variables of a joint at a waypoint that are tried, in radii: first none, then six around."""

WIDEST = 0.15
"""Size of the first changes, in units of the variables, which are shares of what is possible."""

MOST_SWEEPS = 3
"""Number of times that all waypoints are moved."""

LEAST_GAIN = 1e-6
"""Relative gain of time that is worth a move."""

INSIDE = 1.0 - 1e-4
"""Share of the possible velocities and accelerations that a waypoint is passed with."""


def pass_waypoints(problem: ViaProblem, *, stopping: bool) -> ViaMotion | None:
    """Find a fast motion; asked durations and position limits are kept as far as can be, which the caller has to check.

    Args:
        problem: The problem in SI units.
        stopping: Whether to come to rest at each inner waypoint.

    Returns:
        None: The motions at the ends are impossible.
    """
    cleaned = problem.without_rounding()
    length, time = cleaned.units()
    scaled = cleaned.in_units(length, time)
    search = _Search(scaled)
    if stopping or len(problem.asked) == 1:
        return search.passages(search.at_rest).motion(problem, length, time)
    found = search.nearest(passing_states(scaled))
    passages = search.polished(found)
    passages.mend()
    return passages.motion(problem, length, time)


class _Search:
    """The search over velocities and accelerations at the inner waypoints, in units in which everything is about 1.

    The variables are shares of the velocities and accelerations that are possible.
    """

    def __init__(self, problem: ViaProblem) -> None:
        self.problem, self._between = problem, BetweenWaypoints(problem)
        travels, limits = problem.travels, problem.limits
        count, joints = travels.shape
        self.asked = problem.asked
        velocity, acceleration, jerk = (np.minimum(limit[1:], limit[:-1]) for limit in problem.narrower)
        (downward, upward), (braking, gaining) = (
            [np.minimum(limit[1:], limit[:-1]) for limit in np.abs(bounds)]
            for bounds in (limits.velocity, limits.acceleration)
        )
        # No faster than a joint can be that travels all the way in one direction, so that the variables matter.
        way = np.maximum(np.abs(travels).sum(axis=0), 1.0)
        most = np.minimum(np.cbrt(4.0 * jerk * way**2), 2.0 * np.sqrt(np.maximum(gaining, braking) * way))
        velocity, upward, downward = (np.minimum(limit, most) * INSIDE for limit in (velocity, upward, downward))
        # It must not lead beyond the velocity limit of either direction.
        eased = np.sqrt(2.0 * jerk * velocity)
        self._gaining, self._braking = (
            np.where(np.isfinite(jerk), np.minimum(limit, eased) * INSIDE, 0.0) for limit in (gaining, braking)
        )
        inner = problem.positions[1:-1]
        above, below = limits.position.upper - inner, inner - limits.position.lower
        self._viable = ViableSpeeds(above, below, upward, downward, acceleration, jerk)
        self._shape = (2, count - 1, joints)

    @property
    def at_rest(self) -> Rates:
        """The rates (waypoints, joints) with all inner waypoints at rest."""
        return self.rates(np.zeros(self._shape))

    def rates(self, x: FloatArray) -> Rates:
        """Return the rates (waypoints, joints) that belong to variables (2, inner waypoints, joints)."""
        inner, start, end = self._inner_rates(x), self.problem.start, self.problem.end
        return Rates(
            np.vstack([start.velocity, inner.velocity, end.velocity]),
            np.vstack([start.acceleration, inner.acceleration, end.acceleration]),
        )

    def _inner_rates(self, x: FloatArray) -> Rates:
        """Give the rates (..., inner waypoints, joints) that belong to variables (..., 2, inner waypoints, joints)."""
        share = np.clip(x, -1.0, 1.0)
        gain = share[..., 1, :, :]
        acceleration = gain * np.where(gain < 0.0, self._braking, self._gaining)
        velocity = share[..., 0, :, :]
        return Rates(velocity * self._viable.highest(acceleration, velocity), acceleration)

    def passages(self, rates: Rates) -> MendedPassages:
        """Return the motions with these rates (waypoints, joints)."""
        return MendedPassages(self._between, rates)

    def nearest(self, rates: Rates) -> Rates:
        """Return the nearest rates that are possible."""
        return self.rates(self._variables(rates))

    def polished(self, rates: Rates) -> MendedPassages:
        """Move each joint's state at each waypoint to the best of those around it, as long as that helps.

        The shortest times have cliffs, where a joint can just not reach a speed in its segment, and no slope leads
        along them. Every other waypoint is moved at once, as its segments depend on no other that moves. A joint whose
        motions are at fault then returns to where it was, and stays there.
        """
        count = self._shape[1]
        groups = [group for first in (0, 1) if len(group := np.arange(first, count, 2))]
        batches = [self._batch(np.tile(np.concatenate([group, group + 1]), len(AROUND))) for group in groups]
        x, radius = self._variables(rates), np.full(self._shape[1:], WIDEST)
        for _ in range(MOST_SWEEPS):
            moved = x
            for group, batch in zip(groups, batches, strict=True):
                moved = self._moved(moved, group, batch, radius)
            passages = self.passages(self.rates(moved))
            if (faulty := passages.faulty_joints).any():
                moved[..., faulty], radius[:, faulty] = x[..., faulty], 0.0
                passages = self.passages(self.rates(moved))
            x = moved
        return passages

    def _variables(self, rates: Rates) -> FloatArray:
        """Return the variables (2, inner waypoints, joints) of rates, or of the nearest rates that are possible."""
        velocity, acceleration = (rate[1:-1] for rate in rates)
        with np.errstate(divide="ignore", invalid="ignore"):
            most = np.where(acceleration < 0.0, self._braking, self._gaining)
            share = np.clip(np.nan_to_num(acceleration / most), -1.0, 1.0)
            shares = np.stack([velocity / self._viable.highest(share * most, velocity), share])
        limited: FloatArray = np.clip(np.nan_to_num(shares), -1.0, 1.0)
        return limited

    def _moved(self, x: FloatArray, group: np.ndarray, batch: ShortestTimes, radius: FloatArray) -> FloatArray:
        """Move these waypoints, and adapt the radius (inner waypoints, joints) for the next time."""
        rates, trials = self.rates(x), x + AROUND[:, :, None, None] * radius
        starts, ends = [], []
        for own, trial in zip(rates, self._inner_rates(trials), strict=True):
            before, after = (np.broadcast_to(own[at], trial[:, group].shape) for at in (group, group + 2))
            starts.append(np.concatenate([before, trial[:, group]], axis=1))
            ends.append(np.concatenate([trial[:, group], after], axis=1))
        times = batch.between(Rates(*starts), Rates(*ends))
        if not np.isfinite(times).all():
            return x
        times = times.reshape(len(AROUND), 2, len(group), -1)
        costs = self._costs(times[:, 0], group) + self._costs(times[:, 1], group + 1)
        best = np.where(costs.min(axis=0) < costs[0] * (1.0 - LEAST_GAIN), costs.argmin(axis=0), 0)
        x = x.copy()
        for k in (0, 1):
            x[k, group] += AROUND[best, k] * radius[group]
        radius[group] = np.where(best > 0, np.minimum(radius[group] * 1.5, WIDEST), radius[group] * 0.5)
        return x

    def _batch(self, rows: np.ndarray) -> ShortestTimes:
        """Return the shortest times of some of the segments."""
        return ShortestTimes(self.problem.travels[rows], self.problem.limits.of(rows))

    def _costs(self, times: FloatArray, segments: np.ndarray) -> FloatArray:
        """Give the costs (trials, segments, joints) of segments where one joint takes another time; first, as it is."""
        own = times[:1]
        longest = np.maximum(own.max(axis=2, keepdims=True), LIMIT_TOLERANCE)
        with np.errstate(over="ignore"):
            powers, others = (times / longest) ** EXPONENT, (own / longest) ** EXPONENT
        totals = longest * (others.sum(axis=2, keepdims=True) - others + powers) ** (1.0 / EXPONENT)
        asked = self.asked[segments][:, None]
        costs: FloatArray = np.where(np.isnan(asked), totals, LATE * np.maximum(totals - asked, 0.0))
        return costs
