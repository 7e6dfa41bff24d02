"""Path velocity profiles, solved on intervals that are split where this shortens the trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.backends.toppra.intervals import Intervals
from planner.backends.toppra.path_limits import path_limits
from planner.backends.toppra.solvers import Solver
from planner.kernels.profile import PathLimits, fastest_profile, judge_profile, times_between
from planner.paths import JointPath
from planner.spatial import FloatArray
from planner.time_scaling.compose import MOST_PIECE_HALVINGS
from planner.trajectories.polynomials import SegmentedPolynomial, horner, quintic_hermite

MOST_GRID_REFINEMENTS = 3
"""Largest number of times that intervals are split."""

MOST_PROFILE_REPAIRS = 3
"""Largest number of further solutions that repair limits still exceeded."""

NEGLECTED = 0.001
"""Share of the time that constant path accelerations may waste before intervals are split a second time.

Below it, another solution gained less than this share in every motion.
"""

STUCK = 0.003
"""Share of the time of intervals without a path acceleration along the limits above which they are split a second time.

These intervals slow their neighbours, too.
"""

WASTE = 0.01
"""Share of the mean time of an interval that an interval may waste before it is split."""

MOST_PATH_ACCELERATION = 1e6
"""Largest path acceleration that is no jump, as a multiple of the highest bound of s'^2 by the interval's length."""

LEAST_SPLIT_SHARE = 1e-4
"""Smallest part of a split interval, as a share of the interval."""

TOLERATED = 1.001
"""Largest use of a limit at interval ends by a path acceleration that follows another limit, as a share of it."""

MENDED_BY_PARTS = 1.02
"""Largest use of a limit on an interval that splitting the interval repairs, as a share of the limit.

The excess between two points that keep the limit shrinks with the square of their distance.
"""

SPLIT_PARTS = 4
"""Number of parts for splitting an interval on which no path acceleration follows the limits."""

SPLITTING = np.array(
    [NEGLECTED, STUCK, WASTE, MOST_PATH_ACCELERATION, LEAST_SPLIT_SHARE, TOLERATED, MENDED_BY_PARTS, SPLIT_PARTS]
)
"""These numbers as the kernel reads them."""


class SolvedLimits(NamedTuple):
    """The limits that a profile was solved with.

    Attributes:
        limits: The limits on its intervals.
        throughout: (intervals,), whether a constant u must keep the limits over the whole interval.
    """

    limits: PathLimits
    throughout: np.ndarray


@dataclass(frozen=True, eq=False)
class Profile:
    """A path velocity at the gridpoints; between them the path acceleration is linear in s.

    Attributes:
        intervals: The curves.
        x: (intervals + 1,), s'^2 at the gridpoints.
        bend: (intervals,), half of the increase of s'' on each interval.
        solved: The limits of its solution; None: intervals were split after the solution.
    """

    intervals: Intervals
    x: FloatArray
    bend: FloatArray
    solved: SolvedLimits | None = None

    def x_at(self, p: FloatArray | float) -> FloatArray:
        """Return s'^2 (..., intervals) at shares (..., 1) of each interval."""
        bent = 2.0 * p * (1.0 - p) * self.bend * self.intervals.lengths
        return np.asarray(self.x[:-1] * (1.0 - p) + self.x[1:] * p - bent)

    def u_at(self, p: FloatArray | float) -> FloatArray:
        """Return s'' (..., intervals) at shares (..., 1) of each interval."""
        return np.asarray(np.diff(self.x) / (2.0 * self.intervals.lengths) + self.bend * (2.0 * p - 1.0))

    @property
    def x_at_ends(self) -> FloatArray:
        """Return s'^2 (intervals, 2) at the start and the end of each interval."""
        return np.column_stack([self.x[:-1], self.x[1:]])

    @cached_property
    def times(self) -> FloatArray:
        """The times (intervals,) of the intervals, s."""
        return self.times_between(0.0, 1.0)

    def times_between(self, start: float, end: float) -> FloatArray:
        """Return the times (intervals,), s, from one share of each interval to another."""
        return times_between(self.intervals.lengths, self.x, self.bend, start, end)

    @cached_property
    def durations(self) -> FloatArray:
        """The durations (groups,) of the groups, s."""
        durations: FloatArray = np.bincount(self.intervals.groups, self.times).astype(np.float64)
        return durations


def fastest_on(
    path: JointPath,
    intervals: Intervals,
    factors: FloatArray,
    refinements: int = MOST_GRID_REFINEMENTS,
    repairs: int = MOST_PROFILE_REPAIRS,
    solver: Solver = "kernel",
) -> Profile:
    """Return the fastest profile on intervals.

    Args:
        path: The path, with its limits.
        intervals: The intervals of its curves.
        factors: (segments,), on all times, in addition to the limits.
        refinements: Largest number of times that intervals are split.
        repairs: Largest number of further solutions that repair exceeded limits.
        solver: What solves it.
    """
    limits = path_limits(path.dynamics, path.limits, intervals, factors)
    solved = SolvedLimits(limits, np.zeros(len(intervals.lengths), dtype=bool))
    return _solved(path, intervals, factors, solved, refinements, repairs, solver)


def solved_again(
    path: JointPath, profile: Profile, parts: np.ndarray, changed: np.ndarray, factors: FloatArray, solver: Solver
) -> Profile:
    """Return the fastest profile after some intervals are split or slowed; the others keep their limits.

    Args:
        path: The path, with its limits.
        profile: A profile as `fastest_on` finds it.
        parts: (intervals,), 1 or 2, equal parts of each interval.
        changed: (intervals,), whether an interval is split or its factor changes.
        factors: (segments,), on all times, in addition to the limits.
        solver: What solves it.
    """
    assert profile.solved is not None  # noqa: S101 - of `fastest_on`
    before, own = profile.solved, np.repeat(np.arange(len(parts)), parts)
    intervals, new = profile.intervals.split(parts), changed[own]
    limits = before.limits.with_new(own, new, path_limits(path.dynamics, path.limits, intervals.of(new), factors))
    again = SolvedLimits(limits, before.throughout[own] & ~new)
    return _solved(path, intervals, factors, again, 0, MOST_PROFILE_REPAIRS, solver)


def _solved(
    path: JointPath,
    intervals: Intervals,
    factors: FloatArray,
    solved: SolvedLimits,
    refinements: int,
    repairs: int,
    solver: Solver,
) -> Profile:
    """Return the fastest profile on intervals.

    The first solution is within the limits `solved`; see `fastest_on` for the rest.
    """
    limits, throughout = solved
    for solution in range(refinements + repairs + 1):
        x = solve(solver, limits, throughout, intervals.rests)
        may_split = solution < refinements and not intervals.are_many
        state = limits, throughout, intervals.groups, x
        bend, parts = judge_profile(*state, SPLITTING, may_split=may_split, is_first=not solution)
        profile = Profile(intervals, x, bend, SolvedLimits(limits, throughout))
        if parts is None or solution == refinements + repairs:
            break
        rows, starts, ends, throughout = parts
        new = ends - starts < 1.0
        if new.any():
            intervals = intervals.parts(rows, starts, ends)
            limits = limits.with_new(rows, new, path_limits(path.dynamics, path.limits, intervals.of(new), factors))
    return profile


def solve(solver: Solver, limits: PathLimits, throughout: np.ndarray, rests: np.ndarray) -> FloatArray:
    """Return the fastest profile (intervals + 1,) of x by a solver; see `fastest_profile` of the kernels.

    Raises:
        SolverFailed: The package found no profile.
    """
    if solver == "kernel":
        return fastest_profile(limits, throughout, rests)
    # It imports the package, which takes half a second.
    from planner.backends.toppra.reachability import fastest_profile as by_package

    return by_package(limits, throughout, rests)


def pieces_of(profile: Profile, tolerances: FloatArray) -> SegmentedPolynomial:
    """Return quintics in time that meet the curves, their velocity and acceleration at both ends of each interval.

    Intervals are halved until the quintics keep to the curves.

    Args:
        profile: The profile of the path velocity.
        tolerances: (groups,), rad or m.
    """
    for _ in range(MOST_PIECE_HALVINGS):
        intervals, times = profile.intervals, profile.times
        q, first, second = intervals.at(np.array([0.0, 0.5, 1.0]))
        x, u = (rows(np.array([[0.0], [0.5], [1.0]]))[..., None] for rows in (profile.x_at, profile.u_at))
        states = q, first * np.sqrt(x), second * x + first * u
        coefficients = quintic_hermite(times, *(tuple(rows[end] for rows in states) for end in (0, -1)))
        missed = np.abs(horner(coefficients, profile.times_between(0.0, 0.5)[:, None]) - q[1]).max(axis=1)
        rough = missed > tolerances[intervals.groups]
        if not rough.any():
            break
        x = np.insert(profile.x, np.flatnonzero(rough) + 1, x[1, rough, 0])
        bend = np.repeat(profile.bend / (1.0 + rough), 1 + rough)
        profile = Profile(intervals.split(1 + rough), x, bend)
    return SegmentedPolynomial(times, coefficients, intervals.segments)
