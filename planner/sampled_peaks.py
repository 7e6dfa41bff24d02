"""Peaks of what is no polynomial: sampled, and finer wherever second differences leave room for more.

A parabola through three samples at equal distances rises above the largest of them by at most an eighth of their second
difference. For what is no parabola that is doubled; and to begin with there are so many samples that nothing is far
from one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.tolerances import LIMIT_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.extrema import UnitPolynomials
    from planner.spatial import FloatArray

CAUTION = 2.0
"""What second differences are multiplied by."""

DERIVATIVES = 6
"""Of a motion that `parts_of` looks at, the motion itself included."""

SAMPLES_PER_RADIAN, FEWEST_PARTS, MOST_PARTS = 25, 2, 512
"""By the travel of the busiest joint (rad, or m); and parts of a piece, of two samples each."""

OFF_PARABOLA, LEAST_SHARE = 3e-4, 0.01
"""What a joint's velocity and acceleration may be off parabolas on a part, as a share of their peaks; or of this share
of the largest peak of a joint."""

KNOWN_TO = 1e-4
"""Of itself, what a peak may be larger than the largest sample."""

BROKEN = 1.0 + LIMIT_TOLERANCE
"""From this on a limit counts as broken; where it might be, finer samples decide."""

MOST_HALVINGS = 20


class Peak(NamedTuple):
    """The largest of one quantity.

    Attributes:
        use: Its magnitude, as a share of the limit there.
        piece: Where.
        unit: When, on unit time.
        column: Which function of the quantity.
    """

    use: float
    piece: int
    unit: float
    column: int


def parts_of(derivatives: UnitPolynomials, lengths: FloatArray) -> np.ndarray:
    """(pieces,): parts of pieces on which no joint travels far, and velocities and accelerations are about parabolas.

    A parabola through three samples, steps of h apart, is off by at most h^3 / (9 sqrt(3)) times the third derivative.

    Args:
        derivatives: Of the joints by time, `DERIVATIVES` of them.
        lengths: (pieces,), s.
    """
    largest = np.abs(derivatives.bernstein).max(axis=3)
    half = SAMPLES_PER_RADIAN * largest[1].max(axis=1) * lengths
    for order in (1, 2):
        peaks = largest[order].max(axis=0)
        peaks = np.maximum(peaks, LEAST_SHARE * peaks.max()) + np.finfo(float).tiny
        bends = (largest[order + 3] / peaks).max(axis=1) / (9.0 * np.sqrt(3.0) * OFF_PARABOLA)
        half = np.maximum(half, lengths * np.cbrt(bends))
    return np.asarray(np.clip(np.ceil(half / 2.0), FEWEST_PARTS, MOST_PARTS), dtype=int)


def sampled_peaks(
    use: Callable[[np.ndarray, FloatArray], FloatArray], parts: np.ndarray, quantities: np.ndarray
) -> list[Peak]:
    """The largest magnitude of each quantity over all pieces.

    Args:
        use: Functions of piece (N,) and unit time (N,), (N, columns), signed, as shares of their limits; smooth on each
            piece.
        parts: (pieces,), that a piece is looked at in, with samples at both ends and in the middle of each: as many as
            make the functions about parabolas on a part (`parts_of`).
        quantities: (columns,), index of the quantity that each function belongs to, from 0 on without gaps.
    """
    counts = 2 * parts + 1
    pieces = np.repeat(np.arange(len(parts)), counts)
    number = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts)
    units = number / (counts - 1)[pieces]
    values = use(pieces, units)
    peaks = _improved([Peak(-1.0, 0, 0.0, 0)] * (int(quantities.max()) + 1), values, pieces, units, quantities)
    first = np.flatnonzero((number % 2 == 0) & (number < counts[pieces] - 1))
    triples = np.stack([values[first], values[first + 1], values[first + 2]])
    pieces, units, step = pieces[first], units[first], 0.5 / parts[pieces[first]]
    for _ in range(MOST_HALVINGS):
        best = np.array([peak.use for peak in peaks])[quantities]
        bends = np.abs(triples[0] - 2.0 * triples[1] + triples[2])
        room = np.abs(triples).max(axis=0) + CAUTION / 8.0 * bends
        undecided = (room > BROKEN) & (best <= BROKEN)
        rows = np.flatnonzero((undecided | (room > best * (1.0 + KNOWN_TO))).any(axis=1))
        if not len(rows):
            break
        pieces, units, step, triples = pieces[rows], units[rows], step[rows] / 2.0, triples[:, rows]
        between = np.concatenate([units + step, units + 3.0 * step])
        values = use(np.tile(pieces, 2), between)
        peaks = _improved(peaks, values, np.tile(pieces, 2), between, quantities)
        left, right = np.split(values, 2)
        triples = np.concatenate([[triples[0], left, triples[1]], [triples[1], right, triples[2]]], axis=1)
        units = np.concatenate([units, units + 2.0 * step])
        pieces, step = np.tile(pieces, 2), np.tile(step, 2)
    return peaks


def _improved(
    peaks: list[Peak], values: FloatArray, pieces: np.ndarray, units: FloatArray, quantities: np.ndarray
) -> list[Peak]:
    """The peaks, replaced where samples are larger."""
    found = []
    for quantity, peak in enumerate(peaks):
        columns = np.flatnonzero(quantities == quantity)
        magnitudes = np.abs(values[:, columns])
        row, column = np.unravel_index(int(np.argmax(magnitudes)), magnitudes.shape)
        here = Peak(float(magnitudes[row, column]), int(pieces[row]), float(units[row]), int(columns[column]))
        found.append(here if here.use > peak.use else peak)
    return found
