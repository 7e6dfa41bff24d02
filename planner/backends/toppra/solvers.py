"""The solvers of the fastest profile of the path velocity: the compiled kernel, and the package toppra."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

Solver = Literal["kernel", "package"]
"""The compiled kernel, or the package toppra."""


class SolverFailed(ArithmeticError):
    """The package's solver found no profile, though standing still keeps every limit, so that there is one."""


class Reach(NamedTuple):
    """What can be reached: the largest squares of the path velocity, x = s'^2, at the gridpoints.

    Attributes:
        controllable: (intervals + 1,), from which the rest can be braked in time; not a number where it is unknown.
        x: (intervals + 1,), of these those that can be reached by accelerating: the fastest profile.
    """

    controllable: FloatArray
    x: FloatArray

    def of(self, gridpoints: np.ndarray, divisor: FloatArray | float = 1.0) -> Reach:
        """Return what is known of some gridpoints (N,), divided by (N,)."""
        return Reach(*(part[gridpoints] / divisor for part in self))

    def with_new(self, rows: np.ndarray, new: np.ndarray) -> Reach:
        """Return what is known of parts of the intervals.

        Args:
            rows: (N,), the interval of each.
            new: (N,), whether the gridpoint at its start is.
        """
        return Reach(*(np.append(np.where(new, np.nan, part[rows]), part[-1]) for part in self))
