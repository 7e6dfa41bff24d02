"""The limits on a curve, as they constrain the retiming of a time scaling along it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.constraints import OF_FRICTION, POWER, TORQUE, TORQUE_AT_SPEED, TOTAL_POWER, Bounds, Constraint
from planner.constraints.constraint import Rows
from planner.constraints.quantities import Power
from planner.constraints.torque_at_speed import rows_at_speed
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import JERKS, JointStates
from planner.limits import SegmentLimits
from planner.paths import JointPath, SegmentGroup
from planner.robots import Robot
from planner.robots.description import LEAST_FRICTION
from planner.spatial import FloatArray
from planner.time_scaling.compose import ScaledCurve
from planner.time_scaling.linear_limits import GRIDPOINTS, LinearLimits
from planner.time_scaling.refusals import refuse_what_gravity_exceeds
from planner.time_scaling.tool_jerks import jerk_rows
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, horner

Side = FloatArray | float
LimitGroup = tuple[FloatArray, Side, Side, Side, Side, Side]
"""The arrays of `LinearLimits` for some limits, (gridpoints, pieces, limits), or one number for all of them."""

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

    def path_states(self, on: np.ndarray, s: FloatArray) -> JointStates:
        """Return the states on the curve, with s' = 1, at path positions (points, pieces, 1) on pieces (pieces,)."""
        t = np.clip(s[..., 0] - self.curve.breakpoints[on], 0.0, self.curve.lengths[on])
        return JointStates(self.robot, *self.curve.evaluate_on(np.broadcast_to(on, t.shape).ravel(), t.ravel()))

    def on_segments(self, scaling: PiecewisePolynomial) -> SegmentedPolynomial:
        """Mark each piece of the time scaling with the segment that it is on."""
        return scaling.of_segments(self.curve.segments[self.pieces(scaling)])

    def used(self, scaling: PiecewisePolynomial) -> tuple[FloatArray, FloatArray]:
        """Return the largest and the least share (pieces,) of its limits that the time scaling uses on each piece."""
        groups = self._groups(scaling.split(np.full(len(scaling.lengths), 2)))
        shares = [np.abs(by_b + rest) / (constant + inverse) for by_b, _, _, rest, constant, inverse in groups]
        used = np.max([share.max(axis=2) for share in shares], axis=0).reshape(len(GRIDPOINTS), -1, 2)
        return used.max(axis=(0, 2)), used.min(axis=(0, 2))

    def rates(self, scaling: PiecewisePolynomial) -> list[FloatArray]:
        """Return `ScaledCurve.derivatives` up to jerks at the gridpoints (gridpoints, pieces, ...) of all pieces."""
        on, t = self.pieces(scaling), GRIDPOINTS[:, None] * scaling.lengths
        return ScaledCurve(self.curve, scaling).derivatives(np.arange(len(on)), on, t, 3)

    def along(self, scaling: PiecewisePolynomial) -> LinearLimits:
        """Linearise all limits at the gridpoints of pieces of the time scaling, each divided by the limit itself."""
        groups = self._groups(scaling)
        shape = groups[0][0].shape[:2]
        ends = np.cumsum([0, *(group[0].shape[2] for group in groups)])
        parts = np.empty((6, ends[-1], *shape))
        for group, begin, end in zip(groups, ends, ends[1:], strict=False):
            for rows, values in zip(parts, group, strict=True):
                rows[begin:end] = np.broadcast_to(values, (*shape, end - begin)).transpose(2, 0, 1)
        return LinearLimits(*parts.reshape(6, ends[-1], -1))

    def _groups(self, scaling: PiecewisePolynomial) -> list[LimitGroup]:
        """Return the limits at the gridpoints of pieces of the time scaling, each (gridpoints, pieces, limits).

        Raises:
            LimitsUnsatisfiable: Gravity exceeds a torque limit.
        """
        s, ds, dds, q, first, second, third = self.rates(scaling)
        on = self.pieces(scaling)
        segments = self.curve.segments[on]
        own = self.limits.of(segments)
        speeds = self.limits.velocity.used(np.broadcast_to(segments, s.shape[:2]), first).max(axis=2)[..., None]
        middle, half = own.acceleration.centred
        groups: list[LimitGroup] = [
            (second / half, first / half, 0.0, -middle / half, 1.0, 0.0),
            (third / own.jerk.upper, 3.0 * second / own.jerk.upper, first / own.jerk.upper, 0.0, 0.0, 1.0),
        ]
        limited = [(constraint, bounds) for constraint, bounds in own.constraints if constraint.is_known(self.robot)]
        path = self.path_states(on, s)
        for constraint, bounds in limited:
            if constraint.follows_path_speed:
                shares = constraint.values(path).reshape(*s.shape[:2], -1) / bounds.upper
                speeds = np.maximum(speeds, shares.max(axis=2)[..., None] ** (1.0 / constraint.order) * ds)
            elif constraint.has_rows:
                groups.append(self._with_rows(constraint, bounds, Along(path, ds, dds, first), segments))
            elif constraint in BY_TORQUE:
                groups += self._by_torque(constraint, bounds, Along(path, ds, dds, first))
        if jerks := [constraint.name for constraint, _ in limited if constraint.name in JERKS]:
            groups.append(self._tool_jerks(jerks, own, q, first, second, third))
        return [(speeds**2, 0.0, 0.0, 0.0, 1.0, 0.0), *groups]

    def _with_rows(self, constraint: Constraint, bounds: Bounds, along: Along, segments: np.ndarray) -> LimitGroup:
        """Return the limits of a constraint with rows, on the segments (pieces,)."""
        rows = constraint.rows(along.path)
        middle, half = (np.repeat(side, rows.rest.shape[1] // side.shape[1], axis=1) for side in bounds.centred)
        by_b, by_a, rest = along.of(constraint, rows, (middle, half))
        if constraint.counts_at_rest:
            at = np.broadcast_to(segments, rest.shape[:2])
            sides = (np.broadcast_to(side, rest.shape) for side in (middle, half))
            refuse_what_gravity_exceeds(SegmentDynamics.unchanged(self.robot), at, rest, *sides)
        return by_b / half, by_a / half, 0.0, (rest - middle) / half, 1.0, 0.0

    def _by_torque(self, constraint: Constraint, bounds: Bounds, along: Along) -> list[LimitGroup]:
        """Return the limits of a function of torques and velocities.

        A retiming by b has the torques by_b b + by_a a + rest and the velocities v sqrt(b).
        """
        curves, torques = self.robot.torque_curves, TORQUE.rows(along.path)
        if isinstance(constraint, Power):
            parts = along.of(TORQUE, torques)
            by_b, by_a, rest = (constraint.of(part, along.v) / bounds.upper for part in parts)
            return [(by_b, by_a, 0.0, rest, 0.0, 1.0)]
        if curves is None:
            return []
        allowed = bounds.upper * curves.at(np.abs(along.v))
        parts = along.of(TORQUE, torques, (np.zeros_like(allowed), allowed))
        per_b, per_a, held = (part / bounds.upper for part in parts)
        rows = rows_at_speed(curves, per_b, per_a, held, np.abs(along.v))
        return [(by_b, by_a, 0.0, rest, constant, 0.0) for by_b, by_a, rest, constant in rows]

    def _tool_jerks(self, names: Sequence[str], limits: SegmentLimits, *states: FloatArray) -> LimitGroup:
        """Return the limits of jerks of the tool.

        Args:
            names: The limited ones.
            limits: The limits of each piece.
            states: Positions, velocities, accelerations and jerks (points, pieces, joints) of the time scaling.
        """
        *shape, joints = states[0].shape
        rows = jerk_rows(self.robot, names, *(values.reshape(-1, joints) for values in states))
        bound = np.stack([limits.of_tool[quantity] for quantity in rows.quantities], axis=-1)
        by_b, by_a, by_c = (part.reshape(*shape, -1) / bound for part in rows[:3])
        return by_b, by_a, by_c, 0.0, 0.0, 1.0


class Along(NamedTuple):
    """A time scaling at points on a curve.

    Attributes:
        path: The states at the points, with s' = 1.
        ds: Path velocities (..., 1) there.
        dds: Path accelerations (..., 1).
        v: Velocities (..., joints).
    """

    path: JointStates
    ds: FloatArray
    dds: FloatArray
    v: FloatArray

    def of(
        self, constraint: Constraint, rows: Rows, within: tuple[FloatArray, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of b and a in the rows of a constraint, and its values at rest, each (..., rows).

        Viscous friction grows with sqrt(b), which is at most (b / p + p) / 2. The pace p is 1, or less if otherwise the
        values at rest would be beyond the limits.

        Args:
            constraint: The constraint.
            rows: Its rows at the points.
            within: The middle (..., rows) of the limits, and their distance (..., rows) from there; None: any.
        """
        by_u, by_x, rest = (part.reshape(*self.ds.shape[:-1], -1) for part in rows)
        by_b, friction = by_x * self.ds**2 + by_u * self.dds, self.path.robot.friction
        if friction is not None and constraint in OF_FRICTION:
            constant, linear = friction.along(self.v, by_b.shape[-1])
            rest, pace = rest + constant, np.ones(1)
            if within is not None:
                room = within[1] - np.abs(rest - within[0])
                pace = np.clip(room / np.maximum(np.abs(linear), LEAST_FRICTION), SLOWEST_PACE, 1.0)
            by_b, rest = by_b + linear / (2.0 * pace), rest + 0.5 * pace * linear
        return by_b, by_u * self.ds, rest
