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

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.lbfgs import lbfgs
from planner.backends.state_to_state import (
    Passage,
    Passages,
    RateLimits,
    Rates,
    ShortestTimes,
    cubic_pieces,
    least_times,
)

if TYPE_CHECKING:
    from planner.backends.state_to_state import Synchronization
    from planner.kinematics.poses import FloatArray

EXPONENTS, MOST_STEPS = (10.0, 40.0, 200.0), (12, 12, 15)
"""Of the norms that stand for the maxima, one after the other; and the most steps of the search with each."""

AROUND = np.array([[0.0, 0.0], *([np.cos(angle), np.sin(angle)] for angle in np.arange(0.1, 6.28, np.pi / 5.0))])
"""Changes of the two variables of a joint at a waypoint that are tried; none first."""

WIDEST, NARROWEST, MOST_SWEEPS = 0.3, 1e-3, 8
"""Their size, and how often all waypoints are moved."""

DIFFERENCE = 1e-5
"""Change of a variable by which slopes are measured."""

INSIDE = 1.0 - 1e-4
"""Share of the possible velocities and accelerations that a waypoint is passed with."""

LATE, OUTSIDE = 30.0, 30.0
"""Weights against the duration: of the time beyond an asked duration, of travel beyond the position limits."""

SLOWER = (0.75, 0.5, 0.25, 0.0)
"""Factors on a joint's velocity and acceleration at a waypoint that are tried where a segment is to be mended."""

MOST_MENDINGS = 24
"""Joints that are slowed at a waypoint, one after the other."""

ROUNDING = 1e-9
"""Relative excess of a duration, or of a position, that is rounding."""


@dataclass(frozen=True, eq=False)
class ViaProblem:
    """Waypoints to be passed.

    Attributes:
        positions: (waypoints, joints), rad or m, within their limits.
        lower: (joints,), rad or m.
        upper: (joints,), rad or m.
        limits: Of each segment and joint.
        asked: (segments,), s; NaN: as short as can be.
        start: Rates (joints,) at the first waypoint.
        end: Rates (joints,) at the last.
        synchronization: Of the joints on a segment.
    """

    positions: FloatArray
    lower: FloatArray
    upper: FloatArray
    limits: RateLimits
    asked: FloatArray
    start: Rates
    end: Rates
    synchronization: Synchronization = "time"

    @property
    def travels(self) -> FloatArray:
        """(segments, joints)."""
        travels: FloatArray = np.diff(self.positions, axis=0)
        return travels

    def in_units(self, length: FloatArray, time: float) -> ViaProblem:
        """The same problem in other units: a length (joints,) for each joint, and a time."""
        speed, surge = length / time, length / time**2
        limits = RateLimits(
            self.limits.velocity / speed, self.limits.acceleration / surge, self.limits.jerk * time / surge
        )
        return replace(
            self,
            positions=self.positions / length,
            lower=self.lower / length,
            upper=self.upper / length,
            limits=limits,
            asked=self.asked / time,
            start=Rates(self.start.velocity / speed, self.start.acceleration / surge),
            end=Rates(self.end.velocity / speed, self.end.acceleration / surge),
        )


class ViaMotion(NamedTuple):
    """How the waypoints are passed.

    Attributes:
        durations: (segments,), s.
        lengths: Of the pieces of each segment, s.
        coefficients: Of the pieces of each segment, each (pieces, joints, 4).
        lowest: (segments, joints), the least positions.
        highest: (segments, joints), the greatest.
        slowest: (segments,), index of the joint that takes the longest.
    """

    durations: FloatArray
    lengths: list[FloatArray]
    coefficients: list[FloatArray]
    lowest: FloatArray
    highest: FloatArray
    slowest: np.ndarray


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
    rates = search.at_rest if stopping or len(times) == 1 else search.fastest()
    passages = _MendedPassages(scaled, rates, search.shortest(rates))
    if not stopping:
        passages.mend()
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

        The shortest times have cliffs, where a joint can just not reach a speed in its segment, and no slope leads along
        them. Every other waypoint is moved at once, as its segments depend on no other that moves.
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
                costs = sum(self._costs(times[:, k], group + k) for k in (0, 1))
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

    def _first_guess(self) -> FloatArray:
        """With the harmonic mean of the speeds before and after, where a joint goes on in the same direction."""
        times = np.where(np.isnan(self.asked), self.shortest(self.at_rest).max(axis=1) / 1.5, self.asked)
        speeds = self.problem.travels / times[:, None]
        before, after = speeds[:-1], speeds[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(before * after > 0.0, 2.0 * before * after / (before + after), 0.0)
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


class _MendedPassages:
    """The synchronised motions between the waypoints, in the units of the search."""

    def __init__(self, problem: ViaProblem, rates: Rates, shortest: FloatArray) -> None:
        self.problem, self.rates, self.shortest = problem, rates, shortest
        travels = problem.travels
        self._passages = Passages(travels, problem.limits, problem.asked, problem.synchronization)
        self._room = problem.lower - problem.positions[:-1], problem.upper - problem.positions[:-1]
        self._times = ShortestTimes(travels, problem.limits)
        self.passages = [self._passage(segment, rates) for segment in range(len(travels))]

    def _passage(self, segment: int, rates: Rates) -> Passage | None:
        start, end = (Rates(*(rate[k] for rate in rates)) for k in (segment, segment + 1))
        return self._passages.of(segment, start, end)

    def _cost(self, segment: int, passage: Passage | None) -> float:
        if passage is None:
            return np.inf
        asked = self.problem.asked[segment]
        time = passage.duration if np.isnan(asked) else LATE * max(passage.duration - asked, 0.0)
        return float(time + OUTSIDE * self._outside(segment, passage).sum())

    def _outside(self, segment: int, passage: Passage) -> FloatArray:
        """(joints,), how far each joint leaves its limits."""
        below, above = self._room[0][segment] - passage.lowest, passage.highest - self._room[1][segment]
        outside: FloatArray = np.maximum(np.maximum(below, above), 0.0)
        return np.where(outside > ROUNDING, outside, 0.0)

    def _faults(self, segment: int) -> tuple[float, np.ndarray]:
        """How much could be gained by mending a segment, and which joints might be to blame."""
        passage = self.passages[segment]
        everyone = np.arange(self.shortest.shape[1])
        if passage is None:
            return np.inf, everyone
        outside = self._outside(segment, passage)
        least = np.fmax(self.shortest[segment].max(), self.problem.asked[segment])
        late = passage.duration - least
        if late <= 1e-6 * least:
            late = 0.0
        return late + OUTSIDE * outside.sum(), everyone if late > 0.0 else np.flatnonzero(outside)

    def mend(self) -> None:
        """Slow one joint at one waypoint or at two, the best choice each time, until nothing can be gained."""
        hopeless: set[int] = set()
        for _ in range(MOST_MENDINGS):
            faults = {s: self._faults(s) for s in range(len(self.passages)) if s not in hopeless}
            worst = max(faults, key=lambda s: faults[s][0], default=None)
            if worst is None or faults[worst][0] == 0.0:
                return
            if not self._mend(worst, faults[worst][1]):
                hopeless.add(worst)
            else:
                hopeless.clear()

    def _mend(self, segment: int, joints: np.ndarray) -> bool:
        inner = [k for k in (segment, segment + 1) if 0 < k < len(self.passages)]
        places = [[k] for k in inner] + ([inner] if len(inner) == 2 else [])
        near = range(max(segment - 1, 0), min(segment + 2, len(self.passages)))
        least = sum(self._cost(s, self.passages[s]) for s in near) * (1.0 - ROUNDING)
        best = None
        for joint in joints:
            for place in places:
                if not any(rate[place, joint].any() for rate in self.rates):
                    continue
                for factor in SLOWER:
                    rates = Rates(*(rate.copy() for rate in self.rates))
                    for rate in rates:
                        rate[place, joint] *= factor
                    trial = {s: self._passage(s, rates) if {s, s + 1} & set(place) else self.passages[s] for s in near}
                    cost = sum(self._cost(s, passage) for s, passage in trial.items())
                    if cost < least:
                        least, best = cost, (rates, trial)
        if best is None:
            return False
        self.rates = best[0]
        for s, passage in best[1].items():
            self.passages[s] = passage
        self.shortest = self._times.between(Rates(*(r[:-1] for r in self.rates)), Rates(*(r[1:] for r in self.rates)))
        return True

    def motion(self, problem: ViaProblem, length: FloatArray, time: float) -> ViaMotion | None:
        """In SI units; None where one of the motions is impossible."""
        passages = [passage for passage in self.passages if passage is not None]
        if len(passages) < len(self.passages):
            return None
        durations, lengths, coefficients = [], [], []
        for segment, passage in enumerate(passages):
            asked = self.problem.asked[segment]
            kept = passage.duration <= asked * (1.0 + ROUNDING)
            end = Rates(*(rate[segment + 1] for rate in self.rates))
            h, c = cubic_pieces(passage.profiles, self.problem.travels[segment], end)
            scale = (problem.asked[segment] if kept else passage.duration * time) / h.sum()
            durations.append(float(scale * h.sum()))
            lengths.append(h * scale)
            c = c * length[:, None] / scale ** np.arange(4)
            c[..., 0] += problem.positions[segment]
            coefficients.append(c)
        starts = problem.positions[:-1]
        return ViaMotion(
            np.array(durations),
            lengths,
            coefficients,
            starts + length * np.array([passage.lowest for passage in passages]),
            starts + length * np.array([passage.highest for passage in passages]),
            self.shortest.argmax(axis=1),
        )
