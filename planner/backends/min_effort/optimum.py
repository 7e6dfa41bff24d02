"""The motion of least cost on one run: where its curve is given, and where only its waypoints are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.jerk_limited.retiming import MOST_STEPS
from planner.backends.jerk_limited.time_law import fastest_law
from planner.backends.min_effort.cost import Cost, use_of_rates
from planner.backends.min_effort.on_curve import Search
from planner.backends.min_effort.program import Numbers, program_of
from planner.backends.min_effort.terms import Layout
from planner.backends.shared.sampled_limits import SampledLimits
from planner.backends.shared.time_laws import follow_curve
from planner.backends.shared.time_scaling import scaled_to_duration, slowest, time_scalings
from planner.backends.splines.interpolation import interpolating_spline
from planner.backends.splines.run_timing import time_run
from planner.errors import InfeasibleDuration, JointPositionLimit
from planner.guarantees import QUANTITIES
from planner.kinematics.forward import jacobian
from planner.polynomials import PiecewisePolynomial, SegmentedPolynomial
from planner.tolerances import DURATION_TOLERANCE
from planner.tool_motions.ways import CHORDS, farthest_from_way

if TYPE_CHECKING:
    from planner.backends.min_effort.options import MinEffortOptions
    from planner.paths import JointPath, Run
    from planner.spatial import FloatArray

FEWEST_INTERVALS = 8
"""Intervals of the spline on a segment that is passed without stopping: fewer leave it little freedom."""

FIRST_MARGIN = 1.003
"""Factor by which limits of torque and tool speed are narrowed at first, for what lies between instants."""

MOST_REPAIRS = 8
"""Number of solutions with wider margins, at most, until the limits are kept between the instants, too."""

REPAIR = 1.5
"""Multiple of the excess on a piece that is added to its margin."""

NEAR = 0.5
"""Share of the excess on a neighbouring piece that counts on a piece, to which that excess would move."""

LEAST_REPAIR = 2e-3
"""Least amount that is added to the margin of a piece with an excess."""

COARSE = 1.05
"""Use of a limit between the breakpoints above which the spline gets twice as many intervals."""

FINE = 32
"""Number of intervals from which on the spline gets no more of them."""

NO_CHOICE = 1.01
"""Up to this multiple of the shortest duration along a curve, the fastest law is the only one there is, nearly."""

MOST_WORK = 24_000
"""Intervals times iterations of the search from stop to stop: with six joints 7 s on one core, and most need less."""

WORK_OF_TOOL = 2
"""How many times as long an iteration takes where the tool's speed is limited, too."""

ROOM = np.inf
"""How far the coefficients of the spline may be from those of the first motion, rad or m, to begin with."""

MOST_SEARCHES = 6
"""Number of searches, at most, with rooms in which the tool stays near enough, or goes too far."""

CLOSE = 0.8
"""Share of the deviation allowed from which on no larger room is looked for."""

AIM = 0.9
"""Share of the deviation allowed that a smaller room aims at."""

WITHIN = 0.99
"""Share of the deviation allowed that the search may use, since what is found is known to half a percent."""

SHARES = 257
"""Number of instants at which two motions are compared."""

HOPELESS = 30
"""Number of iterations within which a search that begins outside the limits is to come within them: of 70 random ones
in half to nearly all of the quintic's time, all that there were had been found after 16."""

REPAIRS_SHARE = 2
"""One in so many of the iterations that are left is for one search; the others are for repairs after it."""


def _work(intervals: int, watches_tool: bool) -> int:
    """What one iteration takes, as a number of intervals."""
    return intervals * (WORK_OF_TOOL if watches_tool else 1)


class Optimum(ABC):
    """The search on one run.

    Attributes:
        converged: Whether an optimum was found.
    """

    def __init__(self, options: MinEffortOptions, path: JointPath, run: Run) -> None:
        self.options, self.path = options, path
        self.run, self.robot = run, path.dynamics.robot_on(run.first)
        self.enforced = frozenset(QUANTITIES)
        self.cost = Cost(self.robot, options.objective)
        self.asked = path.durations[run.segments]
        self.free = np.isnan(self.asked)
        self.converged = False

    @abstractmethod
    def find(self) -> SegmentedPolynomial:
        """The best motion within the limits.

        Raises:
            InfeasibleDuration: Nothing found keeps the limits in the asked duration.
            LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
        """

    def price(self, pieces: SegmentedPolynomial) -> float:
        """The cost and the weighted time of a motion, which are to be least."""
        return self.cost.of(pieces) + (self.options.time_weight or 0.0) * float(pieces.lengths.sum())

    def durations(self, pieces: SegmentedPolynomial) -> FloatArray:
        """The durations (segments,), s, of the segments of a motion."""
        return np.array([pieces.lengths[pieces.segments == segment].sum() for segment in self.run.segments])


class OnCurve(Optimum):
    """The search along the curve of a run: lines, circles, blends.

    The cost is never above that of the fastest law within the jerk limits, stretched to the same duration, nor above
    the quintic's; where durations are asked of segments that are passed without stopping, only not above the quintic's.
    """

    def find(self) -> SegmentedPolynomial:
        """The best motion within the limits."""
        law = fastest_law(self.path, self.run)
        known, refusal = self._known(law)
        found = self._search(law, self.durations(known[0]) if known else self.asked)
        if found is not None:
            return min([*known, found], key=self.price)
        if refusal and not known:
            raise refusal
        needed = slowest(time_scalings(self.path, known[0], self.enforced).values()).factor
        self.converged = needed > 1.0 / NO_CHOICE
        return min(known, key=self.price)

    def _known(self, law: SegmentedPolynomial) -> tuple[list[SegmentedPolynomial], InfeasibleDuration | None]:
        """Find motions within the limits without a search, the fastest law first, and the quintic's refusal if any.

        Raises:
            InfeasibleDuration: What is asked is too short.
        """
        known: list[SegmentedPolynomial] = []
        refusal = None
        try:
            known.append(time_run(self.path, self.run, 5, self.enforced))
        except InfeasibleDuration as error:
            refusal = error
        if self.free.all():
            known[0] = known[0].stretched(self.options.slowdown)
        if self.free.all() or len(self.asked) == 1:
            pieces = follow_curve(self.run, law)
            fastest = scaled_to_duration(self.path, self.run, float(self.asked[0]), pieces, self.enforced)
            if self.free.all() and self.options.time_weight is None:
                fastest = fastest.stretched(max(float(known[0].lengths.sum() / fastest.lengths.sum()), 1.0))
            known.insert(0, fastest)
        elif refusal and self.free.any():
            raise refusal
        return known, refusal

    def _search(self, law: PiecewisePolynomial, durations: FloatArray) -> SegmentedPolynomial | None:
        """The optimum; None: none was found that keeps the limits.

        Args:
            law: The law that the search begins with, in any time.
            durations: (segments,), s: those asked; those that are not asked are met together, unless time has a weight.
        """
        if self.options.iterations == 0:
            return None
        weight = self.options.time_weight
        parts = np.eye(len(durations), dtype=bool)[~self.free]
        if self.free.any() and weight is None:
            parts = np.vstack([parts, self.free])
        knots = max(self.options.knots, FEWEST_INTERVALS * len(durations))
        law = law.stretched(float(durations.sum() / law.lengths.sum()))
        steps = min(self.options.iterations or MOST_STEPS, MOST_STEPS)
        search = Search(self.path, self.run, self.cost, weight or 0.0, parts, parts @ durations, knots, steps)
        margin = FIRST_MARGIN
        for _ in range(MOST_REPAIRS):
            found = search.improved(law, margin)
            if found is None:
                return None
            pieces = follow_curve(self.run, found.law)
            factor = slowest(time_scalings(self.path, pieces, self.enforced).values()).factor
            if not len(parts):
                pieces, factor = pieces.stretched(max(factor, 1.0)), 1.0
            if factor <= 1.0 + DURATION_TOLERANCE:
                self.converged = found.converged
                return pieces
            law, margin = found.law, margin * min(factor**3, COARSE)
        return None


class ThroughWaypoints(Optimum):
    """The search through waypoints between which the path is free: never worse than the quintic of that duration.

    Attributes:
        left: The intervals times iterations that all searches together may still take; None: there was none yet.
        begins_outside: Whether the search begins with a motion that breaks limits.
    """

    def __init__(self, options: MinEffortOptions, path: JointPath, run: Run) -> None:
        super().__init__(options, path, run)
        self.positions = path.positions_of(run)
        self.limits = path.limits.of(run.segments)
        self.left: int | None = None
        self.begins_outside = False

    def find(self) -> SegmentedPolynomial:
        """The best motion within the limits."""
        refusal = None
        try:
            first = self._quintic(self.path)
        except InfeasibleDuration as error:
            refusal, first, self.begins_outside = error, self._too_fast(), True
        found = self._found(first)
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
        """The motion to be improved: the quintics through the waypoints, or along the run's curve if they overshoot."""
        try:
            pieces = time_run(path, replace(self.run, is_spline=True), 5, self.enforced)
        except JointPositionLimit:
            pieces = time_run(path, replace(self.run, is_spline=False), 5, self.enforced)
        return pieces.stretched(self.options.slowdown) if self.free.all() else pieces

    def _too_fast(self) -> SegmentedPolynomial:
        """The quintic at the asked durations, which breaks limits: a beginning all the same."""
        asked = self.path.durations.copy()
        asked[self.run.segments] = np.nan
        at_leisure = self._quintic(replace(self.path, durations=asked))
        durations = np.where(self.free, self.durations(at_leisure), self.path.durations[self.run.segments])
        return interpolating_spline(self.positions, durations, 5).of_segments(self.run.segments)

    def _found(self, first: SegmentedPolynomial) -> SegmentedPolynomial | None:
        """The optimum from a first motion within the deviation that is allowed; None: none was found.

        Where the best way is too far away, the spline is kept near the first motion: its coefficients have as much room
        as makes the tool go as far as it may.
        """
        found, most = self._solve(first), self.options.max_deviation
        if most is None:
            return found
        if found is None or (deviation := self._deviation(first, found)) <= WITHIN * most:
            return found
        near: SegmentedPolynomial | None = None
        far = self._apart(first, found), deviation
        room = AIM * most / self._reach_of_joints(first)
        enough = room, 0.0
        for _ in range(MOST_SEARCHES):
            found = self._solve(first, room)
            deviation = 0.0 if found is None else self._deviation(first, found)
            if deviation > WITHIN * most:
                far = room, deviation
            else:
                near, enough = found or near, (room, deviation)
                if deviation >= CLOSE * most:
                    break
            share = np.log(AIM * most / far[1]) / np.log(enough[1] / far[1]) if enough[1] > 0.0 else 0.5
            room = far[0] * (enough[0] / far[0]) ** share
        return near

    def _reach_of_joints(self, first: SegmentedPolynomial) -> float:
        """The way of the tool, m, by that of all joints at once, rad or m, at most: the sum of the levers' lengths."""
        (positions,) = first.evaluate(np.linspace(0.0, first.breakpoints[-1], SHARES), [0])
        columns = np.array([jacobian(self.robot, position)[:3] for position in positions])
        return float(np.linalg.norm(columns, axis=1).sum(axis=1).max())

    def _deviation(self, first: SegmentedPolynomial, other: SegmentedPolynomial) -> float:
        """The largest distance of the tool, m, in one motion from its way in the first, segment by segment."""
        worst = 0.0
        for segment in self.run.segments.tolist():
            known, own = (motion.of(motion.segments == segment) for motion in (first, other))
            (way,) = known.evaluate(np.linspace(0.0, known.breakpoints[-1], CHORDS + 1), [0])
            worst = max(worst, farthest_from_way(self.robot, own, 0.0, float(own.breakpoints[-1]), way)[0])
        return worst

    def _apart(self, first: SegmentedPolynomial, other: SegmentedPolynomial) -> float:
        """The largest distance of a joint, rad or m, between two motions at equal shares of their times."""
        shares = np.linspace(0.0, 1.0, SHARES)
        a, b = (motion.evaluate(shares * motion.breakpoints[-1], [0])[0] for motion in (first, other))
        return float(np.abs(a - b).max())

    def _solve(self, first: SegmentedPolynomial, room: float = ROOM) -> SegmentedPolynomial | None:
        """The optimum from a first motion, or near it; None: none was found that keeps the limits.

        Args:
            first: The motion that the search begins with.
            room: How far the coefficients of the spline may be from its own, rad or m.
        """
        segments, weight, limits = len(self.run.segments), self.options.time_weight, self.limits
        tool = np.column_stack([limits.tcp_linear_velocity, limits.tcp_angular_velocity])
        watches_tool = bool(np.isfinite(tool).any())
        intervals = max(-(-self.options.knots // segments), FEWEST_INTERVALS)
        free = self.free if weight is not None or self.free.sum() > 1 else np.zeros_like(self.free)
        durations = self.durations(first)
        torque = limits.torque if self.robot.has_dynamics else np.full_like(limits.torque, np.inf)
        numbers = Numbers(
            positions=self.positions,
            lower=limits.lower,
            upper=limits.upper,
            near=PiecewisePolynomial(first.lengths, first.coefficients),
            room=room,
            rates=np.array([limits.velocity, limits.acceleration, limits.jerk]),
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
        begin, multipliers = PiecewisePolynomial(first.lengths, first.coefficients), None
        margins = np.full((segments * intervals, 1), FIRST_MARGIN)
        work = _work(segments * intervals, watches_tool)
        if self.left is None:
            self.left = MOST_WORK if self.options.iterations is None else self.options.iterations * work
        for _ in range(MOST_REPAIRS):
            if self.left <= 0:
                return None
            rows = np.repeat(np.arange(segments), intervals)
            program = program_of(self.robot, Layout(segments, intervals, self.options.objective, watches_tool))
            work = _work(len(rows), watches_tool)
            narrowed = numbers._replace(torque=torque[rows] / margins, tool=(tool[rows] / margins) ** 2)
            most = -(-self.left // (REPAIRS_SHARE * work))
            fruitless = HOPELESS if self.begins_outside else most
            motion = program.solve(narrowed, begin, most, fruitless, multipliers)
            if motion is None:
                return None
            self.left -= motion.iterations * work
            own = self.run.segments[rows]
            pieces = SegmentedPolynomial(motion.lengths, motion.coefficients, own)
            if use_of_rates(pieces, self.path.limits.of(own)) > 1.0 + DURATION_TOLERANCE:
                return None
            use = self._use(pieces)
            if (use <= 1.0).all():
                self.converged = motion.converged
                return pieces
            if use.max() > COARSE and len(rows) < FINE:
                intervals, margins, multipliers = 2 * intervals, np.repeat(margins, 2, axis=0), None
            else:
                excess = np.maximum(use - 1.0, 0.0)
                excess = np.max([excess, NEAR * np.append(excess[1:], 0.0), NEAR * np.append(0.0, excess[:-1])], axis=0)
                margins = margins * (1.0 + REPAIR * excess + LEAST_REPAIR * (excess > 0.0))[:, None]
                begin, multipliers = PiecewisePolynomial(motion.lengths, motion.coefficients), motion.multipliers
        return None

    def _use(self, pieces: SegmentedPolynomial) -> FloatArray:
        """The largest share (pieces,) of a limit of torque or tool speed that each piece uses."""
        limits = SampledLimits(self.path.dynamics, self.path.limits)
        if not limits.limited[pieces.segments].any():
            return np.zeros(len(pieces.lengths))
        return limits.use(pieces, pieces.segments)
