"""The cost of a motion, and the shares of its limits that it uses: by samples of the motion, without the solver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import pinocchio as pin

from planner.backends.shared.assembly import extreme_velocities, sampled
from planner.dynamics import inverse_dynamics
from planner.limits import SegmentLimits
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.polynomials import SegmentedPolynomial, differentiate, horner

Objective = Literal["effort", "mechanical_work", "jerk"]

COST_SAMPLES = 400
"""Number of samples of a motion, about."""

SMOOTHING = 1e-3
"""Share of a joint's largest power by which the magnitude of its power is rounded where it changes its sign."""

NO_TORQUE = 1e-9
"""Torque, N m, or force, N, relative to the robot's weight, N, up to which it counts as none.

The positions along a followed path have rounding, and processors round differently: the accelerations of a joint at
rest come to 1e-13 to 1e-10 m/s^2.
"""

FEWEST_ON_A_PIECE = 9
"""Least number of samples of each of its pieces; odd, for Simpson's rule."""


class Cost:
    """The cost of motions of a robot.

    Where masses of links are unknown, many motions take no torque. There the jerk is part of the cost, and in the first
    motion it costs as much as the rest.

    Attributes:
        units: Units (3, joints) by which torque, power and jerk of each joint are measured.
        adds_jerk: Whether the jerk is part of the cost beside the objective.
    """

    def __init__(self, robot: Robot, objective: Objective, first: SegmentedPolynomial) -> None:
        """Choose the units.

        Args:
            robot: The robot, with its payload.
            objective: The objective.
            first: The motion that the search begins with: its largest torques stand for limits that there are not.
        """
        self.robot, self.objective = robot, objective
        self.adds_jerk = False
        jerk = _finite(robot.limit("jerk"))
        torque = np.ones_like(jerk) if objective == "jerk" else _torque_units(robot, first)
        power = np.full_like(torque, (torque * _finite(robot.limit("velocity"))).max())
        self.units = np.array([torque, power, jerk])
        if objective == "jerk" or not has_massless_links(robot):
            return
        by_torque, by_jerk = (_integral(first, rate) for rate in (self._rate_of_torques, self._rate_of_jerk))
        if by_torque > 0.0 and by_jerk > 0.0:
            self.units[2] *= (by_jerk / by_torque) ** 0.5
            self.adds_jerk = True

    def of(self, pieces: SegmentedPolynomial) -> float:
        """Return the integral over the motion, s."""
        return _integral(pieces, self._rate)

    def at_rest(self, positions: FloatArray) -> FloatArray:
        """Return the cost (N,) of a second at rest at positions (N, joints)."""
        still = np.zeros_like(positions)
        return self._rate(positions, still, still, still)

    def _rate(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        """Return the cost (N,) of a second in states (N, joints)."""
        if self.objective == "jerk":
            return self._rate_of_jerk(q, v, a, j)
        rate = self._rate_of_torques(q, v, a, j)
        return rate + self._rate_of_jerk(q, v, a, j) if self.adds_jerk else rate

    def _rate_of_jerk(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        rate: FloatArray = ((j / self.units[2]) ** 2).sum(axis=1)
        return rate

    def _rate_of_torques(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        torques = _torques(self.robot, q, v, a)
        if self.objective == "effort":
            effort: FloatArray = ((torques / self.units[0]) ** 2).sum(axis=1)
            return effort
        work: FloatArray = np.abs(torques * v / self.units[1]).sum(axis=1)
        return work


def has_massless_links(robot: Robot) -> bool:
    """Return whether a joint moves a link without mass; the last joint moves at least the payload."""
    model = robot.model
    last = model.frames[robot.tip_frame_id].parentJoint
    return any(model.inertias[joint].mass <= 0.0 for joint in range(1, model.njoints) if joint != last)


def _integral(pieces: SegmentedPolynomial, rate: Callable[..., FloatArray]) -> float:
    """Return the integral of a rate over a motion; by Simpson's rule on each piece."""
    count = max(FEWEST_ON_A_PIECE, COST_SAMPLES // len(pieces.lengths) // 2 * 2 + 1)
    rates = rate(*sampled(pieces, count)).reshape(-1, count)
    simpson = np.full(count, 2.0)
    simpson[1::2] = 4.0
    simpson[[0, -1]] = 1.0
    return float((rates @ simpson * pieces.lengths).sum() / (3.0 * (count - 1)))


def _torques(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Return torques (N, joints); 0 where they are so small beside the robot's weight that they are rounding."""
    torques = inverse_dynamics(robot, q, v, a)
    weight = pin.computeTotalMass(robot.model) * float(np.linalg.norm(robot.model.gravity.linear))
    return np.where(np.abs(torques) <= NO_TORQUE * weight, 0.0, torques)


def _torque_units(robot: Robot, first: SegmentedPolynomial) -> FloatArray:
    """Return the torque limits (joints,), completed by the largest limit of a joint of the same kind.

    The kinds are turning and sliding. If no joint of a kind has a limit, its largest torque or force in the first
    motion stands in.
    """
    units = robot.limit("torque").copy()
    for kind in (robot.is_angle, ~robot.is_angle):
        known = kind & np.isfinite(units)
        if (kind & ~known).any():
            q, v, a, _ = sampled(first, FEWEST_ON_A_PIECE)
            taken = units[known] if known.any() else np.abs(_torques(robot, q, v, a)[:, kind])
            units[kind & ~known] = taken.max() or 1.0
    return units


def _finite(limits: FloatArray) -> FloatArray:
    """Return limits (joints,), completed by the largest limit of another joint, or by 1."""
    known = limits[np.isfinite(limits)]
    return np.where(np.isfinite(limits), limits, known.max(initial=0.0) or 1.0)


def use_of_rates(pieces: SegmentedPolynomial, limits: SegmentLimits) -> float:
    """Return the largest share of a velocity, acceleration or jerk limit that cubic pieces use, exactly."""
    h = pieces.lengths[:, None]
    a, j = (differentiate(pieces.coefficients, k) for k in (2, 3))
    rows = np.arange(len(h))
    uses = [limits.velocity.used(rows, velocity) for velocity in extreme_velocities(pieces)]
    uses += [limits.acceleration.used(rows, horner(a, t)) for t in (np.zeros_like(h), h)]
    uses.append(limits.jerk.used(rows, j[..., 0]))
    return float(np.max(uses))
