"""The least effort within the limits, found by nonlinear programming."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from planner.backends.along_curve import DURATION_TOLERANCE, stretched
from planner.backends.assembly import TimedPieces, assemble
from planner.backends.base import ALL_HARD, Guarantee, enforced
from planner.backends.effort_cost import Cost, Objective, use_of_rates, use_of_samples
from planner.backends.effort_program import Numbers, program_of
from planner.backends.effort_terms import Layout
from planner.backends.run_laws import time_run
from planner.backends.splines import interpolating_spline
from planner.errors import InfeasibleDuration, InvalidProblem, JointPositionLimit, MissingDynamics
from planner.polynomials import PiecewisePolynomial
from planner.trajectory import Remark

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run
    from planner.trajectory import Trajectory

FEWEST_INTERVALS = 8
"""Intervals of the spline on a segment that is passed without stopping: fewer leave it little freedom."""

SAMPLED_MARGIN = 1.002
"""Torques and tool speeds between samples of the answer may be higher by this."""

FIRST_MARGIN, MOST_REPAIRS = 1.003, 5
"""The same for the solver, which sees only the breakpoints; where it does not do, the excess is added to it."""

COARSE = 1.05
"""An excess between the breakpoints above this asks for twice as many."""


@dataclass(frozen=True)
class MinimumEffort:
    """The joint motion that minimises the integral of the sum of (torque / limit)^2, or another cost.

    Each joint is a cubic B-spline in time (`effort_program`), from rest to rest with no acceleration at either end,
    through the waypoints; between them the geometry is free, and so are the times at which they are passed, where
    none are asked. The quintic of the same duration is where the search begins, and the answer if nothing better
    within the limits is found: the effort is never above the quintic's.

    A motion without an asked duration takes as long as the quintic, times `slowdown`: the choice of a back end is then
    no choice of a duration, and what one saves can be read off. With `time_weight` the duration is found, too: it
    minimises cost + `time_weight` x duration.

    Efforts are measured by the robot's own torque limits, whatever limits are asked; a joint without a limit counts
    like the strongest one, and 1 N m (N) if no joint has one.

    Attributes:
        objective: `effort`: s; `mechanical_work`: of all joints' |torque x velocity|, by the largest power of any
            joint, s; `jerk`: of the sum of (jerk / limit)^2, s.
        knots: Intervals of the spline from stop to stop; at least 8 on each segment.
        slowdown: Of motions without an asked duration, against the shortest quintic.
        time_weight: Cost of a second; None: durations are not traded against the cost.
        time_limit: s, after which the best motion found is returned, with the warning `suboptimal`.
    """

    kind: ClassVar[str] = "min_effort"
    summary: ClassVar[str] = "The least torque within all limits, from rest to rest through the waypoints, C2."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD

    objective: Objective = field(
        default="effort",
        metadata={
            "description": "What is minimised: the integral of the squared torques by their limits, of the joints' "
            "mechanical power, or of the squared jerk."
        },
    )
    knots: int = field(
        default=50,
        metadata={
            "description": "Intervals of the spline from one stop to the next; at least 8 on each segment.",
            "ge": 8,
            "le": 200,
        },
    )
    slowdown: float = field(
        default=1.0,
        metadata={
            "description": "A motion without an asked duration takes this many times as long as the shortest quintic.",
            "ge": 1.0,
            "le": 100.0,
        },
    )
    time_weight: float | None = field(
        default=None,
        metadata={
            "description": "Cost of a second, against the objective: then durations that are not asked are found so "
            "that both together are least. Omitted: such a duration is the quintic's.",
            "gt": 0.0,
        },
    )
    time_limit: float | None = field(
        default=None,
        metadata={
            "description": "After this time, s, the best motion found so far is the answer, never worse than the "
            "quintic, with the warning `suboptimal`. Omitted: until the optimum is found.",
            "gt": 0.0,
        },
    )

    def parametrize(self, path: JointPath) -> Trajectory:
        """The motion of least cost of each run.

        Raises:
            MissingDynamics: The robot has neither inertias nor a payload.
            InvalidProblem: A motion of the tool or a blend: there the path is given, and nothing is left to choose.
        """
        if self.objective != "jerk" and not path.robot.has_dynamics:
            raise MissingDynamics(f"{path.robot.id} has no link inertias and carries no payload: its effort is unknown")
        _refuse_given_curves(path)
        stop_at = None if self.time_limit is None else time.monotonic() + self.time_limit
        optima = [_Optimum(self, path, run, stop_at) for run in path.every_run]
        trajectory = assemble(path, [optimum.find() for optimum in optima])
        stopped = [int(optimum.run.first) for optimum in optima if not optimum.converged]
        if not stopped:
            return trajectory
        remark = Remark(
            "suboptimal",
            "the search ended before it reached an optimum: what is returned keeps all limits and costs no more than "
            f"the quintic (segments from {', '.join(map(str, stopped))} on)",
        )
        return replace(trajectory, remarks=(remark,))


def _refuse_given_curves(path: JointPath) -> None:
    message = "min_effort chooses the way between the waypoints itself: it has no motions of the tool and no blends"
    faults = [(f"/waypoints/{segment + 1}/motion", message) for run in path.runs for segment in run.tool_motions]
    faults += [(f"/waypoints/{k}/transition", message) for run in path.runs for k in run.blended]
    if faults:
        raise InvalidProblem(faults)


class _Optimum:
    """The search on one run."""

    def __init__(self, options: MinimumEffort, path: JointPath, run: Run, stop_at: float | None) -> None:
        self.options, self.path, self.stop_at = options, path, stop_at
        self.run = run
        self.enforced = enforced(options)
        self.positions = path.positions[run.first : run.first + len(run.segments) + 1]
        self.limits = path.limits.of(run.segments)
        self.cost = Cost(path.robot, options.objective)
        self.free = np.isnan(path.durations[run.segments])
        self.converged = False

    def find(self) -> TimedPieces:
        """The best motion within the limits.

        Raises:
            InfeasibleDuration: Neither the quintic nor anything found keeps the limits in the asked duration.
        """
        refusal = None
        try:
            first = self._quintic(self.path)
        except InfeasibleDuration as error:
            refusal, first = error, self._too_fast()
        found = self._solve(first)
        candidates = [] if refusal else [first]
        if found is not None:
            candidates.insert(0, found)
            factor = float(found.lengths.sum() / first.lengths.sum())
            if factor > 1.0 and self.free.all():
                candidates.append(stretched(first, factor))
        if refusal and not candidates:
            raise refusal
        return min(candidates, key=self._price)

    def _quintic(self, path: JointPath) -> TimedPieces:
        """What is never to be worse: the quintics through the waypoints, or along the run's curve if they overshoot."""
        try:
            pieces = time_run(path, replace(self.run, is_spline=True), 5, self.enforced)
        except JointPositionLimit:
            pieces = time_run(path, replace(self.run, is_spline=False), 5, self.enforced)
        return stretched(pieces, self.options.slowdown) if self.free.all() else pieces

    def _too_fast(self) -> TimedPieces:
        """The quintic at the asked durations, which breaks limits: a beginning all the same."""
        asked = self.path.durations.copy()
        asked[self.run.segments] = np.nan
        at_leisure = self._quintic(replace(self.path, durations=asked))
        durations = np.where(self.free, self._durations(at_leisure), self.path.durations[self.run.segments])
        return TimedPieces(durations, interpolating_spline(self.positions, durations, 5), self.run.segments)

    def _durations(self, pieces: TimedPieces) -> FloatArray:
        """(segments,), s."""
        return np.array([pieces.lengths[pieces.segments == segment].sum() for segment in self.run.segments])

    def _price(self, pieces: TimedPieces) -> float:
        return self.cost.of(pieces) + (self.options.time_weight or 0.0) * float(pieces.lengths.sum())

    def _solve(self, first: TimedPieces) -> TimedPieces | None:
        """The optimum from a first motion; None: none was found that keeps the limits."""
        segments, weight, limits = len(self.run.segments), self.options.time_weight, self.limits
        tool = np.column_stack([limits.tcp_linear_velocity, limits.tcp_angular_velocity])
        watches_tool = bool(np.isfinite(tool).any())
        intervals = max(-(-self.options.knots // segments), FEWEST_INTERVALS)
        free = self.free if weight is not None or self.free.sum() > 1 else np.zeros_like(self.free)
        durations = self._durations(first)
        numbers = Numbers(
            positions=self.positions,
            lower=limits.lower,
            upper=limits.upper,
            rates=np.array([limits.velocity, limits.acceleration, limits.jerk]),
            watched=limits.torque if self.path.robot.has_dynamics else np.full_like(limits.torque, np.inf),
            units=self.cost.units,
            durations=durations,
            free=free,
            total=float(durations[free].sum()) if weight is None else None,
            time_weight=weight or 0.0,
            cost=self._price(first),
            resting=self.cost.at_rest(self.positions[[0, -1]]),
        )
        begin, margin = PiecewisePolynomial(first.lengths, first.coefficients), FIRST_MARGIN
        for _ in range(MOST_REPAIRS):
            watched = numbers.watched / margin
            if watches_tool:
                watched = np.hstack([watched, (tool / margin) ** 2])
            program = program_of(self.path.robot, Layout(segments, intervals, self.options.objective, watches_tool))
            motion = program.solve(numbers._replace(watched=watched), begin, self.stop_at)
            owners = np.repeat(self.run.segments, intervals)
            pieces, own = TimedPieces(motion.lengths, motion.coefficients, owners), self.path.limits.of(owners)
            if use_of_rates(pieces, own) > 1.0 + DURATION_TOLERANCE:
                return None
            excess = use_of_samples(self.path.robot, pieces, own) * SAMPLED_MARGIN
            if excess <= 1.0:
                self.converged = motion.converged
                return pieces
            if excess > COARSE:
                intervals *= 2
            else:
                margin *= 1.0 + 2.0 * (excess - 1.0)
        return None
