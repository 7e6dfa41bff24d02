"""Attempts at a plan, each one run from a problem to a certified trajectory, and the one loop that makes them.

Generators propose attempts and see the outcome of each before they propose the next. They compose by `yield from`, and
share one budget, whatever they vary.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from math import inf
from time import monotonic
from typing import NamedTuple, TypeVar

import numpy as np

from planner.backends.base import BackEnd
from planner.errors import InfeasibleDuration, LimitsUnsatisfiable, PlanningError
from planner.free_motion.detours import Detour, find_detours, with_detours
from planner.free_motion.fixed import with_fixed
from planner.free_motion.objectives import value_of
from planner.paths import JointPath, solve_path
from planner.plans.result import Plan, certified, timed
from planner.problems.blend_radii import with_blend_radii
from planner.problems.check import check_problem
from planner.problems.motion_around import Objective
from planner.problems.problem import PlanningProblem
from planner.spatial import FloatArray
from planner.timing.arrivals import refuse_late_arrivals, with_longer_segments, with_waits
from planner.timing.durations import slowed_to
from planner.timing.shaping import shaped
from planner.tolerances import ROUNDING
from planner.trajectories.trajectory import PlanWarning, Trajectory

T = TypeVar("T")
"""The type of a generator's final result."""


MOST_LONGER = 6
"""The most trials of longer segments, until all windows of passed waypoints are met."""

SHAPED_STRETCHES = (1.005, 1.01, 1.02, 1.04, 1.08)
"""Factors on the durations of motions that break a limit slightly once they are shaped. The first that helps counts."""

SLIGHT_EXCESS = 1.1
"""The largest ratio of a value to its limit for which shaped motions are stretched instead of refused."""


class Progress(NamedTuple):
    """The state of a planning after an attempt.

    Attributes:
        attempts: The number of attempts so far: the request itself, its variants, the proofs of remedies and the
            improvements of a plan.
        seconds: The time since the planning began, s.
        plan: The last certified plan; None: no attempt has led to one. It may be of a remedy.

    Examples:
        >>> import planner
        >>> arm, seen = planner.load_robot("ur5e"), list[planner.Progress]()
        >>> problem = planner.PlanningProblem(arm, [[0.0] * 6, [0.1] * 6])
        >>> plan = planner.plan(problem, budget=planner.Budget(on_progress=seen.append))
        >>> [(step.attempts, step.plan is plan) for step in seen]
        [(1, True)]
    """

    attempts: int
    seconds: float
    plan: Plan | None


@dataclass(frozen=True)
class Budget:
    """The limits on the attempts at one plan. The first attempt always runs.

    Attributes:
        attempts: The largest number of attempts: the request itself, its variants and the proofs of remedies. Improving
            a detour does not count, since its motion has a budget of its own.
        seconds: The time after which no other attempt begins, s. None: no limit of time, so that equal requests have
            equal answers on every machine.
        on_progress: A function that is called after each attempt. If it raises an exception, the planning ends with
            this exception.

    Examples:
        >>> import planner
        >>> planner.Budget(attempts=1).seconds is None
        True
    """

    attempts: int = 150
    seconds: float | None = None
    on_progress: Callable[[Progress], object] | None = None


@dataclass(frozen=True, eq=False)
class Attempt:
    """One run of the pipeline: a problem with all its variations.

    Attributes:
        problem: The problem, with other radii of its blends or with remedies.
        backend: The back end that puts time on the path.
        detours: The detours of the free motions, and the transitions at their corners. None: the problem is not checked
            and the detours are not found so far.
        path: The solved path; None: not solved so far.
        warnings: Warnings about the variant for its plan.
        moved: The joint positions (joints,), rad or m, of waypoints that were moved, by their indices in the problem.
        better_than: An objective and the value that the trajectory has to stay below; None: any trajectory will do.
    """

    problem: PlanningProblem
    backend: BackEnd
    detours: tuple[Detour, ...] | None = None
    path: JointPath | None = None
    warnings: tuple[PlanWarning, ...] = ()
    moved: Mapping[int, FloatArray] = field(default_factory=dict)
    better_than: tuple[Objective, float] | None = None

    @cached_property
    def with_moved(self) -> PlanningProblem:
        """The problem with the moved waypoints at their joint positions."""
        return with_fixed(self.problem, self.moved)

    @cached_property
    def with_detours(self) -> PlanningProblem:
        """The same problem with joint motions along the detours in the place of free ones."""
        return with_detours(self.with_moved, self.detours or ())

    def along(self, detours: Sequence[Detour]) -> Attempt:
        """Return the attempt with other detours."""
        return replace(self, detours=tuple(detours), path=None)

    def blended(self, radii: Mapping[int, float]) -> Attempt:
        """Return the attempt with other radii, m, of some blends, by the indices of their waypoints."""
        return replace(self, problem=with_blend_radii(self.problem, radii), path=None)

    def made(self) -> Planned | Refused:
        """Run the pipeline: check, find detours, solve the path, put time on it, shape motions, certify."""
        attempt, trajectory = self, None
        try:
            if attempt.detours is None:
                check_problem(attempt.problem, attempt.backend)
                attempt = replace(attempt, detours=find_detours(attempt.problem))
        except PlanningError as refusal:
            return Refused(attempt, refusal)
        problem = attempt.with_detours
        try:
            if attempt.path is None:
                attempt = replace(attempt, path=solve_path(problem))
            path = attempt.solved
            unshaped = timed(problem, attempt.backend, path)
            on_time = attempt.on_time(unshaped)
            trajectory = on_time.trajectory
            try:
                plan = certified(on_time.problem, attempt.backend, *on_time[1:])
            except LimitsUnsatisfiable as refusal:
                if not on_time.is_shaped:
                    raise
                plan = attempt.shaped_slower(unshaped, refusal)
        except PlanningError as refusal:
            return Refused(attempt, refusal.numbered(problem.numbers), trajectory)
        if attempt.detours or attempt.warnings:
            plan = replace(plan, detours=attempt.detours or (), warnings=(*attempt.warnings, *plan.warnings))
        return Planned(attempt, plan)

    def on_time(self, unshaped: Trajectory) -> OnTime:
        """Shape a trajectory, and wait at stops until no waypoint is reached before its earliest arrival.

        Segments take longer where a wait would make the arrival at a passed waypoint too late.

        Raises:
            InfeasibleDuration: A waypoint is reached after its latest arrival.
            PlanningError: The robot cannot wait, or the trajectory is no better than one that there is.
        """
        requested, late, fastest = self.with_detours, None, unshaped
        for trial in count():
            made = shaped(requested.residual_vibration, self.solved, unshaped)
            problem, path, trajectory = with_waits(requested, self.solved, made)
            try:
                refuse_late_arrivals(problem, trajectory)
                break
            except InfeasibleDuration as refusal:
                late, longer = late or refusal, with_longer_segments(requested, made)
                slower = None if longer is None else slowed_to(longer, self.backend, self.solved, fastest)
                if longer is None or slower is None or trial == MOST_LONGER:
                    raise late from None
            requested, unshaped = longer, slower
        self.refuse_unless_better(trajectory)
        return OnTime(problem, path, trajectory, trajectory if made is unshaped else unshaped)

    def shaped_slower(self, unshaped: Trajectory, refusal: LimitsUnsatisfiable) -> Plan:
        """Stretch the motions until the shaped ones keep all limits, if they exceed one slightly.

        Args:
            unshaped: The trajectory before it was shaped.
            refusal: The reason why the shaped trajectory is refused.

        Raises:
            LimitsUnsatisfiable: No factor helps, or the duration is requested.
            PlanningError: As `certified` does, for the stretched motions.
        """
        excess = abs((refusal.value or inf) / (refusal.limit or 1.0))
        for factor in SHAPED_STRETCHES if self.problem.duration is None and excess <= SLIGHT_EXCESS else ():
            slower = unshaped.stretched(np.where(unshaped.moves, factor, 1.0))
            on_time = self.on_time(slower)._replace(unshaped=unshaped)
            try:
                return certified(on_time.problem, self.backend, *on_time[1:])
            except LimitsUnsatisfiable:
                continue
        raise refusal

    @property
    def solved(self) -> JointPath:
        """The solved path."""
        assert self.path is not None  # noqa: S101 - asked of attempts that came to a path only
        return self.path

    def refuse_unless_better(self, trajectory: Trajectory) -> None:
        """Refuse a trajectory, before it is certified, that is no better than one that there is.

        Raises:
            PlanningError: It is no better.
        """
        if self.better_than is not None:
            objective, value = self.better_than
            if value_of(objective, self.solved, trajectory) >= value * (1.0 - ROUNDING):
                raise NotBetter("there is a trajectory as good as this one")


class OnTime(NamedTuple):
    """A trajectory that reaches no waypoint too early, for the certificate.

    Attributes:
        problem: The problem, with the waits as dwells.
        path: The path, with these dwells.
        trajectory: The trajectory, shaped if the problem requests it.
        unshaped: The trajectory before it was shaped; the same one if it was not.
    """

    problem: PlanningProblem
    path: JointPath
    trajectory: Trajectory
    unshaped: Trajectory

    @property
    def is_shaped(self) -> bool:
        """Whether the trajectory was shaped."""
        return self.trajectory is not self.unshaped


class NotBetter(PlanningError):
    """A trajectory is no better than one that there is."""


class BudgetSpent(PlanningError):
    """An attempt was not made: the budget is spent."""


@dataclass(frozen=True, eq=False)
class Planned:
    """The outcome of an attempt that led to a plan.

    Attributes:
        attempt: The attempt, with its detours and its path.
        plan: The plan.
    """

    attempt: Attempt
    plan: Plan

    def saying(self, warnings: Iterable[PlanWarning]) -> Planned:
        """Return the outcome with warnings that its plan and all further variants of it are to have."""
        said = tuple(warnings)
        attempt = replace(self.attempt, warnings=(*said, *self.attempt.warnings))
        return Planned(attempt, replace(self.plan, warnings=(*said, *self.plan.warnings)))


@dataclass(frozen=True, eq=False)
class Refused:
    """The outcome of an attempt that was refused.

    Attributes:
        attempt: The attempt, with its detours and its path as far as they were found.
        refusal: The reason.
        trajectory: The trajectory that the certificate refuses; None: the attempt was refused before there was one.
    """

    attempt: Attempt
    refusal: PlanningError
    trajectory: Trajectory | None = None


Outcome = Planned | Refused
"""What came of an attempt."""


def is_unmade(outcome: Outcome) -> bool:
    """Tell whether an attempt was not made, because the budget is spent."""
    return isinstance(outcome, Refused) and isinstance(outcome.refusal, BudgetSpent)


Proposals = Generator[Attempt, Outcome, T]
"""Proposes attempts, sees the outcome of each, and returns a T."""


def run(proposals: Proposals[T], budget: Budget) -> T:
    """Make one attempt after the other until nothing more is proposed.

    Beyond the budget attempts count as refused, so that the best up to there is returned.
    """
    begin, count, made = monotonic(), 0, 0
    deadline = inf if budget.seconds is None else begin + budget.seconds
    outcome: Outcome | None = None
    plan: Plan | None = None
    while True:
        try:
            attempt = next(proposals) if outcome is None else proposals.send(outcome)
        except StopIteration as end:
            found: T = end.value
            return found
        if count > 0 and (count >= budget.attempts or monotonic() > deadline):
            outcome = Refused(attempt, BudgetSpent("the budget of attempts is spent"))
        else:
            outcome, made = attempt.made(), made + 1
            plan = outcome.plan if isinstance(outcome, Planned) else plan
            if budget.on_progress is not None:
                budget.on_progress(Progress(made, monotonic() - begin, plan))
        count += attempt.better_than is None
