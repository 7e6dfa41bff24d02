"""The one type of trajectory: piecewise polynomials, their peaks and integrals."""

from planner.trajectories.polynomials import powers

__all__ = ["powers"]
