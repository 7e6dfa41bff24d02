"""The motion of least cost on one group: where its curve is given, and where only its waypoints are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from planner.backends.min_effort.cost import Cost, use_of_rates
from planner.backends.min_effort.numbers import Layout, Numbers
from planner.backends.min_effort.on_curve import Search
from planner.backends.min_effort.options import MinEffortOptions
from planner.backends.min_effort.reference_path import ReferencePath
from planner.backends.splines.group_timing import time_group
from planner.backends.splines.interpolation import interpolating_spline
from planner.constraints import VELOCITY_AT_POSITION, Bounds
from planner.errors import InfeasibleDuration, JointPositionLimit
from planner.guarantees import QUANTITIES, TCP_ORDERS
from planner.kinematics.forward import VELOCITIES
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.time_scaling.compose import follow_curve
from planner.time_scaling.fastest import fastest_scaling
from planner.time_scaling.retiming import MOST_RETIMING_STEPS
from planner.time_scaling.sampled_limits import SampledLimits
from planner.time_scaling.uniform import scaled_to_duration, slowest, time_scalings
from planner.tolerances import DURATION_TOLERANCE, ROUNDING
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

LEAST_SPLINE_INTERVALS = 8
"""Intervals of the spline on a segment that is passed without stopping; fewer restrict it too much."""

MOST_TURN = 2.0
"""Travel of a turning joint on an interval, rad, up to which there is a search for the path.

Torques are computed at the ends of intervals and can change sign within a turn. Joints with at most two turns travel
less.
"""

FIRST_MARGIN = 1.003
"""Factor by which limits of torque and tool speed are narrowed at first, for excesses between instants."""

MOST_MARGIN_REPAIRS = 8
"""Number of solutions with wider margins, at most, until the limits are kept between the instants, too."""

REPAIR = 1.5
"""Multiple of the excess on a piece that is added to its margin."""

MOVED_SHARE = 0.5
"""Share of the excess on a neighbouring piece that counts on a piece, to which that excess would move."""

LEAST_REPAIR = 2e-3
"""Least amount that is added to the margin of a piece with an excess."""

REFINING_EXCESS = 1.05
"""Use of a limit between the breakpoints above which the spline gets twice as many intervals."""

FINE = 32
"""Number of intervals above which the spline gets no more of them."""

NO_CHOICE = 1.01
"""Multiple of the shortest duration along a curve up to which the fastest time scaling is almost the only one."""

MOST_WORK = 24_000
"""Intervals times iterations of the search from stop to stop: with six joints 7 s on one core, and most need less."""

WORK_OF_TOOL = 1.0
"""Additional time of an iteration with limits of the tool's speed, as a share."""

WORK_OF_PATH = 0.5
"""Additional time of an iteration with a limited deviation from a path, as a share."""

WORK_OF_HALF_SPACE = 0.07
"""Additional time of an iteration for each half-space at an instant, as a share."""

DEVIATION_EXCESS = 1.002
"""Factor by which the deviation allowed is narrowed beyond its excess."""

HOPELESS = 30
"""Number of iterations within which a search that starts outside the limits has to reach them.

Of 70 random searches, with half to nearly all of the quintic's duration, every success came within 16 iterations.
"""

REPAIRS_SHARE = 2
"""One in so many of the iterations that are left is for one search; the others are for repairs after it."""


def _work(layout: Layout) -> int:
    """Return the work of one iteration, as a number of intervals."""
    more = WORK_OF_TOOL * layout.watches_tool + WORK_OF_PATH * bool(layout.path_instants)
    return round(layout.segments * layout.intervals * (1.0 + more + WORK_OF_HALF_SPACE * layout.half_spaces))


class Optimum(ABC):
    """The search on one group.

    Attributes:
        converged: Whether an optimum was found.
        cost: The cost to minimise, known once there is a first motion.
    """

    cost: Cost

    def __init__(self, options: MinEffortOptions, path: JointPath, group: SegmentGroup) -> None:
        self.options, self.path = options, path
        self.group, self.robot = group, path.dynamics.robot_on(group.first)
        self.enforced = frozenset(QUANTITIES)
        self.requested = path.durations[group.segments]
        self.free = np.isnan(self.requested)
        self.converged = False

    @abstractmethod
    def find(self) -> SegmentedPolynomial:
        """Return the best motion within the limits.

        Raises:
            InfeasibleDuration: Nothing found keeps the limits in the requested duration.
            LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
        """

    def turn(self, positions: FloatArray) -> FloatArray:
        """Return the distances (N - 1, turning joints), rad, between consecutive positions (N, joints)."""
        return np.abs(np.diff(positions, axis=0))[:, self.robot.is_angle]

    def price(self, pieces: SegmentedPolynomial) -> float:
        """Return the cost and the weighted time of a motion, which are to be least."""
        return self.cost.of(pieces) + (self.options.time_weight or 0.0) * float(pieces.lengths.sum())

    def costs_nothing(self, pieces: SegmentedPolynomial) -> bool:
        """Return whether the cost of a motion is rounding, because everything that moves has no weight.

        A slow motion has as little jerk, but never none.
        """
        seconds = 0.0 if self.options.objective == "jerk" else float(pieces.lengths.sum())
        return self.price(pieces) <= ROUNDING**2 * seconds

    def durations(self, pieces: SegmentedPolynomial) -> FloatArray:
        """Return the durations (segments,), s, of the segments of a motion."""
        return np.array([pieces.lengths[pieces.segments == segment].sum() for segment in self.group.segments])


class OnCurve(Optimum):
    """The search along the curve of a segment group: lines, circles, blends.

    The cost is never above the quintic's. It is never above that of the fastest jerk-limited time scaling either,
    stretched to the same duration, unless segments passed without stopping have requested durations.
    """

    def find(self) -> SegmentedPolynomial:
        """Return the best motion within the limits."""
        scaling = fastest_scaling(self.path, self.group)
        known, refusal = self._known(scaling)
        first = known[0] if known else follow_curve(self.group, scaling)
        self.cost = Cost(self.robot, self.options.objective, first)
        nothing = self.costs_nothing(first)
        found = None if nothing else self._search(scaling, self.durations(known[0]) if known else self.requested)
        if found is not None:
            return min([*known, found], key=self.price)
        if refusal and not known:
            raise refusal
        needed = slowest(time_scalings(self.path, known[0], self.enforced).values()).factor
        self.converged = nothing or needed > 1.0 / NO_CHOICE
        return min(known, key=self.price)

    def _known(self, scaling: SegmentedPolynomial) -> tuple[list[SegmentedPolynomial], InfeasibleDuration | None]:
        """Return the known motions within the limits, the fastest time scaling first, and the refusal of the quintic.

        Raises:
            InfeasibleDuration: The requested duration is too short.
        """
        known: list[SegmentedPolynomial] = []
        refusal = None
        try:
            known.append(time_group(self.path, self.group, 5, self.enforced))
        except InfeasibleDuration as error:
            refusal = error
        if self.free.all():
            known[0] = known[0].stretched(self.options.slowdown)
        if self.free.all() or len(self.requested) == 1:
            pieces = follow_curve(self.group, scaling)
            fastest = scaled_to_duration(self.path, self.group, float(self.requested[0]), pieces, self.enforced)
            if self.free.all() and self.options.time_weight is None:
                fastest = fastest.stretched(max(float(known[0].lengths.sum() / fastest.lengths.sum()), 1.0))
            known.insert(0, fastest)
        elif refusal and self.free.any():
            raise refusal
        return known, refusal

    def _search(self, scaling: PiecewisePolynomial, durations: FloatArray) -> SegmentedPolynomial | None:
        """Return the optimum; None: none was found that keeps the limits.

        Args:
            scaling: The time scaling that the search begins with, in any time.
            durations: (segments,), s. The requested ones are kept; so is the sum of the others, unless time has a
                weight.
        """
        if self.options.iterations == 0:
            return None
        weight = self.options.time_weight
        parts = np.eye(len(durations), dtype=bool)[~self.free]
        if self.free.any() and weight is None:
            parts = np.vstack([parts, self.free])
        knots = max(self.options.knots_for(float(durations.sum())), LEAST_SPLINE_INTERVALS * len(durations))
        (positions,) = self.group.curve.evaluate(self.group.curve.breakpoints, [0])
        if self.turn(positions).sum(axis=0).max(initial=0.0) > MOST_TURN * knots:
            return None
        scaling = scaling.stretched(float(durations.sum() / scaling.lengths.sum()))
        steps = min(self.options.iterations or MOST_RETIMING_STEPS, MOST_RETIMING_STEPS)
        search = Search(self.path, self.group, self.cost, weight or 0.0, parts, parts @ durations, knots, steps)
        margin = FIRST_MARGIN
        for _ in range(MOST_MARGIN_REPAIRS):
            found = search.improved(scaling, margin)
            if found is None:
                return None
            pieces = follow_curve(self.group, found.scaling)
            factor = slowest(time_scalings(self.path, pieces, self.enforced).values()).factor
            if not len(parts):
                pieces, factor = pieces.stretched(max(factor, 1.0)), 1.0
            if factor <= 1.0 + DURATION_TOLERANCE:
                self.converged = found.converged
                return pieces
            scaling, margin = found.scaling, margin * min(factor**3, REFINING_EXCESS)
        return None


class ThroughWaypoints(Optimum):
    """The search through waypoints between which the path is free: never worse than the quintic of that duration.

    Attributes:
        begins_outside: Whether the search begins with a motion that breaks limits.
    """

    def __init__(self, options: MinEffortOptions, path: JointPath, group: SegmentGroup) -> None:
        super().__init__(options, path, group)
        self.positions = path.positions_of(group)
        self.limits = path.limits.of(group.segments)
        self.begins_outside = False

    def find(self) -> SegmentedPolynomial:
        """Return the best motion within the limits."""
        refusal = None
        try:
            first = self._quintic(self.path)
        except InfeasibleDuration as error:
            refusal, first, self.begins_outside = error, self._too_fast(), True
        self.cost = Cost(self.robot, self.options.objective, first)
        nothing = self.costs_nothing(first)
        found = None if nothing else self._solve(first)
        self.converged |= nothing
        candidates = [] if refusal else [first]
        if found is not None:
            candidates.insert(0, found)
            factor = float(found.lengths.sum() / first.lengths.sum())
            if factor > 1.0 and self.free.all():
                candidates.append(first.stretched(factor))
        if refusal and not candidates:
            raise refusal
        return min(candidates, key=self.price)

    def _quintic(self, path: JointPath) -> SegmentedPolynomial:
        """Return the motion to improve: quintics through the waypoints, or along the curve if they overshoot."""
        try:
            pieces = time_group(path, replace(self.group, is_spline=True), 5, self.enforced)
        except JointPositionLimit:
            pieces = time_group(path, replace(self.group, is_spline=False), 5, self.enforced)
        return pieces.stretched(self.options.slowdown) if self.free.all() else pieces

    def _too_fast(self) -> SegmentedPolynomial:
        """Return the quintic in the requested durations, which may break limits; the search starts there."""
        requested = self.path.durations.copy()
        requested[self.group.segments] = np.nan
        at_leisure = self._quintic(replace(self.path, durations=requested))
        durations = np.where(self.free, self.durations(at_leisure), self.path.durations[self.group.segments])
        return interpolating_spline(self.positions, durations, 5).of_segments(self.group.segments)

    def _solve(self, first: SegmentedPolynomial) -> SegmentedPolynomial | None:
        """Return the optimum from a first motion, near its way; None: none was found that keeps the limits."""
        from planner.backends.min_effort.program import program_of  # here: it loads CasADi

        segments, weight, limits = len(self.group.segments), self.options.time_weight, self.limits
        if limits.further.keys() - {VELOCITY_AT_POSITION} or any(
            TCP_ORDERS[quantity] > 1 for quantity in limits.of_tool
        ):
            return None  # the program knows no accelerations of the tool, and no further quantities
        intervals = max(-(-self.options.knots_for(float(first.lengths.sum())) // segments), LEAST_SPLINE_INTERVALS)
        if self.turn(self.positions).max(initial=0.0) > MOST_TURN * intervals:
            return None  # between its instants torques would come and go unseen
        tool = np.hstack([limits.magnitudes(quantity) for quantity in VELOCITIES])
        watches_tool, reference = bool(np.isfinite(tool).any()), ReferencePath.of(self.robot, first, self.options)
        free = self.free if weight is not None or self.free.sum() > 1 else np.zeros_like(self.free)
        durations = self.durations(first)
        torque = np.abs(limits.torque if self.robot.has_dynamics else limits.without(["torque"]).torque)
        numbers = Numbers(
            positions=self.positions,
            lower=limits.position.lower,
            upper=limits.position.upper,
            reference=reference,
            near=np.empty(0),
            half_spaces=np.empty(0),
            rates=np.abs([self._velocities(first), limits.acceleration, limits.jerk]),
            torque=torque,
            tool=tool,
            units=self.cost.units,
            durations=durations,
            free=free,
            total=float(durations[free].sum()) if weight is None else None,
            time_weight=weight or 0.0,
            cost=self.price(first),
            resting=self.cost.at_rest(self.positions[[0, -1]]),
        )
        holds = self.options.max_deviation is not None, self.options.max_joint_deviation is not None
        begin, again = PiecewisePolynomial(first.lengths, first.coefficients), None
        velocity, fastest = numbers.rates[0], np.ones((segments, 1))
        margins, nearer = np.full((segments * intervals, 1), FIRST_MARGIN), FIRST_MARGIN
        cuts = 0 if self.path.half_spaces is None else self.path.half_spaces.rows
        objective, adds_jerk = self.options.objective, self.cost.adds_jerk
        layout = Layout(segments, intervals, objective, watches_tool, *holds, cuts, adds_jerk)
        left = MOST_WORK if self.options.iterations is None else self.options.iterations * _work(layout)
        for _ in range(MOST_MARGIN_REPAIRS):
            if left <= 0:
                return None
            rows = np.repeat(np.arange(segments), layout.intervals)
            program, work = program_of(self.robot, layout), _work(layout)
            narrowed = numbers._replace(
                rates=np.concatenate([velocity[None] / fastest, numbers.rates[1:]]),
                torque=torque[:, rows] / margins,
                tool=(tool[rows] / margins) ** 2,
                near=np.empty(0) if reference is None else reference.limits(nearer),
                half_spaces=self._half_spaces(layout),
            )
            most = -(-left // (REPAIRS_SHARE * work))
            fruitless = HOPELESS if self.begins_outside else most
            motion = program.solve(narrowed, begin, most, fruitless, again)
            if motion is None:
                return None
            left -= motion.iterations * work
            own = self.group.segments[rows]
            pieces = SegmentedPolynomial(motion.lengths, motion.coefficients, own)
            if use_of_rates(pieces, self.path.limits.of(own)) > 1.0 + DURATION_TOLERANCE:
                return None
            use, away = self._use(pieces), 0.0 if reference is None else reference.use(pieces)
            if max(away, use.max()) <= 1.0:
                self.converged = motion.converged
                return pieces
            if max(away, use.max()) > REFINING_EXCESS and len(rows) < FINE:
                layout, again = layout._replace(intervals=2 * layout.intervals), None
                margins = np.repeat(margins, 2, axis=0)
            else:
                excess = np.maximum(use - 1.0, 0.0)
                if VELOCITY_AT_POSITION in limits.further:
                    fastest = fastest * (
                        1.0 + np.maximum.reduceat(excess, np.searchsorted(rows, range(segments)))[:, None]
                    )
                from_next, from_last = np.append(excess[1:], 0.0), np.append(0.0, excess[:-1])
                excess = np.max([excess, MOVED_SHARE * from_next, MOVED_SHARE * from_last], axis=0)
                margins = margins * (1.0 + REPAIR * excess + LEAST_REPAIR * (excess > 0.0))[:, None]
                nearer, again = nearer * max(DEVIATION_EXCESS * away, 1.0), motion
        return None

    def _velocities(self, first: SegmentedPolynomial) -> Bounds:
        """Return the velocity limits (segments, joints), within the least of the velocity curves on each segment.

        A first motion within its limits remains within these. Whether the optimum keeps the curves is found out of it.
        """
        own, conditions = self.limits.velocity, self.robot.velocity_conditions
        if conditions is None:
            return own
        ends = np.stack([self.positions[:-1], self.positions[1:]])
        scale = self.limits.further[VELOCITY_AT_POSITION][:, None]
        speeds = Bounds(
            -conditions.allowed(ends.min(axis=0))[1] * scale, conditions.allowed(ends.max(axis=0))[0] * scale
        )
        of, bounds = first.segments - first.segments[0], derivatives_on_unit_time(first, 2).bernstein[1]
        fastest = np.zeros((2, *own.upper.shape))
        np.maximum.at(fastest[0], of, -bounds.min(axis=2))
        np.maximum.at(fastest[1], of, bounds.max(axis=2))
        return own.within(Bounds(np.minimum(speeds.lower, -fastest[0]), np.maximum(speeds.upper, fastest[1])))

    def _half_spaces(self, layout: Layout) -> FloatArray:
        """Return the normals and offsets (rows (joints + 1), dense instants) of the half-spaces at the instants."""
        if self.path.half_spaces is None:
            return np.empty(0)
        segments, shares = layout.dense_shares
        normals, offsets = self.path.half_spaces.at(self.group.segments[segments], shares)
        return np.concatenate([normals, offsets[..., None]], axis=2).reshape(len(shares), -1).T

    def _use(self, pieces: SegmentedPolynomial) -> FloatArray:
        """Return the largest share (pieces,) of a limit of torque or tool speed that each piece uses."""
        limits = SampledLimits(self.path.dynamics, self.path.limits)
        if not limits.limited[pieces.segments].any():
            return np.zeros(len(pieces.lengths))
        return limits.use(pieces, pieces.segments)
