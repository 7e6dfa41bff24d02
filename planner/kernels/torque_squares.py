"""Integrals over time of squared torques, between bounds by Taylor models."""

from __future__ import annotations

import numpy as np

from planner.kernels.bounded_peaks import Motion
from planner.kernels.library import call, doubles
from planner.kernels.serial_chain import LINK_NUMBERS, LOAD_NUMBERS, SerialChain
from planner.spatial import FloatArray


def bound_torque_squares(
    chain: SerialChain, motion: Motion, tolerance: FloatArray, most_intervals: int
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds (joints,) on the integrals of squared torques over all pieces of a motion.

    Args:
        chain: The joints and their links.
        motion: The motion.
        tolerance: Largest distance (joints,) of the bounds for each second.
        most_intervals: The number of intervals that may be looked at.

    Raises:
        TooManySamples: The bounds would take more intervals.
    """
    pieces, joints, order = motion.coefficients.shape
    lower, upper = np.zeros((2, joints))
    call(
        "torque_squares",
        joints,
        doubles(chain.links, joints, LINK_NUMBERS),
        doubles(chain.load, LOAD_NUMBERS),
        pieces,
        order,
        doubles(motion.lengths, pieces),
        doubles(motion.coefficients, pieces, joints, order),
        doubles(motion.bernstein, pieces, joints, order),
        doubles(tolerance, joints),
        float(most_intervals),
        lower,
        upper,
    )
    return lower, upper
