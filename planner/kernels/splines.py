"""Interpolating splines in time: their coefficients, their sensitivities to the durations, and their peaks."""

from __future__ import annotations

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray

MOST_PEAKS = {3: 7, 5: 16}
"""Most peaks of a joint on a segment, by degree: two ends for each limited rate, and the extrema of all orders."""


def interpolate(
    degree: int, positions: FloatArray, durations: FloatArray, velocities: FloatArray, given: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Interpolate positions (segments + 1, joints) by a spline of degree 3 or 5 that is at rest at both ends.

    Args:
        degree: 3 or 5.
        positions: The positions.
        durations: (segments,), positive.
        velocities: (segments - 1, joints), at the inner waypoints with given velocities.
        given: (segments - 1,), mask of the waypoints with given velocities.

    Returns:
        Coefficients (segments, joints, degree + 1) on unit time, and the ends (segments, joints, degree). The ends are
        the travel, then the derivatives by unit time at the start and at the end of each segment.
    """
    segments, joints = len(durations), positions.shape[1]
    unit, ends = np.empty((segments, joints, degree + 1)), np.empty((segments, joints, degree))
    known = doubles(velocities, segments - 1, joints), indices(given, 2, segments - 1)
    through = doubles(positions, segments + 1, joints), doubles(durations, segments)
    call("spline", degree, segments, joints, *through, *known, unit, ends)
    return unit, ends


def sensitivities(
    durations: FloatArray,
    given: np.ndarray,
    ends: FloatArray,
    at: tuple[np.ndarray, np.ndarray, np.ndarray, FloatArray],
) -> FloatArray:
    """Differentiate derivatives by time, at fixed unit times, by the logarithm of each duration: (points, segments).

    Args:
        durations: (segments,).
        given: (segments - 1,), where velocities are given.
        ends: (segments, joints, degree), see `interpolate`.
        at: Segment, joint, order of the derivative and unit time of each of the points.
    """
    segments, joints, degree = ends.shape
    segment, joint, order, u = at
    points, slopes = len(u), np.zeros((len(u), segments))
    spline = doubles(durations, segments), indices(given, 2, segments - 1), doubles(ends, *ends.shape)
    where = indices(segment, segments, points), indices(joint, joints, points), indices(order, degree + 1, points)
    call("spline_sensitivities", degree, segments, joints, *spline, points, *where, doubles(u, points), slopes)
    return slopes


def peaks(
    durations: FloatArray,
    given: np.ndarray,
    unit: FloatArray,
    span: FloatArray,
    rates: tuple[FloatArray, FloatArray],
    position: tuple[FloatArray, FloatArray],
    search: tuple[float, ...],
) -> tuple[np.ndarray, FloatArray]:
    """Find where the rates and positions of a spline may come nearest to their limits.

    Args:
        durations: (segments,).
        given: (segments - 1,), where velocities are given.
        unit: (segments, joints, degree + 1), see `interpolate`.
        span: (joints,), the travels that overshoots are measured by.
        rates: Lower and upper limits, both (rates, segments, joints), of the derivatives from the velocity on.
        position: Lower and upper limits (joints,).
        search: The numbers of the structure `SplineLimits` of the kernels.

    Returns:
        Segments, joints and orders (3, peaks), and unit times, values, excesses and weights (4, peaks).
    """
    segments, joints, order = unit.shape
    count, room = np.zeros(1, dtype=np.int64), MOST_PEAKS[order - 1] * segments * joints
    where, numbers = np.empty((3, room), dtype=np.int64), np.empty((4, room))
    spline = doubles(durations, segments), indices(given, 2, segments - 1), doubles(unit, *unit.shape)
    limits = [doubles(side, len(rates[0]), segments, joints) for side in rates]
    measured = *limits, doubles(position, 2, joints), doubles(search, 5)
    sizes = order - 1, segments, joints
    call(
        "peaks_of_spline", *sizes, *spline, doubles(span, joints), len(rates[0]), *measured, room, where, numbers, count
    )
    return where[:, : count[0]], numbers[:, : count[0]]
