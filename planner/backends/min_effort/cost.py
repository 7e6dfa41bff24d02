"""The cost of a motion, and the shares of its limits that it uses: by samples of the motion, without the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.backends.shared.assembly import extreme_velocities, sampled
from planner.dynamics import inverse_dynamics
from planner.trajectories.polynomials import differentiate, horner

if TYPE_CHECKING:
    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import SegmentedPolynomial

Objective = Literal["effort", "mechanical_work", "jerk"]

SAMPLES = 400
"""Number of samples of a motion, about."""

FEWEST_ON_A_PIECE = 9
"""Least number of samples of each of its pieces; odd, for Simpson's rule."""


class Cost:
    """The cost of motions of a robot.

    Attributes:
        units: Units (3, joints) by which torque, power and jerk of each joint are measured.
    """

    def __init__(self, robot: Robot, objective: Objective) -> None:
        self.robot, self.objective = robot, objective
        torque, jerk = (_finite(robot.limit(quantity)) for quantity in ("torque", "jerk"))
        power = np.full_like(torque, (torque * _finite(robot.limit("velocity"))).max())
        self.units = np.array([torque, power, jerk])

    def of(self, pieces: SegmentedPolynomial) -> float:
        """Return the integral over the motion, s; by Simpson's rule on each piece."""
        count = max(FEWEST_ON_A_PIECE, SAMPLES // len(pieces.lengths) // 2 * 2 + 1)
        q, v, a, j = sampled(pieces, count)
        rates = self._rate(q, v, a, j).reshape(-1, count)
        simpson = np.full(count, 2.0)
        simpson[1::2] = 4.0
        simpson[[0, -1]] = 1.0
        return float((rates @ simpson * pieces.lengths).sum() / (3.0 * (count - 1)))

    def at_rest(self, positions: FloatArray) -> FloatArray:
        """Return the cost (N,) of a second at rest at positions (N, joints)."""
        still = np.zeros_like(positions)
        return self._rate(positions, still, still, still)

    def _rate(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        """Return the cost (N,) of a second in states (N, joints)."""
        if self.objective == "jerk":
            jerk: FloatArray = ((j / self.units[2]) ** 2).sum(axis=1)
            return jerk
        torques = inverse_dynamics(self.robot, q, v, a)
        if self.objective == "effort":
            effort: FloatArray = ((torques / self.units[0]) ** 2).sum(axis=1)
            return effort
        work: FloatArray = np.abs(torques * v / self.units[1]).sum(axis=1)
        return work


def _finite(limits: FloatArray) -> FloatArray:
    """Return limits (joints,), those of a joint without one being the largest of the others, or 1 if there is none."""
    known = limits[np.isfinite(limits)]
    return np.where(np.isfinite(limits), limits, known.max(initial=0.0) or 1.0)


def use_of_rates(pieces: SegmentedPolynomial, limits: SegmentLimits) -> float:
    """Return the largest share of a velocity, acceleration or jerk limit that cubic pieces use, exactly.

    Args:
        pieces: The cubic pieces.
        limits: The limits of each piece.
    """
    h = pieces.lengths[:, None]
    a, j = (differentiate(pieces.coefficients, k) for k in (2, 3))
    rows = np.arange(len(h))
    uses = [limits.used("velocity", rows, velocity) for velocity in extreme_velocities(pieces)]
    uses += [limits.used("acceleration", rows, horner(a, t)) for t in (np.zeros_like(h), h)]
    uses.append(limits.used("jerk", rows, j[..., 0]))
    return float(np.max(uses))
