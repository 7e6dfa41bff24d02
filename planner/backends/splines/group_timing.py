"""Splines for the timing of a segment group: in time through its waypoints, or a time scaling s(t) on its curve."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from planner.backends.splines.given_velocities import NothingLimits, PassingSpline, VelocityOutOfReach, timed_spline
from planner.backends.splines.interpolation import Degree, interpolating_spline
from planner.backends.splines.shortest_durations import Evaluation, shortest_durations
from planner.backends.splines.spline_limits import DurationsTooShort, PositionOvershoot
from planner.errors import (
    InfeasibleDuration,
    InvalidProblem,
    JointPositionLimit,
    LimitsUnsatisfiable,
    PlanningError,
    Remedy,
)
from planner.fields import FieldPath
from planner.guarantees import JOINT_DERIVATIVES
from planner.paths import JointPath, SegmentGroup
from planner.paths.segment_groups import passing_error
from planner.spatial import FloatArray
from planner.time_scaling.compose import ScaledCurve, ToolSpeeds, follow_curve, split_at_knots
from planner.time_scaling.refusals import BindingLimit, infeasible_duration_error, no_duration_error
from planner.time_scaling.uniform import TimeScaling, time_scalings
from planner.tolerances import DURATION_TOLERANCE, NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import SegmentedPolynomial, horner

UNITS = np.linspace(0.0, 1.0, 24)
"""Unit times at which the search samples a time scaling on each interval; the final shape is then checked exactly."""

PACE_SHARES = np.linspace(0.0, 1.0, 9)
"""Shares, tried in turn, by which free intervals adopt the pace of slow ones until the time scaling ascends."""

LEAST_FACTOR = 1e-9
"""Factor on the time of an unlimited interval, almost zero."""

BACKWARDS = 1e-9
"""Backward speed along the curve, relative to the mean speed, that counts as rounding of the coefficients."""

MOST_OPEN_LENGTHENINGS = 30
"""Largest number of times that segments without a requested duration are lengthened beside segments with one."""

LONGEST = 1e6
"""Multiple of the first durations beyond which free durations are not lengthened, so that the search ends."""

UNHURRIED = 1.0005
"""Factor on top of the required lengthening, so that few repetitions suffice."""


def time_group(path: JointPath, group: SegmentGroup, degree: Degree, enforced: frozenset[str]) -> SegmentedPolynomial:
    """Fit a spline in time through the waypoints of joint motions, and a time scaling s(t) along any other curve.

    Raises:
        InfeasibleDuration: A requested duration is shorter than its limits allow, or every time scaling with it runs
            backwards.
        JointPositionLimit: A spline leaves the position limits between waypoints.
        LimitsUnsatisfiable: Nothing limits the durations, gravity exceeds a torque limit, or no motion was found that
            passes a waypoint with the velocity requested.
    """
    passes = not path.passed_at.keys().isdisjoint(group.segments.tolist())
    timing = _CurveTiming if not group.is_spline else _PassingTiming if passes else _SplineTiming
    return timing(path, group, degree, enforced).time()


class _Timing(ABC):
    """The timing of a segment group: distributes time over its intervals until all limits are kept.

    Attributes:
        segments: Index (intervals,) of the segment that each interval belongs to.
    """

    segments: np.ndarray
    may_stretch = True
    """Whether a common factor on all durations slows the motion without changing its path."""
    longest = LONGEST
    """Multiple of the first durations up to which free durations are lengthened."""

    def __init__(self, path: JointPath, group: SegmentGroup, degree: Degree, enforced: frozenset[str]) -> None:
        self.path, self.group, self.degree, self.enforced = path, group, degree, enforced

    @property
    def requested(self) -> FloatArray:
        """The duration (intervals,), s, requested of the segment of each interval; NaN: as fast as the limits allow."""
        requested: FloatArray = self.path.durations[self.segments]
        return requested

    def time(self) -> SegmentedPolynomial:
        """Time the group so that it keeps the limits."""
        durations, free = self.first_durations(), np.isnan(self.requested)
        longest = self.longest * durations.sum()
        needed: dict[int, TimeScaling] = {}
        for _ in range(MOST_OPEN_LENGTHENINGS):
            pieces = self.pieces(durations)
            try:
                needed = time_scalings(self.path, pieces, self.enforced)
            except InvalidProblem:  # beside a duration that is too short a longer one makes the spline swing too far
                if not needed:
                    raise
                break
            if self.may_stretch and free.all():
                factor = max(scaling.factor for scaling in needed.values())
                if factor <= 0.0:
                    raise no_duration_error(self.group.first)
                return pieces.stretched(factor)
            excess = np.array([needed[segment].factor for segment in self.segments])
            if (excess <= 1.0 + DURATION_TOLERANCE).all():
                return pieces
            if not (free & (excess > 1.0)).any():
                break
            durations = np.where(free, durations * np.maximum(excess, 1.0) * UNHURRIED, durations)
            if durations.sum() > longest:
                break
        raise self._infeasible_error(needed)

    @abstractmethod
    def first_durations(self) -> FloatArray:
        """Return durations (intervals,), s: the requested ones, and nearly the shortest for the other intervals."""

    @abstractmethod
    def pieces(self, durations: FloatArray) -> SegmentedPolynomial:
        """Return the motion for durations (intervals,), s."""

    def _infeasible_error(self, needed: dict[int, TimeScaling]) -> PlanningError:
        """Return the error that names the segment which needs the largest factor on its time."""
        worst = max(needed, key=lambda segment: needed[segment].factor)
        return self.too_short_error(needed[worst], worst)

    def too_short_error(self, needed: TimeScaling, segment: int) -> InfeasibleDuration:
        """Return the error for requested durations that must be longer by a factor."""
        requested = self.path.durations
        given = [k for k in self.group.segments.tolist() if not np.isnan(requested[k])]
        given.sort(key=lambda k: k != segment)
        longer = {k: float(requested[k] * needed.factor * (1.0 + DURATION_TOLERANCE)) for k in given}
        return infeasible_duration_error(float(requested[given[0]]), longer, needed.binding)


class _SplineTiming(_Timing):
    """The timing of joint motions through waypoints; the spline sets the path between them."""

    def __init__(self, path: JointPath, group: SegmentGroup, degree: Degree, enforced: frozenset[str]) -> None:
        super().__init__(path, group, degree, enforced)
        self.segments = group.segments
        self.positions = path.positions_of(group)

    def first_durations(self) -> FloatArray:
        """Return the durations of the shortest spline that is found."""
        limits = self.path.limits.of(self.segments)
        try:
            return timed_spline(self.positions, limits, self.requested, self.degree).lengths
        except NothingLimits:
            raise no_duration_error(self.group.first) from None
        except DurationsTooShort as short:
            name = self.path.robot.joint_names[short.joint]
            segment = int(self.segments[short.segment])
            needed = TimeScaling(short.factor, BindingLimit(short.quantity, name))
            raise self.too_short_error(needed, segment) from None
        except PositionOvershoot as overshoot:
            name = self.path.robot.joint_names[overshoot.joint]
            segment = int(self.segments[overshoot.segment])
            ends = [k for k in (segment, segment + 1) if self.group.first < k <= self.group.segments[-1]]
            raise passing_error(ends, segment, name, overshoot.value, overshoot.limit) from None

    def pieces(self, durations: FloatArray) -> SegmentedPolynomial:
        """Return the spline with these durations: one polynomial a segment."""
        return interpolating_spline(self.positions, durations, self.degree).of_segments(self.segments)


class _PassingTiming(_SplineTiming):
    """The timing of joint motions through waypoints, some of them with requested passing velocities."""

    may_stretch = False
    longest = 100.0  # what a velocity itself exceeds no time mends, and the swings before it grow

    def __init__(self, path: JointPath, group: SegmentGroup, degree: Degree, enforced: frozenset[str]) -> None:
        super().__init__(path, group, degree, enforced)
        suiting = np.full(path.robot.dof, np.nan)
        velocities = np.array([path.passed_at.get(segment, suiting) for segment in group.segments[1:].tolist()])
        self.spline = PassingSpline(self.positions, velocities, path.limits.of(group.segments), degree)

    def first_durations(self) -> FloatArray:
        """Return the durations of the shortest spline that is found."""
        try:
            return self.spline.durations(self.requested)
        except DurationsTooShort as short:
            binding = BindingLimit(short.quantity, self.path.robot.joint_names[short.joint])
            worst, changed = (
                short.segment,
                np.flatnonzero(short.durations > self.requested * (1.0 + DURATION_TOLERANCE)),
            )
            # Where no requested duration has to grow, those that are free do: the worst of them has to be given.
            changed = changed[np.argsort(changed != worst, kind="stable")] if len(changed) else np.array([worst])
            longer = dict(zip(self.segments[changed].tolist(), short.durations[changed].tolist(), strict=True))
            had = (
                short.durations[worst] / short.factor
                if np.isnan(self.requested[changed[0]])
                else self.requested[changed[0]]
            )
            raise infeasible_duration_error(float(had), longer, binding) from None
        except VelocityOutOfReach as out_of_reach:
            raise self._out_of_reach_error(out_of_reach) from None

    def pieces(self, durations: FloatArray) -> SegmentedPolynomial:
        """Return the spline with these durations: one polynomial a segment."""
        motion = self.spline.held(durations)
        try:
            motion.refuse_overshoot()
        except PositionOvershoot as over:
            broken = VelocityOutOfReach(over.segment, over.joint, "position", over.value, over.limit)
            raise self._out_of_reach_error(broken) from None
        return motion.spline.curve.of_segments(self.segments)

    def _out_of_reach_error(self, broken: VelocityOutOfReach) -> PlanningError:
        """Return the error that names the limit with the smallest excess."""
        name, segment = self.path.robot.joint_names[broken.joint], int(self.segments[broken.segment])
        value, limit = broken.value, broken.limit
        if broken.quantity != "position":
            return self._unsatisfiable_error(segment, BindingLimit(broken.quantity, name), value, limit)
        waypoints, remedies = self._passed_around(segment)
        message = f"passing {waypoints} with the requested velocity would move {name} beyond its limit {limit:.6g}"
        return JointPositionLimit(message, segment=segment, joint=name, value=value, limit=limit, remedies=remedies)

    def _infeasible_error(self, needed: dict[int, TimeScaling]) -> PlanningError:
        """Return the error where a torque or tool limit needs more time, but more time does not help."""
        worst = max(needed, key=lambda segment: needed[segment].factor)
        return self._unsatisfiable_error(worst, needed[worst].binding)

    def _unsatisfiable_error(
        self, segment: int, binding: BindingLimit, value: float | None = None, limit: float | None = None
    ) -> LimitsUnsatisfiable:
        waypoints, remedies = self._passed_around(segment)
        return LimitsUnsatisfiable(
            f"no motion through {waypoints} with the requested velocity was found within {binding.named} on segment "
            "{segment}",
            segment=segment,
            joint=binding.joint,
            value=value,
            limit=limit,
            remedies=remedies,
        )

    def _passed_around(self, segment: int) -> tuple[str, list[Remedy]]:
        """Name the waypoints with velocities before and after a segment, and offer other velocities and durations."""
        part = self.segments[self.spline.parts == self.spline.parts[self.segments == segment]]
        after = self.group.segments[self.group.segments > part[-1]][:1].tolist()
        waypoints = [k for k in (int(part[0]), *after) if k in self.path.passed_at]
        fields: list[FieldPath] = [("waypoints", k, "transition", "velocity") for k in waypoints]
        remedies = [Remedy(field, None, "one that suits the motion") for field in fields]
        given = part[~np.isnan(self.path.durations[part])].tolist()
        remedies += [Remedy(("waypoints", k + 1, "duration"), None, "as fast as the limits allow") for k in given]
        return " and ".join(f"waypoint {k}" for k in waypoints), remedies


class _CurveTiming(_Timing):
    """The timing along a curve: a time scaling spline s(t) through waypoints and ends of blends.

    The time is distributed over the intervals between these knots so that each uses its limits as fully as possible.
    The search begins with a single time scaling over the whole group, which is such a spline, too.
    """

    def __init__(self, path: JointPath, group: SegmentGroup, degree: Degree, enforced: frozenset[str]) -> None:
        super().__init__(path, group, degree, enforced)
        self.knots = group.curve.breakpoints[group.knots]
        self.segments = group.curve.segments[group.knots[:-1]]
        self.tool_speeds = ToolSpeeds(path, group)
        kept = [(order, name) for order, name in enumerate(JOINT_DERIVATIVES) if order and name in enforced]
        self.limits = {order: path.limits.bounds(name).of(self.segments[:, None]) for order, name in kept}

    def first_durations(self) -> FloatArray:
        """Return the durations of the best time scaling found.

        The intervals of a segment divide its requested duration in proportion.
        """
        free = np.isnan(self.requested)
        single = self._single.lengths
        shape = self._shortest(single, np.full(len(free), np.nan))
        shape = shape if self._ascends(shape) else single
        if free.all():
            return shape
        shares = shape / np.array([shape[self.segments == segment].sum() for segment in self.segments])
        requested = shares * self.requested
        quick = self._shortest(shape, requested)
        # A spline swings back where a quick interval meets a slow one: free intervals then adopt the requested pace.
        slow = np.where(free, shape * np.nanmax(requested / shape), requested)
        paces = (quick ** (1.0 - share) * slow**share for share in PACE_SHARES)
        return next((durations for durations in paces if self._ascends(durations)), slow)

    def pieces(self, durations: FloatArray) -> SegmentedPolynomial:
        """Return the motion along the curve under the time scaling with these durations, in quintics."""
        if self._ascends(durations):
            return follow_curve(self.group, self._scaling(durations))
        if np.isnan(self.requested).all():
            return follow_curve(self.group, self._single)
        raise self._runs_backwards_error()

    def _shortest(self, start: FloatArray, requested: FloatArray) -> FloatArray:
        """Search from `start` for the shortest durations (intervals,), s; requested durations stay."""
        return shortest_durations(self._evaluate, start, requested)[0]

    def _evaluate(self, durations: FloatArray) -> Evaluation:
        """Evaluate the time scaling at all samples; near these durations only at the most limiting samples."""
        factors = self._samples(durations, UNITS)[0]
        peaks = UNITS[factors.argmax(axis=1)][:, None]
        return Evaluation(factors.max(axis=1), lambda near: self._samples(near, peaks)[0][:, 0])

    def _ascends(self, durations: FloatArray) -> bool:
        """Return whether the time scaling with these durations never decreases."""
        slowest, mean = self._samples(durations, UNITS)[1], self.knots[-1] / durations.sum()
        return bool(slowest >= -BACKWARDS * mean)

    @cached_property
    def _single(self) -> SegmentedPolynomial:
        """The time scaling polynomial of the whole group, rest to rest in 1 s, cut at the ends of the intervals."""
        ends = np.array([[0.0], [self.knots[-1]]])
        return split_at_knots(interpolating_spline(ends, np.ones(1), self.degree), self.knots[1:-1], self.segments)

    def _scaling(self, durations: FloatArray) -> SegmentedPolynomial:
        """Return the time scaling s(t) with these durations (intervals,), s."""
        return interpolating_spline(self.knots[:, None], durations, self.degree).of_segments(self.segments)

    def _samples(self, durations: FloatArray, units: FloatArray) -> tuple[FloatArray, float]:
        """Sample the factors (intervals, samples) on time that the limits need, and the least path velocity.

        Args:
            durations: Durations (intervals,), s, of the time scaling.
            units: Unit times (samples,) or (intervals, samples) of the samples.
        """
        scaling, curve = self._scaling(durations), self.group.curve
        t = units * durations[:, None]
        s = horner(scaling.coefficients, t)
        starts, ends = self.knots[:-1, None], self.knots[1:, None]
        margin = NEGLIGIBLE_SHARE * (ends - starts)  # at its ends an interval's own derivatives count
        within = np.clip(s, starts + margin, ends - margin)
        on = curve.locate(within)[0]
        _, ds, _, *rates = ScaledCurve(curve, scaling).derivatives(np.arange(len(t))[:, None], on, t, 3)
        factors = np.maximum(self.tool_speeds.shares_at(within) * np.abs(ds[..., 0]), LEAST_FACTOR)
        for order, limits in self.limits.items():
            factors = np.maximum(factors, limits.shares(rates[order]).max(axis=2) ** (1.0 / order))
        return factors, float(ds.min())

    def _runs_backwards_error(self) -> InfeasibleDuration:
        """Return the error for requested durations for which every time scaling decreases somewhere."""
        given = np.unique(self.segments[~np.isnan(self.requested)])
        segment = int(given[0])
        return InfeasibleDuration(
            "with the requested durations around segment {segment} the arm would have to reverse on its path",
            waypoint=segment + 1,
            segment=segment,
            value=float(self.path.durations[segment]),
            remedies=[
                Remedy(("waypoints", k + 1, "duration"), None, "as fast as the limits allow") for k in given.tolist()
            ],
        )
