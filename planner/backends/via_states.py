"""With which velocities and accelerations to pass waypoints, so that the whole takes the least time.

Between two waypoints each joint moves from state to state as fast as it can, and waits for the slowest: a segment
takes the longest of its joints' shortest times. Their sum is made small by L-BFGS (Nocedal and Wright, Numerical
Optimization, 2006, ch. 7.2), with norms in the place of the maxima that come nearer to them step by step. The
joints' times depend on their own states only, so all slopes come from one batch of single-joint motions.

Two things that these times do not show are mended afterwards, by slowing single joints at single waypoints: a joint may
be unable to arrive later than its shortest time but for a range of durations (then all wait longer), and it may leave
its position limits on the way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.lbfgs import lbfgs
from planner.backends.state_to_state import Rates, ShortestTimes, least_times
from planner.backends.via_passages import MendedPassages
from planner.backends.via_problem import LATE, ROUNDING, ViaMotion, ViaProblem

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray

EXPONENTS, MOST_STEPS = (10.0, 40.0, 200.0), (12, 12, 15)
"""Of the norms that stand for the maxima, one after the other; and the most steps of the search with each."""

AROUND = np.array([[0.0, 0.0], *([np.cos(angle), np.sin(angle)] for angle in np.arange(0.1, 6.28, np.pi / 5.0))])
"""Changes of the two variables of a joint at a waypoint that are tried; none first."""

WIDEST, NARROWEST, MOST_SWEEPS = 0.3, 1e-3, 8
"""Their size, and how often all waypoints are moved."""

RELAXED = (0.98, 0.8)
"""Joints that need less than this share of the time are also tried with their mean speeds, at which they can wait."""

DIFFERENCE = 1e-5
"""Change of a variable by which slopes are measured."""

INSIDE = 1.0 - 1e-4
"""Share of the possible velocities and accelerations that a waypoint is passed with."""


def pass_waypoints(problem: ViaProblem, *, stopping: bool) -> ViaMotion | None:
    """The fastest motion found; asked durations and position limits are kept as far as can be: to be looked at.

    Args:
        problem: In SI units.
        stopping: Whether to come to rest at each inner waypoint.

    Returns:
        None: The motions at the ends are impossible.
    """
    reach = np.abs(problem.travels).max(axis=0)
    length = np.where(reach > 0.0, reach, 1.0)
    times = np.fmax(least_times(problem.travels, problem.limits).max(axis=1), problem.asked)
    time = float(times.mean())
    scaled = problem.in_units(length, time)
    search = _Search(scaled)
    if stopping or len(times) == 1:
        choices = [search.at_rest]
    else:
        fastest = search.fastest()
        choices = [fastest, *(search.relaxed(fastest, share) for share in RELAXED)]
    tried = [MendedPassages(scaled, rates, search.shortest(rates)) for rates in choices]
    for passages in tried if not stopping else []:
        passages.mend()
    passages = min(tried, key=lambda passages: passages.cost)
    return passages.motion(problem, length, time)


class _Search:
    """Over velocities and accelerations at the inner waypoints; in units in which everything is about 1.

    The sines of the variables are shares of the velocities and accelerations that are possible.
    """

    def __init__(self, problem: ViaProblem) -> None:
        self.problem = problem
        travels, limits = problem.travels, problem.limits
        count, joints = travels.shape
        self.asked = problem.asked
        velocity, acceleration, jerk = (np.minimum(limit[1:], limit[:-1]) for limit in limits)
        # Never faster than a joint can be that travels all the way in one direction: the variables are to matter.
        way = np.maximum(np.abs(travels).sum(axis=0), 1.0)
        velocity = np.minimum(velocity, np.minimum(np.cbrt(4.0 * jerk * way**2), 2.0 * np.sqrt(acceleration * way)))
        velocity = velocity * INSIDE
        self.acceleration = np.minimum(acceleration, np.sqrt(2.0 * jerk * velocity)) * INSIDE
        self.acceleration = np.where(np.isfinite(jerk), self.acceleration, 0.0)
        self.velocity, self.jerk = velocity, jerk
        inner = problem.positions[1:-1]
        self.up = _stopping_speed(problem.upper - inner, acceleration, jerk)
        self.down = _stopping_speed(inner - problem.lower, acceleration, jerk)
        segments, first, last = np.arange(count), np.arange(1, count), np.arange(count - 1)
        self._own = ShortestTimes(travels, limits)
        # Each segment as it is, with a change of either rate at its start, and at its end.
        rows = np.concatenate([segments, first, first, last, last])
        self._changed = ShortestTimes(travels[rows], limits.of(rows))
        self._shape = (2, count - 1, joints)

    @property
    def at_rest(self) -> Rates:
        """(waypoints, joints): all inner waypoints at rest."""
        return self.rates(np.zeros(self._shape))

    def rates(self, x: FloatArray) -> Rates:
        """(waypoints, joints), of the variables (2, inner waypoints, joints)."""
        inner, start, end = self._inner_rates(x), self.problem.start, self.problem.end
        return Rates(
            np.vstack([start.velocity, inner.velocity, end.velocity]),
            np.vstack([start.acceleration, inner.acceleration, end.acceleration]),
        )

    def _inner_rates(self, x: FloatArray) -> Rates:
        """(..., inner waypoints, joints), of the variables (..., 2, inner waypoints, joints)."""
        share = np.sin(x)
        acceleration = share[..., 1, :, :] * self.acceleration
        share = share[..., 0, :, :]
        # The velocity must not have been beyond its limit just before, nor be so just after.
        highest = self.velocity - acceleration**2 / (2.0 * self.jerk)
        return Rates(share * np.minimum(highest, np.where(share > 0.0, self.up, self.down)), acceleration)

    def shortest(self, rates: Rates) -> FloatArray:
        """(segments, joints), s."""
        return self._own.between(Rates(*(r[:-1] for r in rates)), Rates(*(r[1:] for r in rates)))

    def fastest(self) -> Rates:
        """Where the search ends, the maxima at last being nearly themselves."""
        x = self._first_guess()
        for exponent, steps in zip(EXPONENTS, MOST_STEPS, strict=True):
            x = lbfgs(lambda x, p=exponent: self._cost(x, p), x, steps)  # type: ignore[misc]
        return self.rates(self._polished(x))

    def _polished(self, x: FloatArray) -> FloatArray:
        """Each joint's state at each waypoint moved to the best of those around it, as long as that helps.

        The shortest times have cliffs, where a joint can just not reach a speed in its segment, and no slope leads
        along them. Every other waypoint is moved at once, as its segments depend on no other that moves.
        """
        count = self._shape[1]
        radius = np.full(self._shape[1:], WIDEST)
        groups = [group for first in (0, 1) if len(group := np.arange(first, count, 2))]
        batches = [self._batch(np.tile(np.concatenate([group, group + 1]), len(AROUND))) for group in groups]
        for _ in range(MOST_SWEEPS):
            for group, batch in zip(groups, batches, strict=True):
                rates = self.rates(x)
                trials = x + AROUND[:, :, None, None] * radius
                inner = self._inner_rates(trials)
                starts, ends = [], []
                for own, trial in zip(rates, inner, strict=True):
                    before, after = (np.broadcast_to(own[at], trial[:, group].shape) for at in (group, group + 2))
                    starts.append(np.concatenate([before, trial[:, group]], axis=1))
                    ends.append(np.concatenate([trial[:, group], after], axis=1))
                times = batch.between(Rates(*starts), Rates(*ends))
                if not np.isfinite(times).all():
                    return x
                times = times.reshape(len(AROUND), 2, len(group), -1)
                costs = self._costs(times[:, 0], group) + self._costs(times[:, 1], group + 1)
                best = costs.argmin(axis=0)
                x = x.copy()
                for k in (0, 1):
                    x[k, group] += AROUND[best, k] * radius[group]
                radius[group] = np.where(best > 0, np.minimum(radius[group] * 1.5, WIDEST), radius[group] * 0.5)
            if radius.max() < NARROWEST:
                break
        return x

    def _batch(self, rows: np.ndarray) -> ShortestTimes:
        return ShortestTimes(self.problem.travels[rows], self.problem.limits.of(rows))

    def _costs(self, times: FloatArray, segments: np.ndarray) -> FloatArray:
        """(trials, segments, joints): of a segment where one joint takes another time (the first trial: as it is)."""
        own = times[:1]
        longest = np.maximum(own.max(axis=2, keepdims=True), ROUNDING)
        with np.errstate(over="ignore"):
            powers, others = (times / longest) ** EXPONENTS[-1], (own / longest) ** EXPONENTS[-1]
        totals = longest * (others.sum(axis=2, keepdims=True) - others + powers) ** (1.0 / EXPONENTS[-1])
        asked = self.asked[segments][:, None]
        costs: FloatArray = np.where(np.isnan(asked), totals, LATE * np.maximum(totals - asked, 0.0))
        return costs

    def relaxed(self, rates: Rates, share: float) -> Rates:
        """The same, but joints that have to wait on both sides of a waypoint pass it at their mean speed."""
        times = self.shortest(rates)
        longest = times.max(axis=1, keepdims=True)
        waits = (times[1:] < share * longest[1:]) & (times[:-1] < share * longest[:-1])
        speeds = self._mean_speeds(longest)
        velocity, acceleration = (rate.copy() for rate in rates)
        velocity[1:-1] = np.where(waits, np.clip(speeds, -self.velocity, self.velocity), velocity[1:-1])
        acceleration[1:-1] = np.where(waits, 0.0, acceleration[1:-1])
        return Rates(velocity, acceleration)

    def _mean_speeds(self, times: FloatArray) -> FloatArray:
        """(inner waypoints, joints): harmonic means of the speeds before and after; 0 where a joint turns back."""
        speeds = self.problem.travels / times
        before, after = speeds[:-1], speeds[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean: FloatArray = np.where(before * after > 0.0, 2.0 * before * after / (before + after), 0.0)
        return mean

    def _first_guess(self) -> FloatArray:
        """With the harmonic mean of the speeds before and after, where a joint goes on in the same direction."""
        times = np.where(np.isnan(self.asked), self.shortest(self.at_rest).max(axis=1) / 1.5, self.asked)
        mean = self._mean_speeds(times[:, None])
        share = np.clip(mean / self.velocity, -0.8, 0.8)
        x = np.zeros(self._shape)
        x[0] = np.arcsin(share)
        return x

    def _cost(self, x: FloatArray, exponent: float) -> tuple[float, FloatArray]:
        """The total of the segments' times and its slopes, with norms of the joints' times for their maxima."""
        count = len(self.asked)
        rates = self.rates(x)
        changes = [
            self.rates(x + DIFFERENCE * np.array([[[1.0]], [[0.0]]])),
            self.rates(x + DIFFERENCE * np.array([[[0.0]], [[1.0]]])),
        ]
        starts, ends = [], []
        for own, *changed in zip(rates, *changes, strict=True):
            starts.append(np.concatenate([own[:-1], *(c[1:-1] for c in changed), own[:-2], own[:-2]]))
            ends.append(np.concatenate([own[1:], own[2:], own[2:], *(c[1:-1] for c in changed)]))
        times = self._changed.between(Rates(*starts), Rates(*ends))
        if not np.isfinite(times).all():
            return np.inf, x
        own, at_start, at_end = times[:count], times[count : 3 * count - 2], times[3 * count - 2 :]
        by_start = (at_start.reshape(self._shape) - own[1:]) / DIFFERENCE
        by_end = (at_end.reshape(self._shape) - own[:-1]) / DIFFERENCE
        longest = np.maximum(own.max(axis=1, keepdims=True), ROUNDING)
        powers = (own / longest) ** exponent
        sums = powers.sum(axis=1, keepdims=True)
        totals = (longest * sums ** (1.0 / exponent))[:, 0]
        free = np.isnan(self.asked)
        weights = np.where(free, 1.0, np.where(totals > self.asked, LATE, 0.0))
        cost = float((weights * np.where(free, totals, totals - self.asked)).sum())
        shares = weights[:, None] * sums ** (1.0 / exponent - 1.0) * (own / longest) ** (exponent - 1.0)
        return cost, shares[1:] * by_start + shares[:-1] * by_end


def _stopping_speed(distance: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> FloatArray:
    """The speed without acceleration from which a joint can stop within a distance."""
    room = np.maximum(distance, 0.0)
    with np.errstate(invalid="ignore"):
        ramp = np.where(np.isfinite(acceleration), acceleration**2 / (2.0 * jerk), 0.0)
        braked = np.where(np.isfinite(acceleration), np.sqrt(ramp**2 + 2.0 * acceleration * room) - ramp, np.inf)
        eased = np.cbrt(room**2 * jerk)
    braked = np.where(np.isfinite(jerk) & ~(eased > 2.0 * ramp), eased, braked)
    speed: FloatArray = np.where(np.isfinite(distance), braked, np.inf)
    return speed
