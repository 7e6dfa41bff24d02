"""Velocities and accelerations at waypoints, found with all joints and all times at once.

In the time of its segment, from 0 to 1, each joint has N pieces of constant jerk. Given are the segment's duration T,
the velocities and accelerations at both ends (times T and T^2), and N - 3 free numbers. Then every limit is linear:

    |q'''| <= J T^3,  |q''| <= A T^2,  |q'| <= V T,  lower <= q <= upper

at the ends of the pieces and at the Bezier points between them, whose hull contains the motion. A primal-dual
interior-point method without slacks minimises the sum of the durations (Nocedal and Wright, Numerical Optimization,
2006, ch. 19). It starts at rest at each waypoint. If the end states do not allow that, the limits are first widened,
and narrowed again as the motion permits.

Given the durations, the joints are independent of each other. Given the states at its ends, so is a segment. So the
Newton systems are condensed, segment by segment and then joint by joint, to one for the durations.

An interior-point method that ends early keeps its distance from limits that do not bind. So joints that wait for others
pass the waypoints at speeds from which they can wait. A joint at its fastest would have to come to rest first.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.backends.ruckig.state_to_state import Rates
from planner.backends.ruckig.via_problem import LATE, ViaProblem
from planner.guarantees import JOINT_DERIVATIVES
from planner.kernels.passing import PassingProblem, best_states
from planner.spatial import FloatArray

PIECES_PER_SEGMENT = 8
"""Number of pieces of constant jerk in each segment."""

FIRST_DURATION_RATIO = 1.05
"""Ratio of the durations that the search begins with to the shortest from rest to rest: it has to begin inside."""

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


def passing_states(problem: ViaProblem) -> Rates:
    """Find velocities and accelerations (waypoints, joints) for a fast motion, near to the fastest.

    Args:
        problem: The problem, in units in which everything is about 1.
    """
    grid, travels, free = _grid(PIECES_PER_SEGMENT), problem.travels, np.isnan(problem.requested)
    bounds = np.empty((2, *travels.shape, len(grid.powers)))
    for power, quantity in enumerate(JOINT_DERIVATIVES[1:], 1):
        lower, upper = np.abs(problem.limits.bounds(quantity))
        bounds[..., grid.powers == power] = np.stack([upper, lower])[..., None]
    lower, upper = problem.limits.position
    rooms = (upper - problem.positions[:-1], problem.positions[:-1] - lower)
    for own, room in zip(bounds, rooms, strict=True):
        own[..., grid.powers == 0] = room[..., None]
    bounds = np.minimum(bounds, NO_LIMIT)
    # It begins at rest at all inner waypoints, with the least jerks there are.
    times = np.zeros(len(travels))
    for power in (1, 2, 3):
        own = grid.powers == power
        used = np.abs(travels[..., None] * grid.travel[own]) / bounds.min(axis=0)[..., own]
        times = np.maximum(times, used.max(axis=(1, 2)) ** (1.0 / power))
    shortest = np.where(free, 0.0, problem.requested)
    program = PassingProblem(*grid, travels, bounds, shortest, np.where(free, 1.0, LATE))
    found = best_states(
        program, np.maximum(times, shortest) * FIRST_DURATION_RATIO, np.stack(problem.resting_rates, axis=-1)
    )
    return Rates(found[..., 0], found[..., 1])


@lru_cache(maxsize=1)
def _grid(pieces: int) -> _Grid:
    """Build the grid of equal pieces of constant jerk, whose Bezier points are limited."""
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
