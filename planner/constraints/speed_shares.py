"""The largest shares of velocity limits by position that a motion uses, found and not sampled.

A velocity curve is the condition square w^2 + linear w <= constant + slope p, a polynomial on each piece of a motion.
Where the motion uses no more than the share x, square (w / x)^2 + linear w / x - constant - slope p is not positive.
Bernstein coefficients bound that polynomial. Intervals of time are halved until no bound exceeds the largest share that
was seen at their ends.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np

from planner.robots.varying.velocity_curves import LEAST_SPEED, VelocityConditions
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials
from planner.trajectories.sampled_peaks import Peaks

SHARES_KNOWN_TO = 1e-9
"""Relative amount by which a largest share may exceed the one that is found."""

MOST_HALVINGS_OF_TIME = 45
"""Number of times that an interval of time is halved, at most."""

ANY_MORE = 1e4
"""Share of a limit above which the exact share does not matter."""


def largest_speed_shares(
    conditions: VelocityConditions,
    motion: UnitPolynomials,
    limits: FloatArray,
    groups: np.ndarray,
    above: FloatArray | float = 0.0,
) -> Peaks:
    """Find the largest share of the allowed speeds that joints use in each group of pieces.

    Args:
        conditions: The velocity curves of the joints.
        motion: Positions and velocities, stacked, on unit time.
        limits: The share (pieces, joints) that may be used; the result is relative to it.
        groups: The group (pieces,) of each piece, from 0 on without gaps.
        above: Shares up to this, one for all or (groups,), do not matter: the result may be less.
    """
    order = motion.bernstein.shape[3]
    signs = np.array([1.0, -1.0])[:, None, None, None]
    p, w = (signs * values for values in motion.bernstein[:2])
    rows: tuple[np.ndarray, ...] = np.nonzero((w.max(axis=3) > LEAST_SPEED) & np.isfinite(limits))
    side, piece, joint = rows
    p, w = p[side, piece, joint], w[side, piece, joint]
    limit, group = limits[piece, joint], groups[piece]
    start, width = np.zeros(len(p)), np.ones(len(p))
    count = int(groups.max()) + 1
    use = np.zeros(count)
    found_at = np.zeros((3, count))  # piece, unit time and joint of each largest share
    lowest = np.broadcast_to(above, count)

    def note(at: int, units: FloatArray) -> None:
        """Keep the largest shares seen, at the first or last Bernstein coefficient."""
        allowed = conditions.speeds(side, joint, p[:, at])
        shares = np.where(w[:, at] > LEAST_SPEED, w[:, at] / allowed / limit, 0.0)
        order_of = np.lexsort((shares, group))
        last = order_of[np.append(np.diff(group[order_of]) > 0, True)] if len(group) else order_of
        better = last[shares[last] > use[group[last]]]
        use[group[better]] = shares[better]
        found_at[:, group[better]] = piece[better], units[better], joint[better]

    note(0, start)
    note(-1, start + width)
    halves = _halving(order)
    for _ in range(MOST_HALVINGS_OF_TIME):
        best = np.maximum(use, lowest)[group] * (1.0 + SHARES_KNOWN_TO)
        left = (best < ANY_MORE) & _may_exceed(conditions, side, joint, p, w, best * limit)
        if not left.any():
            break
        halved = np.repeat(np.flatnonzero(left), 2)
        second = np.arange(len(halved)) % 2
        p, w = (np.einsum("kij,nj->nki", halves, values[left]).reshape(-1, order) for values in (p, w))
        side, piece, joint, limit, group = (values[halved] for values in (side, piece, joint, limit, group))
        width = width[halved] / 2.0
        start = start[halved] + second * width
        note(0, start)
    found = use[:, None], found_at[0][:, None].astype(int), found_at[1][:, None], found_at[2][:, None].astype(int)
    return Peaks(*found)


def _may_exceed(
    conditions: VelocityConditions,
    side: np.ndarray,
    joint: np.ndarray,
    p: FloatArray,
    w: FloatArray,
    shares: FloatArray,
) -> np.ndarray:
    """Tell whether motions (N, order) may use more than shares (N,) of a velocity curve somewhere on their interval."""
    scaled = w / np.maximum(shares, LEAST_SPEED)[:, None]
    elevate, square = _products(w.shape[1])
    of_position, of_speed = p @ elevate.T, scaled @ elevate.T
    of_square = np.einsum("kij,ni,nj->nk", square, scaled, scaled)
    exceeds = np.zeros(len(p), dtype=bool)
    for k in range(conditions.square.shape[2]):
        own = (values[side, joint, k][:, None] for values in conditions.arrays)
        by_square, linear, constant, slope, low, high = own
        meets = (p.max(axis=1) >= low[:, 0]) & (p.min(axis=1) <= high[:, 0])
        excess = by_square * of_square + linear * of_speed - constant - slope * of_position
        exceeds |= meets & (excess.max(axis=1) > 0.0)
    result: np.ndarray = exceeds & (w.max(axis=1) > LEAST_SPEED)
    return result


@lru_cache(maxsize=16)
def _halving(order: int) -> FloatArray:
    """Return matrices (2, order, order) from Bernstein coefficients to those on the first and on the second half."""
    first = np.array([[comb(i, j) / 2.0**i if j <= i else 0.0 for j in range(order)] for i in range(order)])
    return np.stack([first, first[::-1, ::-1]])


@lru_cache(maxsize=16)
def _products(order: int) -> tuple[FloatArray, FloatArray]:
    """Return the maps of Bernstein coefficients to twice the degree: of a polynomial, and of the product of two."""
    degree = order - 1
    square = np.zeros((2 * degree + 1, order, order))
    for i in range(order):
        for j in range(order):
            square[i + j, i, j] = comb(degree, i) * comb(degree, j) / comb(2 * degree, i + j)
    return square.sum(axis=2), square
