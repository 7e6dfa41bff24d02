"""The limits on a curve, as they constrain the retiming of a time scaling along it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.constraints import (
    ACCELERATION_AT_SPEED,
    OF_FRICTION,
    POWER,
    TORQUE,
    TORQUE_AT_SPEED,
    TOTAL_POWER,
    Bounds,
    Constraint,
)
from planner.constraints.at_speed import rows_at_speed
from planner.constraints.constraint import Rows
from planner.constraints.quantities import Power
from planner.dynamics import SegmentDynamics
from planner.kernels.polynomials import follow_scaling
from planner.kernels.retiming import joint_rows
from planner.kinematics.forward import JERKS, JointStates
from planner.limits import SegmentLimits
from planner.paths import JointPath, SegmentGroup
from planner.robots import Robot
from planner.robots.description import LEAST_FRICTION
from planner.spatial import FloatArray
from planner.time_scaling.linear_limits import GRIDPOINTS, LinearLimits, jerk_rows
from planner.time_scaling.refusals import refuse_what_gravity_exceeds
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, horner

Side = FloatArray | float
LimitGroup = tuple[FloatArray, Side, Side, Side, Side, Side]
"""The arrays of `LinearLimits` for some limits at N points, (N, limits), or one number for all of them."""

SLOWEST_PACE = 1e-3
"""Least pace at which viscous friction is linearised, as a multiple of the present one."""

BY_TORQUE = (POWER, TOTAL_POWER, TORQUE_AT_SPEED)
"""The limited functions of torques and speeds."""


def limits_on(path: JointPath, group: SegmentGroup) -> LimitsOnCurve:
    """Return the limits on the curve of a segment group."""
    return LimitsOnCurve(path.dynamics.robot_on(group.first), path.limits, group.curve)


class LimitsOnCurve:
    """The limits on a curve, as they constrain the retiming of a time scaling along it."""

    def __init__(self, robot: Robot, limits: SegmentLimits, curve: SegmentedPolynomial) -> None:
        """Prepare the limits.

        Args:
            robot: The robot, with its tool and payload.
            limits: Limits in rows, one for each segment of the curve.
            curve: q(s).
        """
        self.robot, self.curve, self.limits = robot, curve, limits

    def pieces(self, scaling: PiecewisePolynomial) -> np.ndarray:
        """Return the indices (pieces of the time scaling,) of the pieces of the curve that they are on."""
        return self.curve.locate(horner(scaling.coefficients[:, 0], scaling.lengths / 2.0))[0]

    def on_segments(self, scaling: PiecewisePolynomial) -> SegmentedPolynomial:
        """Mark each piece of the time scaling with the segment that it is on."""
        return scaling.of_segments(self.curve.segments[self.pieces(scaling)])

    def used(self, scaling: PiecewisePolynomial) -> tuple[FloatArray, FloatArray]:
        """Return the largest and the least share (pieces,) of its limits that the time scaling uses on each piece."""
        halves = scaling.split(np.full(len(scaling.lengths), 2))
        used = self.along(halves).used().max(axis=0).reshape(len(GRIDPOINTS), -1, 2)
        return used.max(axis=(0, 2)), used.min(axis=(0, 2))

    def at_gridpoints(self, scaling: PiecewisePolynomial) -> Along:
        """Return the states at the first gridpoints of all pieces of the time scaling, then at the second ones."""
        on, curve = np.tile(self.pieces(scaling), len(GRIDPOINTS)), self.curve
        of, t = np.tile(np.arange(len(scaling.lengths)), len(GRIDPOINTS)), GRIDPOINTS[:, None] * scaling.lengths
        parts = curve.lengths, curve.breakpoints, curve.coefficients
        (_, ds, dds), motion, slopes = follow_scaling(parts, scaling.coefficients[:, 0], of, on, t.ravel())
        return Along(JointStates(self.robot, motion[0], *slopes), ds[:, None], dds[:, None], motion, on)

    def along(self, scaling: PiecewisePolynomial) -> LinearLimits:
        """Linearise all limits at the gridpoints of pieces of the time scaling, each divided by the limit itself.

        Raises:
            LimitsUnsatisfiable: Gravity exceeds a torque limit.
        """
        along = self.at_gridpoints(scaling)
        segments = self.curve.segments[along.on]
        known = [own for own in self.limits.constraints if own[0].is_known(self.robot)]
        speeds: FloatArray | None = None
        groups: list[LimitGroup] = []
        for constraint, limits in known:
            bounds = limits.of(segments)
            if constraint.follows_path_speed:
                shares = (constraint.values(along.path) / bounds.upper).max(axis=1) ** (1.0 / constraint.order)
                speeds = np.maximum(0.0 if speeds is None else speeds, shares * along.ds[:, 0])
            elif constraint.has_rows:
                groups.append(self._with_rows(constraint, bounds, along, segments))
            elif constraint is ACCELERATION_AT_SPEED:
                groups += self._by_acceleration(bounds, along)
            elif constraint in BY_TORQUE:
                groups += self._by_torque(constraint, bounds, along)
        if jerks := [constraint.name for constraint, _ in known if constraint.name in JERKS]:
            groups.append(self._tool_jerks(jerks, segments, along))
        ends = np.cumsum([1 + 2 * self.robot.dof, *(group[0].shape[1] for group in groups)])
        of_joints = np.stack(self.limits.velocity), np.stack(self.limits.acceleration.centred), self.limits.jerk.upper
        parts = joint_rows(int(ends[-1]), segments, of_joints, along.motion, speeds)
        for group, begin, end in zip(groups, ends, ends[1:], strict=False):
            for rows, values in zip(parts, group, strict=True):
                rows[begin:end] = np.transpose(values)
        return LinearLimits(*parts)

    def _with_rows(self, constraint: Constraint, bounds: Bounds, along: Along, segments: np.ndarray) -> LimitGroup:
        """Return the limits of a constraint with rows, on the segments (N,)."""
        rows = constraint.rows(along.path)
        middle, half = (np.repeat(side, rows.rest.shape[1] // side.shape[1], axis=1) for side in bounds.centred)
        by_b, by_a, rest = along.of(constraint, rows, (middle, half))
        if constraint.counts_at_rest:
            refuse_what_gravity_exceeds(SegmentDynamics.unchanged(self.robot), segments, rest, middle, half)
        return by_b / half, by_a / half, 0.0, (rest - middle) / half, 1.0, 0.0

    def _by_torque(self, constraint: Constraint, bounds: Bounds, along: Along) -> list[LimitGroup]:
        """Return the limits of a function of torques and velocities.

        A retiming by b has the torques by_b b + by_a a + rest and the velocities v sqrt(b).
        """
        curves, torques, v = self.robot.torque_curves, TORQUE.rows(along.path), along.motion[1]
        if isinstance(constraint, Power):
            parts = along.of(TORQUE, torques)
            by_b, by_a, rest = (constraint.of(part, v) / bounds.upper for part in parts)
            return [(by_b, by_a, 0.0, rest, 0.0, 1.0)]
        if curves is None:
            return []
        allowed = bounds.upper * curves.at(np.abs(v))
        parts = along.of(TORQUE, torques, (np.zeros_like(allowed), allowed))
        per_b, per_a, held = (part / bounds.upper for part in parts)
        rows = rows_at_speed(curves, per_b, per_a, held, np.abs(v))
        return [(by_b, by_a, 0.0, rest, constant, 0.0) for by_b, by_a, rest, constant in rows]

    def _by_acceleration(self, bounds: Bounds, along: Along) -> list[LimitGroup]:
        """Return the limits of accelerations by speed, which are zero at rest."""
        curves, (_, v, a, _) = ACCELERATION_AT_SPEED.curves_of(self.robot), along.motion
        if curves is None:
            return []
        rows = rows_at_speed(curves, a / bounds.upper, v / bounds.upper, np.zeros_like(v), np.abs(v))
        return [(by_b, by_a, 0.0, rest, constant, 0.0) for by_b, by_a, rest, constant in rows]

    def _tool_jerks(self, names: Sequence[str], segments: np.ndarray, along: Along) -> LimitGroup:
        """Return the limits of the named jerks of the tool, on the segments (N,)."""
        rows = jerk_rows(self.robot, names, *along.motion)
        bound = np.stack([self.limits.of_tool[quantity][segments] for quantity in rows.quantities], axis=-1)
        by_b, by_a, by_c = (part / bound for part in rows[:3])
        return by_b, by_a, by_c, 0.0, 0.0, 1.0


class Along(NamedTuple):
    """A time scaling at points on a curve.

    Attributes:
        path: The states at N points, with s' = 1.
        ds: Path velocities (N, 1) there.
        dds: Path accelerations (N, 1).
        motion: Positions of the joints and their first three derivatives by time, (4, N, joints).
        on: The pieces (N,) of the curve that they are on.
    """

    path: JointStates
    ds: FloatArray
    dds: FloatArray
    motion: FloatArray
    on: np.ndarray

    def of(
        self, constraint: Constraint, rows: Rows, within: tuple[FloatArray, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of b and a in rows of a constraint, and values at rest, each (N, rows).

        Viscous friction grows with sqrt(b), which is at most (b / p + p) / 2. The pace p is 1, or less if otherwise the
        values at rest would be beyond the limits.

        Args:
            constraint: The constraint.
            rows: Its rows at the points.
            within: The middle (N, rows) of the limits, and their distance (N, rows) from there; None: any.
        """
        by_u, by_x, rest = rows
        by_b, friction = by_x * self.ds**2 + by_u * self.dds, self.path.robot.friction
        if friction is not None and constraint in OF_FRICTION:
            constant, linear = friction.along(self.motion[1], by_b.shape[1])
            rest, pace = rest + constant, np.ones(1)
            if within is not None:
                room = within[1] - np.abs(rest - within[0])
                pace = np.clip(room / np.maximum(np.abs(linear), LEAST_FRICTION), SLOWEST_PACE, 1.0)
            by_b, rest = by_b + linear / (2.0 * pace), rest + 0.5 * pace * linear
        return by_b, by_u * self.ds, rest
