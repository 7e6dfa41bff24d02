"""The one trajectory type: piecewise polynomials per joint, in local time, on common breakpoints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.poses import FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint positions as polynomials of time; a path with time on it.

    On piece i, of length `lengths[i]`, joint j is at sum_k coefficients[i, j, k] * tau^k for the local time
    tau in [0, lengths[i]]. Local time keeps the coefficients exact however late the piece is.

    Attributes:
        lengths: (pieces,), s, all positive.
        coefficients: (pieces, joints, order), ascending powers of local time, unrounded.
        segments: (pieces,), index of the waypoint segment that each piece belongs to; the dwell at a
            waypoint belongs to the segment that ends there (at the first waypoint: to segment 0).
        arrivals: (waypoints,), s, when each waypoint is reached.
        departures: (waypoints,), s, when it is left again, after its dwell.
    """

    lengths: FloatArray
    coefficients: FloatArray
    segments: np.ndarray
    arrivals: FloatArray
    departures: FloatArray

    @cached_property
    def breakpoints(self) -> FloatArray:
        """(pieces + 1,), s, from 0 to the duration."""
        return cumulative_times(self.lengths)

    @property
    def duration(self) -> float:
        """S."""
        return float(self.breakpoints[-1])

    def derivative_coefficients(self, order: int) -> FloatArray:
        """Coefficients (pieces, joints, ...) of the derivative of that order."""
        return differentiate(self.coefficients, order)

    def locate(self, times: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Piece index (N,) and local time (N,) of the times (N,); at a breakpoint the later piece."""
        pieces = np.searchsorted(self.breakpoints[1:-1], times, side="right")
        return pieces, np.minimum(times - self.breakpoints[pieces], self.lengths[pieces])

    def evaluate(self, times: FloatArray, derivatives: Sequence[int] = (0, 1, 2)) -> list[FloatArray]:
        """The asked derivatives (0: position, 1: velocity, ...) at times (N,); each (N, joints).

        Args:
            times: (N,), s, within [0, duration].
            derivatives: Orders of differentiation.
        """
        pieces, tau = self.locate(times)
        column = tau[:, None]
        return [horner(self.derivative_coefficients(order)[pieces], column) for order in derivatives]

    def sample_times(self, period: float) -> FloatArray:
        """0, period, 2 period, ... and last the duration itself; strictly increasing."""
        steps = int(np.ceil(self.duration / period * (1.0 - 1e-9)))
        return np.append(np.arange(steps) * period, self.duration)


def cumulative_times(lengths: FloatArray) -> FloatArray:
    """0 and the running sums of `lengths`, summed in extended precision and rounded once."""
    sums = np.cumsum(lengths, dtype=np.longdouble).astype(np.float64)
    return np.concatenate([[0.0], sums])


def differentiate(coefficients: FloatArray, order: int = 1) -> FloatArray:
    """Coefficients of the derivative; ascending powers on the last axis, never empty."""
    for _ in range(order):
        if coefficients.shape[-1] == 1:
            return np.zeros_like(coefficients)
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    return coefficients


def horner(coefficients: FloatArray, tau: FloatArray) -> FloatArray:
    """Value of the polynomials (..., order) at `tau`, which broadcasts against (...)."""
    value: FloatArray = coefficients[..., -1] + np.zeros_like(tau)
    for k in range(coefficients.shape[-1] - 2, -1, -1):
        value = value * tau + coefficients[..., k]
    return value
