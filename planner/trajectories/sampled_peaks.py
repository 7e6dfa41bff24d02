"""Peaks of functions other than polynomials, sampled coarsely, then finely where a peak between samples could matter.

A parabola through three samples at equal distances exceeds the largest of them by at most an eighth of their second
difference. The bound doubles this for other functions. The first samples are so dense that positions, velocities and
accelerations are nearly parabolas between three of them. Where samples are further apart, the bound adds the deviation
from a parabola, as a fraction of the largest sample. So pieces far from the peak need few samples.

The back ends and the certificate share this arithmetic; its tests compare it with 20,000 samples of every motion.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidProblem
from planner.kernels.library import TooManySamples
from planner.kernels.polynomials import count_parts
from planner.kernels.sampled_peaks import search_peaks
from planner.spatial import FloatArray
from planner.tolerances import LIMIT_TOLERANCE, ROUNDING
from planner.trajectories.extrema import UnitPolynomials

CAUTION = 2.0
"""Factor on second differences and on a motion's deviation from parabolas, for functions that follow a motion loosely.
"""

DERIVATIVES = 6
"""Number of derivatives of a motion that `parts_of` looks at, the motion itself included."""

SAMPLES_PER_RADIAN = 25
"""Samples by the travel of the joint that travels most, rad or m: a step of 0.04 changes torques by a thousandth."""

FEWEST_PARTS = 2
"""Parts that a piece has at least, of two samples each."""

MOST_PEAK_PARTS = 512
"""Parts that a piece has at most for its velocities and accelerations; where a joint travels far, it has more."""

OFF_PARABOLA = 3e-4
"""Share of their peaks by which a joint's velocity and acceleration may be off parabolas on a part."""

LEAST_PEAK_SHARE = 0.01
"""Share of the largest peak of any joint that a joint's own peak counts as at least: smaller motions do not matter."""

COARSER = 4
"""Factor by which the first samples are further apart than parts ask for; then motions are off parabolas by 2 %."""

PEAK_ACCURACY = 1e-4
"""Relative amount by which the true peak may exceed the largest sample."""

BROKEN = 1.0 + LIMIT_TOLERANCE
"""Ratio to a limit above which the limit counts as broken; near it, finer samples decide."""

FINER = 4
"""Parts that a step is cut into where samples have to be finer: fewer need more rounds, more need more samples."""

MOST_ROUNDS = 10
"""Times that steps are cut: from the coarsest, a millionth of them is left."""

MOST_SAMPLES = 600_000
"""Largest number of samples of a motion at once, besides the allowance of each piece: about 0.5 GiB and 5 s."""

MOST_SAMPLES_OF_PIECE = 24
"""Allowance of samples for each piece of a motion with many: its steps, all cut twice."""

EASY_TRAVEL = MOST_PEAK_PARTS / SAMPLES_PER_RADIAN
"""Travel of a joint, rad or m, that takes a piece to `MOST_PEAK_PARTS` parts where it moves at twice its mean speed."""

MOST_TRAVEL = MOST_SAMPLES * COARSER / (2 * SAMPLES_PER_RADIAN * (FINER - 1))
"""Travel, rad or m, beyond `EASY_TRAVEL` of each segment, for which torque and tool motion can be sampled: 2,500 turns.

It assumes twice the mean speed, and that all steps are cut once.
"""

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
"""Message for a motion that would need more samples."""

BEND_COLUMNS = 3
"""Number of columns after the functions that bound the effect of bends between samples."""


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
    """
    density = np.array([LEAST_PEAK_SHARE, OFF_PARABOLA, MOST_PEAK_PARTS, SAMPLES_PER_RADIAN, FEWEST_PARTS])
    return count_parts(derivatives.bernstein, lengths, density)


def sampled_peaks(
    use: Callable[[np.ndarray, FloatArray], FloatArray],
    parts: np.ndarray,
    quantities: np.ndarray,
    groups: np.ndarray,
    decided_at: float = np.inf,
    above: FloatArray | float = 0.0,
    bend: tuple[int, float] | None = None,
) -> Peaks:
    """Find the largest magnitude of each quantity over the pieces of each group.

    Args:
        use: Functions of piece (N,) and unit time (N,), (N, columns), signed, as shares of their limits; smooth on each
            piece. With `bend` there are `BEND_COLUMNS` more. The first is the speed of the tool, divided by the speed
            that uses the whole limit in the tightest bend. The others are its acceleration, divided by the limit, and
            its acceleration, divided by that speed per unit of time.
        parts: (pieces,), number of parts of each piece: enough to make the functions about parabolas on a part
            (`parts_of`).
        quantities: (columns,), index of the quantity that each function belongs to, ascending from 0 without gaps.
        groups: (pieces,), index of the group of each piece, from 0 on without gaps.
        decided_at: The function decides whether a peak exceeds this value, however close it is.
        above: Level below which peaks do not matter, one number or (groups,); the result may be too low for them.
        bend: Column of the tool's acceleration across its path, and the power to which it is raised there. Where the
            tool is slow, its path may bend between two samples; None: no such column.

    Raises:
        InvalidProblem: A joint travels so far that the peaks would take too many samples.
    """
    if np.maximum(-(-parts // COARSER) - MOST_PEAK_PARTS // COARSER, 0).sum() > MOST_SAMPLES / 2:
        raise InvalidProblem([(("limits",), TOO_FAR)])
    column, power = (-1, 1.0) if bend is None else bend
    most_samples = max(MOST_SAMPLES, MOST_SAMPLES_OF_PIECE * len(parts))
    of_rounds = COARSER, FINER, MOST_ROUNDS, CAUTION, OFF_PARABOLA, PEAK_ACCURACY, decided_at
    accuracy = np.array([*of_rounds, SLOWING, LEAST_BEND, most_samples, column, power, ROUNDING])
    lowest = np.broadcast_to(above, int(groups.max()) + 1)
    more = 0 if bend is None else BEND_COLUMNS
    try:
        return Peaks(*search_peaks(partial(_in_blocks, use), parts, quantities, groups, lowest, accuracy, more))
    except TooManySamples:
        raise InvalidProblem([(("limits",), TOO_FAR)]) from None


def _in_blocks(
    use: Callable[[np.ndarray, FloatArray], FloatArray], pieces: np.ndarray, units: FloatArray
) -> FloatArray:
    """Return the values (N, columns) at unit times (N,) of pieces (N,), computed some at a time."""
    if len(pieces) <= ROWS_AT_ONCE:
        return use(pieces, units)
    starts = range(0, len(pieces), ROWS_AT_ONCE)
    return np.concatenate([use(pieces[start:][:ROWS_AT_ONCE], units[start:][:ROWS_AT_ONCE]) for start in starts])
