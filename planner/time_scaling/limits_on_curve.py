"""The limits on a curve, as they constrain the retiming of a time scaling along it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.constraints import OF_FRICTION, POWER, TORQUE, TORQUE_AT_SPEED, TOTAL_POWER
from planner.constraints.quantities import Power
from planner.constraints.torque_at_speed import rows_at_speed
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import JERKS, JointStates
from planner.robots.description import LEAST_FRICTION
from planner.time_scaling.compose import ScaledCurve
from planner.time_scaling.linear_limits import GRIDPOINTS, LinearLimits
from planner.time_scaling.refusals import refuse_what_gravity_exceeds
from planner.time_scaling.tool_jerks import jerk_rows
from planner.trajectories.polynomials import horner
from planner.trajectories.sampled_peaks import MOST_TRAVEL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.constraints import Constraint
    from planner.constraints.constraint import Rows
    from planner.limits import SegmentLimits
    from planner.paths import JointPath, SegmentGroup
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

    Side = FloatArray | float
    LimitGroup = tuple[FloatArray, Side, Side, Side, Side, Side]
    """The arrays of `LinearLimits` for some limits, (gridpoints, pieces, limits), or one number for all of them."""

SAMPLES_PER_PIECE = 5
"""Gridpoints for torque and tool speed on each piece of a curve at least."""

SAMPLES_PER_RADIAN = 25
"""Gridpoints in addition for each radian (or m) that the joint travels which travels farthest on the piece."""

FEWER_PER_RADIAN = 10
"""The same on a piece with `MANY_SAMPLES`: sixty in a turn of the joint, up to `MOST_TRAVEL`."""

MANY_SAMPLES = 10_000
"""Number of samples of a piece beyond which there are fewer on a radian, for their memory."""

SLOWEST_PACE = 1e-3
"""Least pace at which viscous friction is linearised, as a multiple of the present one."""


def limits_on(path: JointPath, group: SegmentGroup, *, knows_torques: bool = False) -> LimitsOnCurve:
    """Return the limits on the curve of a segment group."""
    return LimitsOnCurve(path.dynamics.robot_on(group.first), path.limits, group.curve, knows_torques=knows_torques)


class LimitsOnCurve:
    """The limits on a curve, as they constrain the retiming of a time scaling along it.

    Attributes:
        sampled: The limits of torque and tool speed.
    """

    def __init__(
        self, robot: Robot, limits: SegmentLimits, curve: SegmentedPolynomial, *, knows_torques: bool = False
    ) -> None:
        """Prepare the limits.

        Args:
            robot: The robot, with its tool and payload.
            limits: Limits in rows, one for each segment of the curve.
            curve: q(s).
            knows_torques: Whether torques are computed although they are not limited.

        Raises:
            LimitsUnsatisfiable: Gravity exceeds a torque limit.
        """
        self.curve, self.limits = curve, limits
        self.sampled = _Sampled(robot, limits, curve, knows_torques)

    def pieces(self, scaling: PiecewisePolynomial) -> np.ndarray:
        """Return the indices (pieces of the time scaling,) of the pieces of the curve that they are on."""
        return self.curve.locate(horner(scaling.coefficients[:, 0], scaling.lengths / 2.0))[0]

    def points(self, on: np.ndarray, s: FloatArray) -> FloatArray:
        """Return the points of the sampled limits at path positions (..., N) on pieces (N,) of the curve."""
        at: FloatArray = on + np.clip((s - self.curve.breakpoints[on]) / self.curve.lengths[on], 0.0, 1.0) / 2.0
        return at

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
        """Return the limits at the gridpoints of pieces of the time scaling, each (gridpoints, pieces, limits)."""
        s, ds, dds, q, first, second, third = self.rates(scaling)
        on = self.pieces(scaling)
        at, segments = self.points(on, s[..., 0]), self.curve.segments[on]
        own = self.limits.of(segments)
        speeds = self.limits.velocity.used(np.broadcast_to(segments, at.shape), first).max(axis=2)[..., None]
        middle, half = own.acceleration.centred
        speeds = np.maximum(speeds, self.sampled.path_speed_use(at, own)[..., None] * ds)
        speeds = np.maximum(speeds, self.sampled.speed_use(own, q, first)[..., None])
        groups: list[LimitGroup] = [
            (speeds**2, 0.0, 0.0, 0.0, 1.0, 0.0),
            (second / half, first / half, 0.0, -middle / half, 1.0, 0.0),
            (third / own.jerk.upper, 3.0 * second / own.jerk.upper, first / own.jerk.upper, 0.0, 0.0, 1.0),
        ]
        groups += self.sampled.groups_at(own, at, ds, dds, first)
        groups += self.sampled.by_speed_at(own, at, ds, dds, first)
        if self.sampled.jerks:
            groups.append(self.sampled.tool_jerks_at(own, q, first, second, third))
        return groups


class _Sampled:
    """Path dynamics and motions of the tool along a curve, which are no polynomials: interpolated between gridpoints.

    The gridpoints of piece k lie between k and k + 1/2, by the share of its length. So nothing is interpolated between
    pieces, where the second derivative of the curve may jump.

    Attributes:
        speeds: The values of the constraints that follow the path speed alone, at the gridpoints.
        rows: The rows of constraints at the gridpoints; torque has rows also where only its values are needed.
        jerks: The jerks of the tool that are limited.
        by_speed: The limited functions of torques and speeds.
    """

    def __init__(self, robot: Robot, limits: SegmentLimits, curve: SegmentedPolynomial, knows_torques: bool) -> None:
        constraints = [own for own, _ in limits.of(np.unique(curve.segments)).constraints]
        self.by_speed = [own for own in (POWER, TOTAL_POWER, TORQUE_AT_SPEED) if own in constraints]
        if (knows_torques or self.by_speed) and TORQUE not in constraints:
            constraints.append(TORQUE)
        limited = [own for own in constraints if own.is_known(robot)]
        self.robot, self.jerks = robot, [own.name for own in limited if own.name in JERKS]
        self.of_states = [own for own in limited if own.follows_path_speed and own.of_states]
        limited = [own for own in limited if own not in self.of_states]
        self.speeds: dict[Constraint, FloatArray] = {}
        self.rows: dict[Constraint, Rows] = {}
        if not limited:
            return
        travels = np.abs(np.diff(curve.evaluate(curve.breakpoints, [0])[0], axis=0)).max(axis=1)
        fewer = np.maximum(MANY_SAMPLES, FEWER_PER_RADIAN * np.minimum(travels, MOST_TRAVEL))
        counts = 1 + SAMPLES_PER_PIECE + np.minimum(SAMPLES_PER_RADIAN * travels, fewer).astype(int)
        of, shares = np.repeat(np.arange(len(counts)), counts), np.concatenate([np.linspace(0, 1, n) for n in counts])
        self.gridpoints = of + shares / 2.0
        q, dq, ddq = curve.evaluate_on(of, shares * curve.lengths[of])
        states = JointStates(robot, q, dq, ddq)
        self.speeds = {own: own.values(states) for own in limited if own.follows_path_speed}
        self.rows = {own: own.rows(states) for own in limited if own.has_rows}
        if TORQUE in self.rows:
            segments = curve.segments[of]
            middle, half = (values[segments] for values in limits.torque.centred)
            dynamics = SegmentDynamics.unchanged(robot)
            rest = self.rows[TORQUE].rest
            if robot.friction is not None:
                rest = rest + robot.friction.along(dq, rest.shape[1])[0]
            refuse_what_gravity_exceeds(dynamics, segments, rest, middle, half)

    def path_speed_use(self, at: FloatArray, limits: SegmentLimits) -> FloatArray:
        """Return the share of the highest path velocity that s' = 1 is (points, pieces), by the constraints on it."""
        use = np.zeros_like(at)
        for constraint, bounds in limits.constraints:
            for values, limit in zip(self.speeds.get(constraint, np.empty((0, 0))).T, bounds.upper.T, strict=False):
                share = np.interp(at, self.gridpoints, values) / limit
                use = np.maximum(use, share ** (1.0 / constraint.order))
        return use

    def speed_use(self, limits: SegmentLimits, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the shares (points, pieces) of limits that velocities (points, pieces, joints) at positions use."""
        use = np.zeros(q.shape[:2])
        if not self.of_states:
            return use
        states = JointStates(self.robot, *(x.reshape(-1, q.shape[2]) for x in (q, v, v)))
        for constraint, bounds in limits.constraints:
            if constraint in self.of_states:
                shares = constraint.values(states).reshape(*q.shape[:2], -1) / bounds.upper
                use = np.maximum(use, shares.max(axis=2) ** (1.0 / constraint.order))
        return use

    def groups_at(
        self, limits: SegmentLimits, at: FloatArray, ds: FloatArray, dds: FloatArray, v: FloatArray
    ) -> Iterator[LimitGroup]:
        """Yield the parts of `LinearLimits` that each constraint with rows is, each (points, pieces, rows)."""
        for constraint, bounds in limits.constraints:
            if constraint in self.rows:
                repeats = self.rows[constraint].rest.shape[1] // bounds.upper.shape[1]
                middle, half = (np.repeat(side, repeats, axis=1) for side in bounds.centred)
                by_b, by_a, rest = self.values_at(constraint, at, ds, dds, v, (middle, half))
                yield by_b / half, by_a / half, 0.0, (rest - middle) / half, 1.0, 0.0

    def by_speed_at(
        self, limits: SegmentLimits, at: FloatArray, ds: FloatArray, dds: FloatArray, v: FloatArray
    ) -> Iterator[LimitGroup]:
        """Yield the parts of `LinearLimits` that functions of torques and speeds are, each (points, pieces, rows).

        A retiming by b has the torques by_b b + by_a a + rest and the velocities v sqrt(b).
        """
        if not self.by_speed:
            return
        curves = self.robot.torque_curves
        for constraint, bounds in limits.constraints:
            if isinstance(constraint, Power) and constraint in self.by_speed:
                torques = self.values_at(TORQUE, at, ds, dds, v)
                by_b, by_a, rest = (constraint.of(part, v) / bounds.upper for part in torques)
                yield by_b, by_a, 0.0, rest, 0.0, 1.0
            if constraint == TORQUE_AT_SPEED and curves is not None:
                allowed = bounds.upper * curves.at(np.abs(v))
                torques = self.values_at(TORQUE, at, ds, dds, v, (np.zeros_like(allowed), allowed))
                per_b, per_a, held = (part / bounds.upper for part in torques)
                rows = rows_at_speed(curves, per_b, per_a, held, np.abs(v))
                for by_b, by_a, rest, constant in rows:
                    yield by_b, by_a, 0.0, rest, constant, 0.0

    def values_at(
        self,
        constraint: Constraint,
        at: FloatArray,
        ds: FloatArray,
        dds: FloatArray,
        v: FloatArray,
        within: tuple[FloatArray, FloatArray] | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of b and a in the rows of a constraint, and its values at rest, each (..., rows).

        Viscous friction grows with sqrt(b), which is at most (b / p + p) / 2. The pace p is 1, or less if otherwise the
        values at rest would be beyond the limits.

        Args:
            constraint: One with rows.
            at: Points (...) on the curve, see above.
            ds: Path velocities (..., 1).
            dds: Path accelerations (..., 1).
            v: Velocities (..., joints).
            within: The middle (..., rows) of the limits, and their distance (..., rows) from there; None: any.
        """
        after = np.clip(np.searchsorted(self.gridpoints, at), 1, len(self.gridpoints) - 1)
        before = self.gridpoints[after - 1]
        share = ((at - before) / (self.gridpoints[after] - before))[..., None]
        rows = np.hstack(self.rows[constraint])
        by_u, by_x, rest = np.split(rows[after - 1] * (1.0 - share) + rows[after] * share, 3, axis=-1)
        by_b = by_x * ds**2 + by_u * dds
        if self.robot.friction is not None and constraint in OF_FRICTION:
            constant, linear = self.robot.friction.along(v, by_b.shape[-1])
            rest, pace = rest + constant, np.ones(1)
            if within is not None:
                room = within[1] - np.abs(rest - within[0])
                pace = np.clip(room / np.maximum(np.abs(linear), LEAST_FRICTION), SLOWEST_PACE, 1.0)
            by_b, rest = by_b + linear / (2.0 * pace), rest + 0.5 * pace * linear
        return by_b, by_u * ds, rest

    def tool_jerks_at(
        self, limits: SegmentLimits, q: FloatArray, first: FloatArray, second: FloatArray, third: FloatArray
    ) -> LimitGroup:
        """Return the parts of `LinearLimits` that jerks of the tool are, each (points, pieces, rows).

        Args:
            limits: Of each piece.
            q: Positions (points, pieces, joints).
            first: Velocities (points, pieces, joints) of the time scaling.
            second: Its accelerations.
            third: Its jerks.
        """
        *shape, joints = first.shape
        rows = jerk_rows(self.robot, self.jerks, *(values.reshape(-1, joints) for values in (q, first, second, third)))
        bound = np.stack([limits.of_tool[quantity] for quantity in rows.quantities], axis=-1)
        by_b, by_a, by_c = (part.reshape(*shape, -1) / bound for part in rows[:3])
        return by_b, by_a, by_c, 0.0, 0.0, 1.0
