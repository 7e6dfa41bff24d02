"""Peaks of what is no polynomial: sampled coarsely, and finer wherever what lies between samples could matter.

A parabola through three samples at equal distances rises above the largest of them by at most an eighth of their second
difference, which is doubled for what is no parabola. Samples are so dense to begin with that positions, velocities and
accelerations are nearly parabolas between three of them; by how much they are off is added, as a share of the largest
sample, where samples are further apart. So pieces that are far from the peak are left out after few samples.

The back ends and the certificate share this arithmetic; its tests hold it against 20,000 samples of every motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.errors import InvalidProblem
from planner.tolerances import LIMIT_TOLERANCE
from planner.trajectories.extrema import peaks_on_pieces

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.spatial import FloatArray
    from planner.trajectories.extrema import UnitPolynomials

CAUTION = 2.0
"""Factor on second differences and on what a motion is off parabolas, for functions that follow a motion loosely."""

DERIVATIVES = 6
"""Number of derivatives of a motion that `parts_of` looks at, the motion itself included."""

SAMPLES_PER_RADIAN = 25
"""Samples by the travel of the joint that travels most, rad or m: a step of 0.04 changes torques by a thousandth."""

FEWEST_PARTS = 2
"""Parts that a piece has at least, of two samples each."""

MOST_PARTS = 512
"""Parts that a piece has at most for its velocities and accelerations; where a joint travels far, it has more."""

OFF_PARABOLA = 3e-4
"""Share of their peaks by which a joint's velocity and acceleration may be off parabolas on a part."""

LEAST_SHARE = 0.01
"""Share of the largest peak of any joint that a joint's own peak counts as at least: smaller motions do not matter."""

COARSER = 4
"""Factor by which the first samples are further apart than parts ask for; then motions are off parabolas by 2 %."""

KNOWN_TO = 1e-4
"""Relative amount by which the true peak may exceed the largest sample."""

BROKEN = 1.0 + LIMIT_TOLERANCE
"""Use of a limit from which on it counts as broken; where it might be, finer samples decide."""

FINER = 4
"""Parts that a step is cut into where samples have to be finer: fewer need more rounds, more need more samples."""

MOST_ROUNDS = 10
"""Times that steps are cut: from the coarsest, a millionth of them is left."""

MOST_SAMPLES = 600_000
"""Samples of a motion at once, beside those that each of its pieces may have: they take about 0.5 GiB and 5 s."""

MOST_SAMPLES_OF_PIECE = 24
"""The same on each of many pieces: those of steps that are all cut twice."""

EASY_TRAVEL = MOST_PARTS / SAMPLES_PER_RADIAN
"""Travel of a joint, rad or m, that takes a piece to `MOST_PARTS` parts where it moves at twice its mean speed."""

MOST_TRAVEL = MOST_SAMPLES * COARSER / (2 * SAMPLES_PER_RADIAN * (FINER - 1))
"""Travel, rad or m, beyond `EASY_TRAVEL` of each segment, on which torque and the motion of the tool can be sampled, at
twice the mean speed and where all steps are cut once: 2,500 turns."""

ROWS_AT_ONCE = 2**15
"""Samples that are computed at once: more would take more memory, but no less time."""

SLOWING = 0.3
"""Share of its speed by which the tool may change its velocity between samples: its path is then resolved by them."""

LEAST_BEND = 0.01
"""Use of the limit of the acceleration across the path up to which bends between samples do not matter."""

TOO_FAR = (
    "on a motion on which a joint travels this far, limits of torque and of the tool cannot be checked: that would "
    "take too many samples; ask for shorter motions, or for none of these limits"
)
"""What is said of a motion that would take more samples than that."""

BEND_COLUMNS = 3
"""Number of columns after the functions that tell how much bends between samples may use."""


class Peaks(NamedTuple):
    """The largest magnitude of each quantity (second axis) on the pieces of each group (first axis).

    Attributes:
        use: Magnitudes (groups, quantities) as shares of the limits there; 0 where nothing is larger.
        pieces: Indices (groups, quantities) of the pieces where they are.
        units: Unit times (groups, quantities) on these pieces.
        columns: Indices (groups, quantities) of the functions that have them.
    """

    use: FloatArray
    pieces: np.ndarray
    units: FloatArray
    columns: np.ndarray


def parts_of(derivatives: UnitPolynomials, lengths: FloatArray) -> np.ndarray:
    """Count the parts (pieces,) of pieces on which no joint travels far and velocities and accelerations are parabolas.

    A parabola through three samples, steps of h apart, is off by at most h^3 / (9 sqrt(3)) times the third derivative.

    Args:
        derivatives: The motion and its derivatives by time, `DERIVATIVES` of them.
        lengths: (pieces,), s.
    """
    largest = np.abs(derivatives.bernstein).max(axis=3)
    half = np.zeros_like(lengths)
    for order in (1, 2):
        peaks = largest[order].max(axis=0)
        peaks = np.maximum(peaks, LEAST_SHARE * peaks.max()) + np.finfo(float).tiny
        bends = (largest[order + 3] / peaks).max(axis=1) / (9.0 * np.sqrt(3.0) * OFF_PARABOLA)
        half = np.maximum(half, lengths * np.cbrt(bends))
    half = np.minimum(half, 2.0 * MOST_PARTS)
    half = np.maximum(half, SAMPLES_PER_RADIAN * peaks_on_pieces(derivatives[1]).max(axis=1) * lengths)
    return np.asarray(np.ceil(np.maximum(half / 2.0, FEWEST_PARTS)), dtype=int)


def sampled_peaks(
    use: Callable[[np.ndarray, FloatArray], FloatArray],
    parts: np.ndarray,
    quantities: np.ndarray,
    groups: np.ndarray,
    known_to: float = KNOWN_TO,
    decided_at: float = np.inf,
    above: FloatArray | float = 0.0,
    bend: tuple[int, float] | None = None,
) -> Peaks:
    """Find the largest magnitude of each quantity over the pieces of each group.

    Args:
        use: Functions of piece (N,) and unit time (N,), (N, columns), signed, as shares of their limits; smooth on each
            piece. With `bend`, `BEND_COLUMNS` more: the speed of the tool, by that at which the tightest bend uses all
            of the limit; its acceleration, by the limit; and its acceleration by that speed and the unit of time.
        parts: (pieces,), that a piece has: as many as make the functions about parabolas on a part (`parts_of`).
        quantities: (columns,), index of the quantity that each function belongs to, ascending from 0 without gaps.
        groups: (pieces,), index of the group of each piece, from 0 on without gaps.
        known_to: Relative amount by which a true peak may exceed the one that is found.
        decided_at: Whether a peak exceeds this is found out however near it comes.
        above: Peaks up to this, one number or (groups,), do not matter: what is found of them may be less.
        bend: Column of the acceleration of the tool across its path, and the power of its use that stands there. Where
            the tool is slow, its path bends within a moment that samples may miss; None: there is none.

    Raises:
        InvalidProblem: A joint travels so far that the peaks would take too many samples.
    """
    count = len(quantities)
    coarse = -(-parts // COARSER)
    counts = 2 * coarse + 1
    if np.maximum(coarse - MOST_PARTS // COARSER, 0).sum() > MOST_SAMPLES / 2:
        raise InvalidProblem([(("limits",), TOO_FAR)])
    pieces = np.repeat(np.arange(len(parts)), counts)
    number = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts)
    units = number / (counts - 1)[pieces]
    values = _in_blocks(use, pieces, units)
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
        rows = np.flatnonzero((room[:, :count] > enough[groups[pieces]][:, quantities]).any(axis=1))
        if not len(rows) or rounds == MOST_ROUNDS:
            break
        if len(rows) * len(between) > max(MOST_SAMPLES, MOST_SAMPLES_OF_PIECE * len(parts)):
            raise InvalidProblem([(("limits",), TOO_FAR)])
        pieces, units, step = pieces[rows], units[rows], step[rows] / FINER
        seen, times = np.tile(pieces, len(between)), (units + between[:, None] * step).ravel()
        values = _in_blocks(use, seen, times)
        samples.append((seen, times, np.abs(values[:, :count])))
        grid = np.empty((2 * FINER + 1, len(rows), values.shape[1]))
        grid[::FINER], grid[between] = triples[:, rows], values.reshape(len(between), len(rows), -1)
        triples = np.stack([grid[:-2:2], grid[1::2], grid[2::2]]).reshape(3, -1, values.shape[1])
        units = (units + 2.0 * np.arange(FINER)[:, None] * step).ravel()
        pieces, step = np.tile(pieces, FINER), np.tile(step, FINER)
    return _located(samples, best, quantities, groups)


def _in_blocks(
    use: Callable[[np.ndarray, FloatArray], FloatArray], pieces: np.ndarray, units: FloatArray
) -> FloatArray:
    """Return the values (N, columns) at unit times (N,) of pieces (N,), computed some at a time."""
    if len(pieces) <= ROWS_AT_ONCE:
        return use(pieces, units)
    starts = range(0, len(pieces), ROWS_AT_ONCE)
    return np.concatenate([use(pieces[start:][:ROWS_AT_ONCE], units[start:][:ROWS_AT_ONCE]) for start in starts])


def _bends_between(triples: FloatArray, most: FloatArray, step: FloatArray) -> FloatArray:
    """Bound the use (N,) of the limit of the acceleration across the path, where samples do not resolve the path.

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
    """Find where the largest magnitudes (groups, quantities) are, of samples: pieces, unit times and magnitudes."""
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
