"""The assembly of motions and dwells to a trajectory, and samples of motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.paths import JointPath
from planner.spatial import FloatArray
from planner.trajectories.polynomials import (
    SegmentedPolynomial,
    cumulative_sums,
    differentiate,
    horner,
    joined,
    summing_to,
)
from planner.trajectories.trajectory import Trajectory


def sampled(pieces: SegmentedPolynomial, count: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sample position, velocity, acceleration and jerk at even times on each piece, ends included.

    Each is of shape (pieces * count, joints).
    """
    tau = np.linspace(0.0, 1.0, count) * pieces.lengths[:, None]
    joints = pieces.coefficients.shape[1]
    q, v, a, j = (
        horner(differentiate(pieces.coefficients, k)[:, None], tau[..., None]).reshape(-1, joints) for k in range(4)
    )
    return q, v, a, j


def largest_speeds(pieces: SegmentedPolynomial) -> FloatArray:
    """Return the largest speeds (pieces, joints) of cubic pieces."""
    speeds: FloatArray = np.abs(extreme_velocities(pieces)).max(axis=0)
    return speeds


def extreme_velocities(pieces: SegmentedPolynomial) -> FloatArray:
    """Return velocities (3, pieces, joints) of cubic pieces: at their ends, and where the acceleration vanishes."""
    h = pieces.lengths[:, None]
    v, a = differentiate(pieces.coefficients), differentiate(pieces.coefficients, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = np.nan_to_num(np.clip(-a[..., 0] / a[..., 1], 0.0, h))
    return np.array([horner(v, t) for t in (np.zeros_like(h), turning, h)])


def assemble(path: JointPath, parts: Sequence[SegmentedPolynomial]) -> Trajectory:
    """Put the motions of all segments and the dwells at their ends together to a trajectory.

    A duration requested of a segment that has no length is a rest.

    Args:
        path: The path, with its dwells and the durations that are requested.
        parts: The motions of all segments of the path that have a length, the segments in any order.
    """
    still = path.still[~np.isnan(path.durations[path.still])]
    rests = SegmentedPolynomial(path.durations[still], path.positions[still][:, :, None], still)
    # A dwell belongs to the segment that ends there, the first to segment 0, which it precedes.
    dwells = SegmentedPolynomial(path.dwells, path.positions[:, :, None], np.arange(len(path.dwells)) - 1)
    whole = joined([*parts, rests, dwells])
    sequence = np.argsort(whole.segments, kind="stable")
    whole, dwelling = whole.of(sequence), sequence >= len(sequence) - len(path.dwells)
    lengths = whole.lengths
    lengths[~dwelling] = summing_to(lengths[~dwelling], whole.segments[~dwelling], path.durations)
    times, at_dwells, kept = cumulative_sums(lengths), np.flatnonzero(dwelling), lengths > 0.0
    return Trajectory(
        lengths=lengths[kept],
        coefficients=whole.coefficients[kept],
        segments=np.maximum(whole.segments[kept], 0),
        arrivals=times[at_dwells],
        departures=times[at_dwells + 1],
    )
