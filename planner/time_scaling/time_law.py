"""The fastest time scaling along a curve that keeps every limit, of jerk, too."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.constraints import TORQUE
from planner.guarantees import QUANTITIES
from planner.kinematics.forward import JERKS, JointStates
from planner.time_scaling.compose import ScaledCurve, follow_curve, split_at_knots
from planner.time_scaling.linear_limits import GRIDPOINTS, LinearLimits, QuadraticSpline
from planner.time_scaling.refusals import duration_of_run, refuse_what_gravity_exceeds
from planner.time_scaling.retiming import fastest_retiming
from planner.time_scaling.tool_jerks import jerk_rows
from planner.time_scaling.uniform import scaled_to_duration
from planner.trajectories.polynomials import (
    PiecewisePolynomial,
    SegmentedPolynomial,
    horner,
    quintic_hermite,
)
from planner.trajectories.sampled_peaks import MOST_TRAVEL

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.constraints import Constraint
    from planner.constraints.constraint import Rows
    from planner.limits import SegmentLimits
    from planner.paths import JointPath, Run
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.time_scaling.retiming import AskedDurations

ROUNDS = ((50, 5, 3e-2), (31, 24, 3e-3), (250, 0, 1e-3))
"""Rounds of the search: the number of pieces of the law, those of each segment in addition, and the relative gap to the
optimum that may be left. The last is for short lists: without it five blended lines took up to 2 % longer."""

NEAR = 0.5
"""Share of a limit that a law uses at most where the limit is left out of the next round."""

MOST_REFINEMENTS = 10
"""Rounds after these, while a limit is exceeded by more than it may be."""

ENOUGH = 1.003
"""Share of a limit that the law may use between the points that a round looks at: one factor on all times mends it."""

ENOUGH_OF_DENSE = 1.05
"""The same along a curve of more pieces than the rounds ask for, as through the noise of 2,000 points: one factor on
all times costs up to 1.6 %, and each further round takes seconds."""

DENSE_PARTS = 4
"""Number of pieces of the law on each piece of such a curve: with 2 or 3 it is slower by 2 and 1 %."""

REFINED = 1.001
"""Share of a limit from which on a piece that uses it is cut in two."""

COARSE = 1.05
"""Share of a limit from which on a piece is cut in four: the jerk may end long before such a piece does."""

IDLE = 0.9
"""Share of every limit below which a piece waits for a finer grid: it is cut in two, too."""

MOST_IDLE = 0.03
"""Share of the duration that idle pieces may fill: for more of them alone, one round is made."""

FINEST = 400
"""Number of its like in the duration from which on an idle piece stays whole: little time can be gained on it."""

GAUSS_POINTS = 5
"""Number of Gauss points on each piece of a law, to integrate the time that it takes after retiming."""

GAUSS_RULE = (np.polynomial.legendre.leggauss(GAUSS_POINTS) + np.array([[1.0], [0.0]])) / 2.0
"""These points, as shares of a piece, and their weights."""

SAMPLES_PER_PIECE = 5
"""Gridpoints for torque and tool speed on each piece of a curve at least."""

SAMPLES_PER_RADIAN = 25
"""Gridpoints in addition for each radian (or m) that the joint travels which travels farthest on the piece."""

FEWER_PER_RADIAN = 10
"""The same on a piece with `MANY_SAMPLES`: sixty in a turn of the joint, up to `MOST_TRAVEL`."""

MANY_SAMPLES = 10_000
"""Number of samples of a piece beyond which there are fewer on a radian, for their memory."""

ENFORCED = frozenset(QUANTITIES)
"""The quantities whose limits the law keeps: all there are."""


def time_run(path: JointPath, run: Run) -> SegmentedPolynomial:
    """Return the fastest law s(t) along the run's curve that keeps every limit, jerk included; C2, from rest to rest.

    The search begins with one quintic over the whole run. Each round splits its longest pieces and retimes it: where it
    may be faster, and by how much, is a smooth function of time even at the ends, where path velocity over path
    position has a singularity. What is left between the gridpoints of the search, one exact factor on all times sets
    right.

    Raises:
        InvalidProblem: A duration is asked of a segment that is not alone in its run.
        InfeasibleDuration: The asked duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    asked = duration_of_run(path, run)
    return scaled_to_duration(path, run, asked, follow_curve(run, fastest_law(path, run)), ENFORCED)


def fastest_law(path: JointPath, run: Run) -> SegmentedPolynomial:
    """Find the law, but for what is left between the gridpoints of the search.

    Raises:
        LimitsUnsatisfiable: Gravity exceeds a torque limit.
    """
    law, limits = _quintic(run), limits_on(path, run)
    if not np.isfinite(limits.along(law).scale(np.array([[1.0], [0.0], [0.0]]))):
        return limits.on_segments(law)  # nothing limits: any law will do
    counts = [count + each * len(run.segments) for count, each, _ in ROUNDS]
    is_dense = len(law.lengths) > max(counts)
    if is_dense:  # a law that has nothing to do with its limits would be cut everywhere, time and again
        law = retimed(law, fastest_retiming(law.lengths, limits.along(law), ROUNDS[0][2]))
        law = law.split(np.full(len(law.lengths), DENSE_PARTS))
        law = retimed(law, fastest_retiming(law.lengths, near_limits(limits.along(law)), ROUNDS[1][2]))
    for number, ((_, _, gap), wanted) in enumerate(zip(ROUNDS, counts, strict=True)):
        if wanted < len(law.lengths):
            continue
        law = law.split(np.ceil(law.lengths / law.lengths.sum() * wanted).astype(int))
        within = limits.along(law)
        law = retimed(law, fastest_retiming(law.lengths, near_limits(within) if number else within, gap))
    enough, gap = (ENOUGH_OF_DENSE, ROUNDS[1][2]) if is_dense else (ENOUGH, ROUNDS[-1][2])
    return limits.on_segments(refined(limits, law, gap, enough))


def refined(
    limits: LimitsOnCurve,
    law: PiecewisePolynomial,
    gap: float,
    enough: float = ENOUGH,
    requested: Callable[[PiecewisePolynomial], AskedDurations | None] = lambda _: None,
) -> PiecewisePolynomial:
    """Refine a time scaling that is near to the fastest, until it keeps its limits between gridpoints, too.

    Args:
        limits: The limits.
        law: The time scaling.
        gap: Relative gap to the optimum that may be left.
        enough: Share of a limit that may be used between gridpoints.
        requested: The requested durations of parts of a time scaling; None: none.
    """
    best, shortest = law, np.inf
    for refinement in range(MOST_REFINEMENTS + 1):
        most, least = limits.used(law)
        stretched = float(law.lengths.sum() * max(1.0, most.max()) ** 0.5)
        best, shortest = (law, stretched) if stretched < shortest else (best, shortest)
        idle = (least < IDLE) & (law.lengths > law.lengths.sum() / FINEST)
        is_done = most.max() < enough and (refinement or law.lengths[idle].sum() < MOST_IDLE * law.lengths.sum())
        if is_done or refinement == MOST_REFINEMENTS:
            break
        law = law.split(np.where(most > COARSE, 4, np.where((most > REFINED) | idle, 2, 1)))
        law = retimed(law, fastest_retiming(law.lengths, near_limits(limits.along(law)), gap, requested(law)))
    return best


def near_limits(limits: LinearLimits) -> LinearLimits:
    """Return the limits that a nearly fastest time scaling uses to a good part; all, if there are none.

    Whether the others are kept is looked at after each round. With requested durations it may be slow everywhere.
    """
    near = limits.used().max(axis=1) > NEAR
    return limits.of(near) if near.any() else limits


def _quintic(run: Run) -> PiecewisePolynomial:
    """Return the law from rest to rest in 1 s that is one quintic, with a breakpoint where the curve has one."""
    knots = run.curve.breakpoints
    inner = knots[1:-1]
    whole = PiecewisePolynomial(np.ones(1), knots[-1] * np.array([[[0.0, 0.0, 0.0, 10.0, -15.0, 6.0]]]))
    law = split_at_knots(whole, inner, np.zeros(len(inner) + 1, dtype=int))
    law.coefficients[1:, 0, 0] = inner
    return law


def retimed_lengths(law: PiecewisePolynomial, unknowns: FloatArray) -> FloatArray:
    """Return the durations (pieces,), s, of the pieces of a law after retiming."""
    b = QuadraticSpline(law.lengths).states(unknowns)[0].reshape(len(GRIDPOINTS), -1)
    u, weights = GAUSS_RULE[0, :, None], GAUSS_RULE[1]
    inside = b[0] * (1.0 - u) ** 2 + 2.0 * u * (1.0 - u) * unknowns[1:-1] + b[-1] * u**2
    lengths: FloatArray = weights @ (1.0 / np.sqrt(inside)) * law.lengths
    return lengths


def retimed(law: PiecewisePolynomial, unknowns: FloatArray) -> PiecewisePolynomial:
    """Return the law after retiming: quintics between its nodes, whose speed and acceleration are exact there."""
    b, a, _ = QuadraticSpline(law.lengths).states(unknowns).reshape(3, len(GRIDPOINTS), -1)
    lengths = retimed_lengths(law, unknowns)
    b, a = np.append(b[0], b[-1, -1]), np.append(a[0], a[-1, -1])
    s, speed, gain = law.evaluate(law.breakpoints, range(3))
    speed, gain = speed * np.sqrt(b)[:, None], gain * b[:, None] + speed * a[:, None]
    starts, ends = (s[:-1], speed[:-1], gain[:-1]), (s[1:], speed[1:], gain[1:])
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))


def limits_on(path: JointPath, run: Run, *, knows_torques: bool = False) -> LimitsOnCurve:
    """Return the limits on the curve of a run."""
    return LimitsOnCurve(path.dynamics.robot_on(run.first), path.limits, run.curve, knows_torques=knows_torques)


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

    def pieces(self, law: PiecewisePolynomial) -> np.ndarray:
        """Return the indices (pieces of the law,) of the pieces of the curve that they are on."""
        return self.curve.locate(horner(law.coefficients[:, 0], law.lengths / 2.0))[0]

    def points(self, on: np.ndarray, s: FloatArray) -> FloatArray:
        """Return the points of the sampled limits at path positions (..., N) on pieces (N,) of the curve."""
        at: FloatArray = on + np.clip((s - self.curve.breakpoints[on]) / self.curve.lengths[on], 0.0, 1.0) / 2.0
        return at

    def on_segments(self, law: PiecewisePolynomial) -> SegmentedPolynomial:
        """Mark each piece of the law with the segment that it is on."""
        return law.of_segments(self.curve.segments[self.pieces(law)])

    def used(self, law: PiecewisePolynomial) -> tuple[FloatArray, FloatArray]:
        """Return the largest and the least share (pieces,) of its limits that the law uses on each piece."""
        halves = self.along(law.split(np.full(len(law.lengths), 2)))
        used = halves.used().max(axis=0).reshape(len(GRIDPOINTS), -1, 2)
        return used.max(axis=(0, 2)), used.min(axis=(0, 2))

    def rates(self, law: PiecewisePolynomial) -> list[FloatArray]:
        """Return `ScaledCurve.derivatives` up to jerks at the gridpoints (gridpoints, pieces, ...) of all pieces."""
        on, t = self.pieces(law), GRIDPOINTS[:, None] * law.lengths
        return ScaledCurve(self.curve, law).derivatives(np.arange(len(on)), on, t, 3)

    def along(self, law: PiecewisePolynomial) -> LinearLimits:
        """Linearise all limits at the gridpoints of the law's pieces, each divided by the limit itself."""
        s, ds, dds, q, first, second, third = self.rates(law)
        on = self.pieces(law)
        at, segments = self.points(on, s[..., 0]), self.curve.segments[on]
        own = self.limits.of(segments)
        speeds = self.limits.velocity.used(np.broadcast_to(segments, at.shape), first).max(axis=2)[..., None]
        middle, half = own.acceleration.centred
        speeds = np.maximum(speeds, self.sampled.path_speed_use(at, own)[..., None] * ds)
        speeds = np.maximum(speeds, self.sampled.speed_use(own, q, first)[..., None])
        groups: list[tuple[FloatArray | float, ...]] = [
            (speeds**2, 0.0, 0.0, 0.0, 1.0, 0.0),
            (second / half, first / half, 0.0, -middle / half, 1.0, 0.0),
            (*(rate / own.jerk.upper for rate in (third, 3.0 * second, first)), 0.0, 0.0, 1.0),
        ]
        groups += self.sampled.groups_at(own, at, ds, dds)
        if self.sampled.jerks:
            groups.append(self.sampled.tool_jerks_at(own, q, first, second, third))
        ends = np.cumsum([0, *(np.shape(group[0])[-1] for group in groups)])
        parts = np.empty((6, ends[-1], *at.shape))
        for group, begin, end in zip(groups, ends, ends[1:], strict=False):
            for rows, values in zip(parts, group, strict=True):
                rows[begin:end] = np.broadcast_to(values, (*at.shape, end - begin)).transpose(2, 0, 1)
        return LinearLimits(*parts.reshape(6, ends[-1], -1))


class _Sampled:
    """Path dynamics and motions of the tool along a curve, which are no polynomials: interpolated between gridpoints.

    The gridpoints of piece k lie between k and k + 1/2, by the share of its length. So nothing is interpolated between
    pieces, where the second derivative of the curve may jump.

    Attributes:
        speeds: The values of the constraints that follow the path speed alone, at the gridpoints.
        rows: The rows of constraints at the gridpoints; torque has rows also where only its values are needed.
        jerks: The jerks of the tool that are limited.
    """

    def __init__(self, robot: Robot, limits: SegmentLimits, curve: SegmentedPolynomial, knows_torques: bool) -> None:
        constraints = [own for own, _ in limits.of(np.unique(curve.segments)).constraints]
        if knows_torques and TORQUE not in constraints:
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
            refuse_what_gravity_exceeds(robot, segments, self.rows[TORQUE].rest, middle, half)

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
        self, limits: SegmentLimits, at: FloatArray, ds: FloatArray, dds: FloatArray
    ) -> Iterator[tuple[FloatArray | float, ...]]:
        """Yield the parts of `LinearLimits` that each constraint with rows is, each (points, pieces, rows)."""
        for constraint, bounds in limits.constraints:
            if constraint in self.rows:
                by_b, by_a, rest = self.values_at(constraint, at, ds, dds)
                middle, half = (np.repeat(side, by_b.shape[-1] // side.shape[1], axis=1) for side in bounds.centred)
                yield by_b / half, by_a / half, 0.0, (rest - middle) / half, 1.0, 0.0

    def values_at(
        self, constraint: Constraint, at: FloatArray, ds: FloatArray, dds: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of b and a in the rows of a constraint, and its values at rest, each (..., rows).

        Args:
            constraint: One with rows.
            at: Points (...) on the curve, see above.
            ds: Path velocities (..., 1).
            dds: Path accelerations (..., 1).
        """
        by_u, by_x, rest = (
            np.stack([np.interp(at, self.gridpoints, row) for row in part.T], axis=-1) for part in self.rows[constraint]
        )
        return by_x * ds**2 + by_u * dds, by_u * ds, rest

    def tool_jerks_at(
        self, limits: SegmentLimits, q: FloatArray, first: FloatArray, second: FloatArray, third: FloatArray
    ) -> tuple[FloatArray | float, ...]:
        """Return the parts of `LinearLimits` that jerks of the tool are, each (points, pieces, rows).

        Args:
            limits: Of each piece.
            q: Positions (points, pieces, joints).
            first: Velocities (points, pieces, joints) of the law.
            second: Its accelerations.
            third: Its jerks.
        """
        *shape, joints = first.shape
        rows = jerk_rows(self.robot, self.jerks, *(values.reshape(-1, joints) for values in (q, first, second, third)))
        bound = np.stack([limits.of_tool[quantity] for quantity in rows.quantities], axis=-1)
        by_b, by_a, by_c = (part.reshape(*shape, -1) / bound for part in rows[:3])
        return by_b, by_a, by_c, 0.0, 0.0, 1.0
