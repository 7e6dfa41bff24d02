"""Plain numpy with the results of the kernels of sampled peaks, all samples of a round at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import bernstein_matrix, shifted
from planner.trajectories.sampled_peaks import (
    CAUTION,
    COARSER,
    FEWEST_PARTS,
    FINER,
    LEAST_BEND,
    LEAST_PEAK_SHARE,
    MOST_PEAK_PARTS,
    MOST_ROUNDS,
    OFF_PARABOLA,
    PEAK_ACCURACY,
    SAMPLES_PER_RADIAN,
    SLOWING,
    Peaks,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.spatial import FloatArray


def by_parts(bernstein: FloatArray) -> FloatArray:
    """Return bounds (..., pieces, joints) of magnitudes by the Bernstein coefficients of eight parts of each piece."""
    order = bernstein.shape[-1]
    powers = bernstein @ np.linalg.inv(bernstein_matrix(order))
    parts = [shifted(powers, k / 8.0) * 8.0 ** -np.arange(order) @ bernstein_matrix(order) for k in range(8)]
    return np.asarray(np.abs(parts).max(axis=(0, -1)))


def parts_of(bernstein: FloatArray, lengths: FloatArray) -> np.ndarray:
    largest = np.abs(bernstein).max(axis=3)
    half = np.zeros_like(lengths)
    for order in (1, 2):
        peaks = largest[order].max(axis=0)
        peaks = np.maximum(peaks, LEAST_PEAK_SHARE * peaks.max()) + np.finfo(float).tiny
        bends = (largest[order + 3] / peaks).max(axis=1) / (9.0 * np.sqrt(3.0) * OFF_PARABOLA)
        half = np.maximum(half, lengths * np.cbrt(bends))
    half = np.minimum(half, 2.0 * MOST_PEAK_PARTS)
    half = np.maximum(half, SAMPLES_PER_RADIAN * by_parts(bernstein[1]).max(axis=1) * lengths)
    return np.asarray(np.ceil(np.maximum(half / 2.0, FEWEST_PARTS)), dtype=int)


def sampled_peaks(
    use: Callable[[np.ndarray, FloatArray], FloatArray],
    parts: np.ndarray,
    quantities: np.ndarray,
    groups: np.ndarray,
    known_to: float = PEAK_ACCURACY,
    decided_at: float = np.inf,
    above: FloatArray | float = 0.0,
    bend: tuple[int, float] | None = None,
) -> Peaks:
    count = len(quantities)
    coarse = -(-parts // COARSER)
    counts = 2 * coarse + 1
    pieces = np.repeat(np.arange(len(parts)), counts)
    number = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts)
    units = number / (counts - 1)[pieces]
    values = use(pieces, units)
    samples = [(pieces, units, np.abs(values[:, :count]))]
    best = np.zeros((int(groups.max()) + 1, int(quantities[-1]) + 1))
    first_columns = np.flatnonzero(np.diff(quantities, prepend=-1))
    scale = np.abs(values).max(axis=0)
    first = np.flatnonzero((number % 2 == 0) & (number < counts[pieces] - 1))
    triples = np.stack([values[first], values[first + 1], values[first + 2]])
    pieces, units, step = pieces[first], units[first], 0.5 / coarse[pieces[first]]
    fine = 0.5 / parts
    between = np.flatnonzero(np.arange(2 * FINER) % FINER)
    for rounds in range(MOST_ROUNDS + 1):
        seen, _, magnitudes = samples[-1]
        np.maximum.at(best, groups[seen], np.maximum.reduceat(magnitudes, first_columns, axis=1))
        enough = np.maximum(best * (1.0 + known_to), np.reshape(above, (-1, 1)))
        enough = np.where(best <= decided_at, np.minimum(enough, decided_at), enough)
        bends = np.abs(triples[0] - 2.0 * triples[1] + triples[2])
        off = OFF_PARABOLA * np.maximum((step / fine[pieces]) ** 3 - 1.0, 0.0)
        room = np.abs(triples).max(axis=0) + CAUTION * (bends / 8.0 + off[:, None] * scale)
        if bend is not None:
            column, power = bend
            turning = _bends_between(triples[..., count:], room[:, count:], step)
            room[:, column] = np.maximum(room[:, column], turning**power)
            bounded = np.abs(triples[..., column]) >= (1.0 - ROUNDING) * triples[..., count] ** (2.0 * power)
            has_corner = bounded.any(axis=0) & ~bounded.all(axis=0)
            growing = np.where(has_corner, room[:, count] ** (2.0 * power), 0.0)
            room[:, column] = np.maximum(room[:, column], growing)
        rows = np.flatnonzero((room[:, :count] > enough[groups[pieces]][:, quantities]).any(axis=1))
        if not len(rows) or rounds == MOST_ROUNDS:
            break
        pieces, units, step = pieces[rows], units[rows], step[rows] / FINER
        seen, times = np.tile(pieces, len(between)), (units + between[:, None] * step).ravel()
        values = use(seen, times)
        samples.append((seen, times, np.abs(values[:, :count])))
        grid = np.empty((2 * FINER + 1, len(rows), values.shape[1]))
        grid[::FINER], grid[between] = triples[:, rows], values.reshape(len(between), len(rows), -1)
        triples = np.stack([grid[:-2:2], grid[1::2], grid[2::2]]).reshape(3, -1, values.shape[1])
        units = (units + 2.0 * np.arange(FINER)[:, None] * step).ravel()
        pieces, step = np.tile(pieces, FINER), np.tile(step, FINER)
    return _located(samples, best, quantities, groups)


def _bends_between(triples: FloatArray, most: FloatArray, step: FloatArray) -> FloatArray:
    """Bound the use (N,) of the limit of the acceleration across the path, where samples do not resolve the path.

    The use is at most the acceleration, and at most the squared speed over the radius of the tightest bend.

    That is no more than the acceleration, and no more than the speed squared by the radius of the tightest bend.

    Args:
        triples: (3, N, `BEND_COLUMNS`), samples one after the other.
        most: (N, `BEND_COLUMNS`), bounds of the same.
        step: (N,), unit time between two of them.
    """
    slower = step * most[:, 2]
    bounds = np.minimum(most[:, 1], (triples[..., 0].max(axis=0) + slower) ** 2)
    is_unresolved = (slower > SLOWING * triples[..., 0].min(axis=0)) & (bounds > LEAST_BEND)
    return np.where(is_unresolved, bounds, 0.0)


def _located(
    samples: list[tuple[np.ndarray, FloatArray, FloatArray]],
    best: FloatArray,
    quantities: np.ndarray,
    groups: np.ndarray,
) -> Peaks:
    """Find the samples with the largest magnitudes (groups, quantities): pieces, unit times and magnitudes."""
    pieces, units, magnitudes = (np.concatenate(arrays) for arrays in zip(*samples, strict=True))
    own = groups[pieces]
    rows, columns = np.zeros((2, *best.shape), dtype=int)
    for quantity in range(best.shape[1]):
        there = np.flatnonzero(quantities == quantity)
        column = magnitudes[:, there].argmax(axis=1)
        largest = magnitudes[np.arange(len(own)), there[column]]
        hits = np.flatnonzero(largest == best[own, quantity])[::-1]  # the first is written last
        rows[own[hits], quantity], columns[own[hits], quantity] = hits, there[column[hits]]
    return Peaks(best, pieces[rows], units[rows], columns)
