"""Bounds at all times on the deviation of the tool from paths."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planner.certificate.path_parts import PathParts
from planner.constraints.bounded import bound_by_robot
from planner.dynamics import SegmentDynamics
from planner.kernels.bounded_peaks import KINDS, Columns, ToolPaths
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time
from planner.trajectories.trajectory import Trajectory

DEVIATION_KNOWN_TO = 1e-2
"""Relative amount by which the bound on a deviation may exceed a value that is reached."""

DEVIATION_KINDS = np.array([KINDS.index("path_position_deviation"), KINDS.index("path_orientation_deviation")])
"""The deviations in position and orientation among the kinds of the kernels."""


class BoundedDeviation(NamedTuple):
    """The largest deviation from some paths, relative to the allowed one.

    Attributes:
        peak: m or rad: no deviation exceeds it at any time.
        lower: m or rad: the deviation is at least this large at `time`.
        limit: The largest deviation allowed there, m or rad.
        time: s.
    """

    peak: float
    lower: float
    limit: float
    time: float


def bound_deviations(
    trajectory: Trajectory,
    dynamics: SegmentDynamics,
    paths: Mapping[int, PathParts],
    allowed: FloatArray,
    left_out: FloatArray,
) -> list[BoundedDeviation | None]:
    """Bound the deviations of the tool from paths at all times, in position and in orientation.

    Args:
        trajectory: The trajectory.
        dynamics: The robot with its tool on each segment.
        paths: The paths of segments.
        allowed: (paths, 2), m and rad; infinite: any deviation is allowed.
        left_out: (paths, 2, 4): spheres in which the tool may leave each path: center and radius; not positive: none.

    Returns:
        The largest deviation of each kind, relative to the allowed one; None: all allowed ones are infinite.
    """
    segments = np.array(list(paths))
    pieces = np.flatnonzero(np.isin(trajectory.segments, segments))
    of_piece = np.searchsorted(segments, trajectory.segments[pieces])
    counts = np.array([len(path.numbers) for path in paths.values()])
    rest = np.repeat(np.hstack([allowed, left_out.reshape(-1, 8)]), counts, axis=0)
    numbers = np.hstack([np.concatenate([path.numbers for path in paths.values()]), rest])
    parts = np.column_stack([np.cumsum(counts) - counts, counts])
    middle, half = np.zeros((len(pieces), 2)), allowed[of_piece]
    motion = derivatives_on_unit_time(trajectory, 1)
    of_pieces = UnitPolynomials(motion.coefficients[:, pieces], motion.bernstein[:, pieces])
    lengths, starts = trajectory.lengths[pieces], trajectory.breakpoints[pieces]
    peaks = bound_by_robot(
        dynamics,
        trajectory.segments[pieces],
        (of_pieces, lengths),
        Columns(DEVIATION_KINDS, np.zeros(2, dtype=int), np.arange(2), middle, half),
        DEVIATION_KNOWN_TO,
        ToolPaths(parts[of_piece], numbers),
    )
    error = max(path.error for path in paths.values())
    found: list[BoundedDeviation | None] = []
    for k, (bound, reached, piece, unit) in enumerate(
        zip(peaks.bound.tolist(), peaks.reached.tolist(), peaks.pieces, peaks.units, strict=True)
    ):
        limit = float(half[piece, k])
        time = float(starts[piece] + unit * lengths[piece])
        own = BoundedDeviation(bound * limit + error, max(reached * limit - error, 0.0), limit, time)
        found.append(own if np.isfinite(limit) else None)
    return found
