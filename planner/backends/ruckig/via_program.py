"""Velocities and accelerations at waypoints, found with all joints and all times at once.

In the time of its segment, from 0 to 1, each joint has N pieces of constant jerk. Given the segment's duration T, the
velocities and accelerations at both ends (times T and T^2), and N - 3 numbers that are left free, all is linear:

    |q'''| <= J T^3,  |q''| <= A T^2,  |q'| <= V T,  lower <= q <= upper

at the ends of the pieces and at the Bezier points between them, which the motion does not leave. The least sum of the
durations is sought by a primal-dual interior-point method without slacks (Nocedal and Wright, Numerical Optimization,
2006, ch. 19). It begins at rest at each waypoint. Limits that do not allow for that, because of the motion at the ends
of the whole, are first widened and then drawn in as the motion leaves room.

Given the durations, the joints do not know of each other, and given the states at its ends, neither do the segments:
the Newton systems are condensed, segment by segment and then joint by joint, to one for the durations.

Ended early, an interior-point method keeps its distance from what does not limit it: joints that have to wait for
others pass the waypoints at speeds at which they can, where a joint as fast as can be had to come to rest first.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.ruckig.state_to_state import Rates
from planner.backends.ruckig.via_problem import LATE
from planner.guarantees import JOINT_DERIVATIVES
from planner.time_scaling.interior_point import InteriorPoint, next_centring

if TYPE_CHECKING:
    from planner.backends.ruckig.via_problem import ViaProblem
    from planner.spatial import FloatArray
    from planner.time_scaling.interior_point import NewtonTerms

PIECES = 8
"""Number of pieces of constant jerk in each segment."""

MOST_STEPS = 30
"""Newton steps in one search."""

GAP = 0.15
"""Gap to the optimum, relative to the duration, at which the search ends: near enough for the sweeps that follow."""

FIRST_SHARE = 0.5
"""Share of the duration that the sum of all barriers is at first."""

FIRST_CENTRING = 0.2
"""Share of the mean complementarity that is the barrier of the first Newton step."""

LEAST_CENTRING = 0.1
"""Share of the mean complementarity that is the next barrier after a Newton step made in full."""

KEPT = 0.01
"""Share of the distance to a limit that a step must leave."""

SHORTER = 0.7
"""Factor by which a step is shortened that leaves less."""

MOST_SHORTENINGS = 20
"""Times that a step is shortened before the search ends where it is."""

SLOWER = 1.05
"""Ratio of the durations that the search begins with to the shortest from rest to rest: it has to begin inside."""

MARGIN = 0.05
"""Room that a limit is widened to leave where it leaves next to none: share of the limit, or of the travel."""

NO_ROOM = 1e-3
"""Share of that room below which a limit leaves next to none."""

NO_LIMIT = 1e6
"""Number that stands for an infinite limit, in units in which everything is about 1."""

FIXED = 4
"""Unknowns of a joint on a segment that are not its own: velocity and acceleration at its start and at its end."""


class _Grid(NamedTuple):
    """The limited quantities of a joint on a segment of duration 1, as linear functions of travel and unknowns.

    Attributes:
        rows: Coefficients (rows, unknowns) of velocity and acceleration at the start and the end, and of the free
            numbers.
        travel: Coefficients (rows,) of the travel.
        powers: Orders of differentiation (rows,): 3 for jerks, 2 for accelerations, 1 for velocities, 0 for positions.
    """

    rows: FloatArray
    travel: FloatArray
    powers: np.ndarray


class _Point(NamedTuple):
    """The values of all unknowns of the search.

    Attributes:
        times: Durations (segments,).
        states: Velocities and accelerations (waypoints, joints, 2).
        free: The free numbers (segments, joints, free) of each joint on each segment.
    """

    times: FloatArray
    states: FloatArray
    free: FloatArray

    def moved(self, step: _Point, share: float) -> _Point:
        """Go a share of a step further."""
        return _Point(*(own + share * change for own, change in zip(self, step, strict=True)))


def passing_states(problem: ViaProblem) -> Rates:
    """Find velocities and accelerations (waypoints, joints) for a fast motion, near to the fastest.

    Args:
        problem: The problem, in units in which everything is about 1.
    """
    point = _Program(problem).solve()
    return Rates(point.states[..., 0], point.states[..., 1])


class _Program:
    """The search. Limits are arrays (2, segments, joints, rows): the upper ones, then the lower."""

    def __init__(self, problem: ViaProblem) -> None:
        self.grid = grid = _grid(PIECES)
        travels = problem.travels
        count, joints = travels.shape
        bounds = np.empty((2, count, joints, len(grid.powers)))
        for power, quantity in enumerate(JOINT_DERIVATIVES[1:], 1):
            lower, upper = np.abs(problem.limits.bounds(quantity))
            bounds[..., grid.powers == power] = np.stack([upper, lower])[..., None]
        lower, upper = problem.limits.position
        rooms = (upper - problem.positions[:-1], problem.positions[:-1] - lower)
        for own, room in zip(bounds, rooms, strict=True):
            own[..., grid.powers == 0] = room[..., None]
        self.bounds = np.minimum(bounds, NO_LIMIT)
        self.signs = np.array([1.0, -1.0]).reshape(2, 1, 1, 1)
        self.by_travel = travels[..., None] * grid.travel
        self.shortest = np.where(np.isnan(problem.asked), 0.0, problem.asked)
        self.costs = np.where(np.isnan(problem.asked), 1.0, LATE)
        self.start = self._start(problem)
        slacks = self._slacks(self.start)
        margin = MARGIN * self.bounds * self.start.times[:, None, None] ** grid.powers
        margin[..., grid.powers == 0] = MARGIN
        margin = np.append(margin, np.zeros(count))  # the least durations have room already
        self.widened = np.where(slacks < NO_ROOM * margin, margin - slacks, 0.0)

    def _start(self, problem: ViaProblem) -> _Point:
        """Give the point at which the search begins: at rest at all inner waypoints, with the least jerks there are."""
        count, joints = problem.travels.shape
        times = np.zeros(count)
        for power in (1, 2, 3):
            own = self.grid.powers == power
            used = np.abs(self.by_travel[..., own]) / self.bounds.min(axis=0)[..., own]
            times = np.maximum(times, used.max(axis=(1, 2)) ** (1.0 / power))
        states = np.zeros((count + 1, joints, 2))
        for at, rates in ((0, problem.start), (-1, problem.end)):
            states[at] = np.stack(rates, axis=-1)
        free = np.zeros((count, joints, self.grid.rows.shape[1] - FIXED))
        return _Point(np.maximum(times, self.shortest) * SLOWER, states, free)

    def _scales(self, times: FloatArray) -> FloatArray:
        """Return factors (segments, 1, unknowns) from the unknowns of a segment to those on a segment of duration 1."""
        scales = np.ones((len(times), 1, self.grid.rows.shape[1]))
        scales[:, 0, 0] = scales[:, 0, 2] = times
        scales[:, 0, 1] = scales[:, 0, 3] = times**2
        return scales

    def _slacks(self, point: _Point) -> FloatArray:
        """Return the slacks, flat: those of the upper and the lower limits, then those of the durations (segments,)."""
        ends = np.concatenate([point.states[:-1], point.states[1:]], axis=-1)
        unknowns = self._scales(point.times) * np.concatenate([ends, point.free], axis=-1)
        values = self.by_travel + unknowns @ self.grid.rows.T
        limits = self.bounds * point.times[:, None, None] ** self.grid.powers
        return np.append(limits - self.signs * values, point.times - self.shortest)

    def solve(self) -> _Point:
        """Search, and give the point at which the search ends."""
        point, widened = self.start, self.widened
        slacks = self._slacks(point) + widened
        limits = InteriorPoint.on_central_path(slacks, FIRST_SHARE * float(self.costs @ point.times) / slacks.size)
        centring = FIRST_CENTRING
        for _ in range(MOST_STEPS):
            if limits.gap < GAP * float(self.costs @ point.times):
                break
            terms = limits.towards(centring * limits.gap / slacks.size)
            try:
                step, changes = self._newton(point, terms)
            except np.linalg.LinAlgError:  # too near to a limit for the numbers
                break
            made = limits.step(terms, changes)
            length = made.primal
            # What is left is not linear in the durations: the step is shortened until enough is.
            for _ in range(MOST_SHORTENINGS):
                there = point.moved(step, length)
                left = self._slacks(there) + widened
                if (left > KEPT * limits.slacks).all():
                    break
                length *= SHORTER
            else:
                break
            centring = next_centring(min(length, made.dual), LEAST_CENTRING)
            drawn_in = np.minimum(widened, left / 2.0)
            widened = widened - drawn_in
            point, limits = there, limits.moved(left - drawn_in, made)
        return point

    def _newton(self, point: _Point, terms: NewtonTerms) -> tuple[_Point, FloatArray]:
        """Compute Newton's step, and the changes of the slacks, to first order.

        Args:
            point: The point where the step starts.
            terms: What the limits add to Newton's system.
        """
        rows, powers, times = self.grid.rows, self.grid.powers, point.times[:, None, None]
        count, joints = point.times.size, point.free.shape[1]
        by_time = np.concatenate([point.states[:-1], point.states[1:]], axis=-1)
        by_time[..., 1::2] *= 2.0 * times
        stiff, push = (own[:-count].reshape(self.bounds.shape) for own in (terms.stiffness, terms.push))
        growth = self.bounds * (powers * times ** (powers - 1.0)) - self.signs * (by_time @ rows[:, :FIXED].T)
        scales, pulled = self._scales(point.times), stiff * growth
        # The Newton system of each joint on each segment: by its unknowns, by the duration, and the gradient.
        system = ((rows.T * stiff.sum(axis=0)[..., None, :]) @ rows) * scales[..., None] * scales[..., None, :]
        mixed = ((pulled[1] - pulled[0]) @ rows) * scales
        gradient = ((push[0] - push[1]) @ rows) * scales
        right = np.stack([mixed, gradient], axis=-1)
        by_durations = (pulled * growth).sum(axis=(0, 2, 3)) + terms.stiffness[-count:]
        durations_gradient = self.costs - terms.push[-count:] - (push * growth).sum(axis=(0, 2, 3))

        columns = np.concatenate([system[..., :FIXED], right], axis=-1)
        inner = np.linalg.solve(system[..., FIXED:, FIXED:], columns[..., FIXED:, :])
        columns = columns[..., :FIXED, :] - system[..., :FIXED, FIXED:] @ inner
        taken = np.einsum("kjf,kjfc->kc", mixed[..., FIXED:], inner[..., FIXED:])
        by_durations, durations_gradient = by_durations - taken[:, 0], durations_gradient - taken[:, 1]

        # All states of a joint, those at the ends of the whole given.
        size = 2 * (count + 1)
        chain, sides = np.zeros((joints, size, size)), np.zeros((joints, size, count + 1))
        for k in range(count):
            own = slice(2 * k, 2 * k + FIXED)
            chain[:, own, own] += columns[k, ..., :FIXED]
            sides[:, own, k] += columns[k, ..., FIXED]
            sides[:, own, count] += columns[k, ..., FIXED + 1]
        chain, sides = chain[:, 2:-2, 2:-2], sides[:, 2:-2]
        solved = np.linalg.solve(chain, sides)
        taken = np.einsum("jsk,jsc->kc", sides[..., :count], solved)
        faster = np.linalg.solve(taken[:, :count] - np.diag(by_durations), durations_gradient - taken[:, count])

        states = np.zeros_like(point.states)
        inner_states = -(solved[..., :count] @ faster + solved[..., count])
        states[1:-1] = inner_states.reshape(joints, -1, 2).swapaxes(0, 1)
        ends = np.concatenate([states[:-1], states[1:]], axis=-1)
        ones = np.ones((count, joints, 1))
        known = np.concatenate([ends, faster[:, None, None] * ones, ones], axis=-1)
        free = -(inner @ known[..., None])[..., 0]
        change = (scales * np.concatenate([ends, free], axis=-1)) @ rows.T
        changes = growth * faster[:, None, None] - self.signs * change
        return _Point(faster, states, free), np.append(changes, faster)


@lru_cache(maxsize=1)
def _grid(pieces: int) -> _Grid:
    """Build the grid of equal pieces of constant jerk: what is limited are their Bezier points."""
    d, identity = 1.0 / pieces, np.eye(pieces + 2)
    # All by velocity and acceleration at the start, and the jerks of the pieces.
    jerks = identity[2:]
    accelerations = np.cumsum(np.vstack([identity[1], d * jerks]), axis=0)
    a = accelerations[:-1]
    velocities = np.cumsum(np.vstack([identity[0], d * (a + d / 2.0 * jerks)]), axis=0)
    v = velocities[:-1]
    positions = np.cumsum(np.vstack([0.0 * identity[0], d * (v + d * (a / 2.0 + d / 6.0 * jerks))]), axis=0)
    p = positions[:-1]
    limited = (
        jerks,
        accelerations,
        np.vstack([velocities, v + d / 2.0 * a]),
        np.vstack([p + d / 3.0 * v, p + d * (2.0 / 3.0 * v + d / 6.0 * a)]),
    )
    # The jerks for travel, velocity and acceleration at the end: the least there are, and those that change nothing.
    end = np.vstack([positions[-1], velocities[-1], accelerations[-1]])
    least = np.linalg.pinv(end[:, 2:])
    _, _, right = np.linalg.svd(end[:, 2:])
    unknowns = np.vstack(
        [
            np.eye(2, FIXED + pieces - 3),
            np.hstack([-least @ end[:, :2], least[:, 1:], right[3:].T]),
        ]
    )
    travel = np.concatenate([[0.0, 0.0], least[:, 0]])
    rows = np.vstack(limited)
    powers = np.repeat([3, 2, 1, 0], [len(part) for part in limited])
    return _Grid(rows @ unknowns, rows @ travel, powers)
