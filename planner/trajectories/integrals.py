"""Integrals over time of joint quantities along a trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.spatial import FloatArray
from planner.trajectories.polynomials import differentiate, horner
from planner.trajectories.trajectory import Trajectory

GAUSS_RULE = np.polynomial.legendre.leggauss(4)
"""Gauss-Legendre points (4,) and weights (4,) on [-1, 1] for integrals over each part of a piece."""

INTEGRAL_PARTS = 400
"""The number of parts that a trajectory is cut into for integrals, since absolute values have kinks."""


class Nodes(NamedTuple):
    """The times at which a trajectory is looked at for integrals over its time.

    Attributes:
        weights: (N,), s: the integral of anything is the sum of its values times these.
        segments: (N,), index of the segment that each belongs to.
        states: Positions (N, joints), velocities, accelerations and jerks, rad or m by powers of s.
    """

    weights: FloatArray
    segments: np.ndarray
    states: tuple[FloatArray, FloatArray, FloatArray, FloatArray]

    @classmethod
    def of(cls, trajectory: Trajectory) -> Nodes:
        """Return the nodes of a trajectory with a positive duration."""
        counts = np.ceil(INTEGRAL_PARTS * trajectory.lengths / trajectory.duration).astype(int)
        pieces = np.repeat(np.arange(len(counts)), counts)
        part = np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts)
        lengths = (trajectory.lengths / counts)[pieces]
        points, weights = GAUSS_RULE
        tau = ((part[:, None] + 0.5 * (points + 1.0)) * lengths[:, None])[..., None]
        coefficients = trajectory.coefficients[pieces][:, None]
        dof = trajectory.coefficients.shape[1]
        q, dq, ddq, jerk = (horner(differentiate(coefficients, k), tau).reshape(-1, dof) for k in range(4))
        segments = np.repeat(trajectory.segments[pieces], len(points))
        return cls((0.5 * weights * lengths[:, None]).ravel(), segments, (q, dq, ddq, jerk))
