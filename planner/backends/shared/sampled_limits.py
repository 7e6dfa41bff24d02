"""The limits that no polynomial has, torque and tool speed: what they ask of durations, found on samples."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.shared.refusals import BindingLimit, refuse_what_gravity_exceeds
from planner.dynamics import inverse_dynamics
from planner.extrema import derivatives_on_unit_time
from planner.kinematics.forward import tool_speeds
from planner.limits import TCP_QUANTITIES
from planner.polynomials import horner
from planner.sampled_peaks import DERIVATIVES, parts_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.limits import SegmentLimits
    from planner.polynomials import SegmentedPolynomial
    from planner.robots import Robot
    from planner.spatial import FloatArray

SAMPLED_MARGIN = 1.0005
"""Durations set by sampled quantities (torque, tool speed) are longer by this, for what lies between samples."""

CAUTION, MOST_HALVINGS = 2.0, 8
"""Between three samples a parabola rises above the largest by at most an eighth of their second difference: what it is
multiplied by, for all that is no parabola; and times that steps are halved where it is more than the margin allows."""


class SampledLimits:
    """Limits that no polynomial has: torque and tool speed, found on samples.

    Attributes:
        limited: (segments,), where there is any.
        each: The limits there are, one of each joint and two of the tool.
    """

    def __init__(self, robot: Robot, limits: SegmentLimits) -> None:
        self.robot = robot
        self.linear, self.angular = limits.tcp_linear_velocity, limits.tcp_angular_velocity
        self.torque = limits.torque if robot.has_dynamics else np.full_like(limits.torque, np.inf)
        self.limited = np.isfinite(self.linear) | np.isfinite(self.angular) | np.isfinite(self.torque).any(axis=1)
        self.each: list[BindingLimit] = [
            *(BindingLimit("torque", name) for name in robot.joint_names),
            *(BindingLimit(quantity) for quantity in TCP_QUANTITIES),
        ]

    def stretch(
        self,
        pieces: SegmentedPolynomial,
        rows: np.ndarray,
        groups: np.ndarray,
    ) -> tuple[FloatArray, np.ndarray]:
        """(groups,): factors on all times with which pieces keep these limits, less than 1 where they could be faster.

        And (groups,): index in `each` of the limit that sets it.

        Args:
            pieces: Of some length each.
            rows: (pieces,), of the limits.
            groups: (pieces,), from 0 on without gaps.

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """

        def needed(at: np.ndarray, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
            torque = partial(self._stretch_for_torque, segments=pieces.segments[at], q=q, v=v, a=a)
            return self._of_samples(rows[at], q, v, torque)

        return _peaks(needed, pieces, groups)

    def use(self, pieces: SegmentedPolynomial, rows: np.ndarray) -> FloatArray:
        """(pieces,): the largest share of one of these limits that each piece uses.

        Args:
            pieces: Of some length each.
            rows: (pieces,), of the limits.
        """

        def shares(at: np.ndarray, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
            return self._of_samples(rows[at], q, v, lambda limit: np.abs(inverse_dynamics(self.robot, q, v, a)) / limit)

        return _peaks(shares, pieces, np.arange(len(rows)))[0]

    def _of_samples(
        self, rows: np.ndarray, q: FloatArray, v: FloatArray, of_torque: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """(N, limits): shares of the limits of tool speed, and what is to be known of the torque limits (N, joints)."""
        linear, angular, torque = self.linear[rows], self.angular[rows], self.torque[rows]
        values = np.zeros((len(rows), len(self.each)))
        if np.isfinite(linear).any() or np.isfinite(angular).any():
            speeds = tool_speeds(self.robot, q, v)
            values[:, -2], values[:, -1] = speeds[0] / linear, speeds[1] / angular
        if np.isfinite(torque).any():
            values[:, :-2] = of_torque(torque)
        return values

    def _stretch_for_torque(
        self, limit: FloatArray, segments: np.ndarray, q: FloatArray, v: FloatArray, a: FloatArray
    ) -> FloatArray:
        """(N, joints). With q(t / T) the torque is g(q) + b / T^2, b being the torque of T = 1 without gravity."""
        still = np.zeros_like(q)
        gravity = inverse_dynamics(self.robot, q, still, still)
        refuse_what_gravity_exceeds(self.robot, segments, gravity, limit)
        inertial = inverse_dynamics(self.robot, q, v, a) - gravity
        headroom = limit - np.sign(inertial) * gravity
        factors: FloatArray = np.sqrt(np.abs(inertial) / headroom)
        return factors


def _peaks(
    of_samples: Callable[[np.ndarray, FloatArray, FloatArray, FloatArray], FloatArray],
    motion: SegmentedPolynomial,
    groups: np.ndarray,
) -> tuple[FloatArray, np.ndarray]:
    """(groups,): the largest values over the pieces of each group, with the margin; and (groups,): in which column.

    There are more samples wherever a peak may be between them.

    Args:
        of_samples: Values (N, columns) of piece (N,), position, velocity and acceleration (N, joints).
        motion: Pieces of some length each.
        groups: (pieces,), from 0 on without gaps.
    """
    best, columns = np.zeros(int(groups.max()) + 1), np.zeros(int(groups.max()) + 1, dtype=int)
    derivatives = derivatives_on_unit_time(motion, DERIVATIVES)
    counts, pieces = 2 * parts_of(derivatives, motion.lengths) + 1, np.arange(len(motion.lengths))
    for _ in range(MOST_HALVINGS + 1):
        own = counts[pieces]
        at, first = np.repeat(pieces, own), np.cumsum(own) - own
        unit = (np.arange(len(at)) - np.repeat(first, own)) / (counts - 1)[at]
        values = of_samples(at, *(horner(derivatives.coefficients[k][at], unit[:, None]) for k in range(3)))
        largest, owners = values.max(axis=1), groups[at]
        worst = _largest_of_each(largest, owners, len(best))
        better = np.flatnonzero((worst >= 0) & (largest[worst] > best))
        best[better], columns[better] = largest[worst[better]], values[worst[better]].argmax(axis=1)
        triples = values[:-2], values[1:-1], values[2:]
        bends = np.abs(triples[0] - 2.0 * triples[1] + triples[2])
        room = (np.max(triples, axis=0) + CAUTION / 8.0 * bends).max(axis=1)
        open_ones = (room > best[owners[1:-1]] * SAMPLED_MARGIN) & (at[:-2] == at[2:])
        pieces = np.unique(at[1:-1][open_ones])
        if not len(pieces):
            break
        counts[pieces] = 2 * counts[pieces] - 1
    return best * SAMPLED_MARGIN, columns


def _largest_of_each(values: FloatArray, owners: np.ndarray, count: int) -> np.ndarray:
    """(count,): index of the largest of the values (N,) of each owner (N,); of an owner without any, -1."""
    order = np.argsort(values, kind="stable")
    largest = np.full(count, -1)
    largest[owners[order]] = order  # the last one stays
    return largest
