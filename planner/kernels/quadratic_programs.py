"""Convex quadratic programs with limits, solved by an interior-point method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.library import call, doubles
from planner.spatial import FloatArray


class QuadraticProgram(NamedTuple):
    """Minimise cost . x + curvature . x^2 / 2 where matrix x <= bounds and lower <= x <= upper.

    Attributes:
        cost: (variables,).
        curvature: (variables,), not negative: the diagonal of the second derivative.
        matrix: (limits, variables). Rows that are zero but next to each other, and in the last column, are quick.
        bounds: (limits,).
        lower: (variables,), finite.
        upper: (variables,), finite and above the lower ones.
    """

    cost: FloatArray
    curvature: FloatArray
    matrix: FloatArray
    bounds: FloatArray
    lower: FloatArray
    upper: FloatArray


class Gap(NamedTuple):
    """The gap to the optimum at which a program counts as solved: the larger of two.

    Attributes:
        least: The first.
        share: The second, as a fraction of the decrease of the objective below `reference`.
        reference: A value of the objective.
    """

    least: float
    share: float = 0.0
    reference: float = 0.0


def solve_quadratic_program(program: QuadraticProgram, start: FloatArray, gap: Gap) -> FloatArray:
    """Return the minimum (variables,), about as near to it as requested.

    Args:
        program: The program, in units in which cost and variables are about 1.
        start: (variables,), within all limits and bounds and on none of them.
        gap: Where to stop.
    """
    n, count = len(start), len(program.bounds)
    x: np.ndarray = doubles(start, n).copy()
    shapes = (n,), (n,), (count, n), (count,), (n,), (n,)
    parts = [doubles(part, *shape) for part, shape in zip(program, shapes, strict=True)]
    call("minimise", n, count, *parts, doubles(gap, 3), x)
    return x
