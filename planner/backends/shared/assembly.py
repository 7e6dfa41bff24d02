"""Timed segments and dwells, put together to a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.polynomials import cumulative_sums, differentiate, horner, summing_to
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.paths import JointPath
    from planner.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class TimedPieces:
    """Pieces of a trajectory, those of one segment in order.

    Attributes:
        lengths: (pieces,), s; a piece of length 0 is not there.
        coefficients: (pieces, joints, order), ascending powers of local time.
        segments: (pieces,), index of the segment of each.
    """

    lengths: FloatArray
    coefficients: FloatArray
    segments: np.ndarray

    def of(self, rows: np.ndarray) -> TimedPieces:
        """Some of them, by index or mask."""
        return TimedPieces(self.lengths[rows], self.coefficients[rows], self.segments[rows])


def sampled(pieces: TimedPieces, count: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration and jerk (pieces * count, joints) at even times on each piece, ends included."""
    tau = np.linspace(0.0, 1.0, count) * pieces.lengths[:, None]
    joints = pieces.coefficients.shape[1]
    q, v, a, j = (
        horner(differentiate(pieces.coefficients, k)[:, None], tau[..., None]).reshape(-1, joints) for k in range(4)
    )
    return q, v, a, j


def largest_speeds(pieces: TimedPieces) -> FloatArray:
    """(pieces, joints), of cubic pieces: at their ends, or where the acceleration vanishes."""
    h = pieces.lengths[:, None]
    v, a = differentiate(pieces.coefficients), differentiate(pieces.coefficients, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = np.nan_to_num(np.clip(-a[..., 0] / a[..., 1], 0.0, h))
    speeds: FloatArray = np.abs([horner(v, t) for t in (np.zeros_like(h), turning, h)]).max(axis=0)
    return speeds


def joined(parts: Sequence[TimedPieces]) -> TimedPieces:
    """All pieces, one part's after the other's."""
    order = max(part.coefficients.shape[2] for part in parts)
    return TimedPieces(
        np.concatenate([part.lengths for part in parts]),
        np.concatenate([_padded(part.coefficients, order) for part in parts]),
        np.concatenate([part.segments for part in parts]),
    )


def assemble(path: JointPath, parts: Sequence[TimedPieces]) -> Trajectory:
    """The trajectory of all segments, with the dwells at their ends.

    Args:
        path: With its dwells.
        parts: Pieces of each segment of the path, the segments in any order.
    """
    count, joints = len(path.durations), path.robot.dof
    order = max(part.coefficients.shape[2] for part in parts)
    rests = np.zeros((count + 1, joints, 1))
    rests[:, :, 0] = path.positions
    # A dwell belongs to the segment that ends there, the first to segment 0, which it precedes.
    dwell = np.arange(count + 1) - 1
    owners = np.concatenate([*(part.segments for part in parts), dwell])
    sequence = np.argsort(owners, kind="stable")
    owners = np.maximum(owners[sequence], 0)
    coefficients = np.concatenate([_padded(part.coefficients, order) for part in parts] + [_padded(rests, order)])
    lengths = np.concatenate([*(_exactly(part, path.durations).lengths for part in parts), path.dwells])[sequence]
    dwells = np.flatnonzero(sequence >= len(sequence) - len(dwell))
    times = cumulative_sums(lengths)
    there = lengths > 0.0
    return Trajectory(
        lengths=lengths[there],
        coefficients=coefficients[sequence][there],
        segments=owners[there],
        arrivals=times[dwells],
        departures=times[dwells + 1],
    )


def _exactly(part: TimedPieces, asked: FloatArray) -> TimedPieces:
    """The same pieces, the lengths of each segment with an asked duration summing to it."""
    lengths = part.lengths.copy()
    there = np.bincount(part.segments, minlength=len(asked)) > 0
    for segment in np.flatnonzero(there & ~np.isnan(asked)).tolist():
        own = part.segments == segment
        lengths[own] = summing_to(lengths[own], asked[segment])
    return TimedPieces(lengths, part.coefficients, part.segments)


def _padded(coefficients: FloatArray, order: int) -> FloatArray:
    return np.pad(coefficients, ((0, 0), (0, 0), (0, order - coefficients.shape[2])))
