"""The solvers of the fastest profile of the path velocity: the compiled kernel, and the package toppra."""

from __future__ import annotations

from typing import Literal

Solver = Literal["kernel", "package"]
"""The compiled kernel, or the package toppra."""


class SolverFailed(ArithmeticError):
    """The package's solver found no profile, though standing still keeps every limit, so that there is one."""
