"""The failure of the package's solver."""

from __future__ import annotations


class SolverFailed(ArithmeticError):
    """The solver found no profile, though standing still keeps every limit, so that there is one."""
