"""The fastest profile of the path velocity by the package toppra: its algorithm, constraint and compiled solver.

A backward pass finds the controllable sets, the x = s'^2 at each gridpoint from which the rest can be braked in time; a
forward pass then accelerates as much as the limits and these sets allow: Pham and Pham, "A New Approach to Time-Optimal
Path Parameterization Based on Reachability Analysis", IEEE Transactions on Robotics 34 (3), 2018. Where a profile is
known but for some intervals, both passes are done here, as the package knows no beginning in the middle: from where
limits changed to where the old profile is met.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.backends.toppra.package import (
    TOPPRA,
    AbstractGeometricPath,
    LinearConstraint,
    ReachabilityAlgorithm,
    ToppraError,
    seidelWrapper,
)
from planner.backends.toppra.path_limits import LinearRows
from planner.backends.toppra.solvers import Reach, SolverFailed

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.spatial import FloatArray

LEAST_NORM = 1e-9
"""Norm of a row (a, b), in the solver's unit, below which it is rounding and limits nothing."""

LEAST_LENGTH = 1e-6
"""Length of an interval, in the solver's unit, below which it is solved as one with its neighbour: the absolute
tolerance of the solver, 1e-10, would leave the path acceleration on it undecided."""

NEARLY_MET = 1e-9
"""Relative difference of x up to which a profile meets another: more than the solver's rounding, 1e-10 of the unit."""

BLOCK = 64
"""Number of intervals that have a solver of their own."""

MOST_TRIES = 10
"""Largest number of times that x is made less at a gridpoint where rounding has put it beyond what is controllable."""

LARGEST_X = np.array([1e-9, -1.0])
"""Aim of the backward pass, to be made least: the largest x, and among equals the least u."""

TINY = 1e-8
"""What x is made less by then, and at each gridpoint, as in the package."""

logging.getLogger("toppra").setLevel(logging.ERROR)


class _Grid(AbstractGeometricPath):  # type: ignore[misc] # the package has no types
    """The interval of s; what else the algorithm needs of the path has gone into the rows."""

    def __init__(self, length: float) -> None:
        self._interval = np.array([0.0, length])

    @property
    def path_interval(self) -> FloatArray:
        """Return the ends of s."""
        return self._interval


class _Rows(LinearConstraint):  # type: ignore[misc] # the package has no types
    """All limits at once: a u + b x + c <= 0, and the bounds on x."""

    def __init__(self, rows: tuple[FloatArray, ...], bounds: FloatArray) -> None:
        super().__init__()
        self.identical = True
        self.rows = rows
        self.bounds = bounds

    @classmethod
    def scaled(cls, rows: LinearRows, bounds: FloatArray) -> _Rows:
        """Return limits on intervals and bounds at gridpoints, each limit as long as the others: (a, b) has norm 1."""
        size = np.hypot(rows.a, rows.b)
        used = np.append(True, (size[:, 1:] > 0.0).any(axis=0))
        divisor = np.maximum(size[:, used], LEAST_NORM)
        # The last gridpoint has no interval; the solver wants a row there and does not use it.
        scaled = (part[:, used] / divisor for part in rows)
        padded = tuple(np.concatenate([part, part[-1:]]) for part in scaled)
        return cls(padded, np.column_stack([np.zeros_like(bounds), bounds]))

    def compute_constraint_params(self, *_: Any) -> tuple[FloatArray | None, ...]:
        """Return a, b and c at each gridpoint, F and g with F (a u + b x + c) <= g, the bounds on u, and those on x."""
        a, b, c = self.rows
        return a, b, c, np.eye(a.shape[1]), np.zeros(a.shape[1]), None, self.bounds


class _FromRestToRest(TOPPRA):  # type: ignore[misc] # the package has no types
    """The algorithm where standing still keeps every limit: each controllable set is all from 0 up to its largest x."""

    def __init__(self, rows: _Rows, gridpoints: FloatArray) -> None:
        # Past the base class, which looks for solvers on the disk before it takes the compiled one.
        super(ReachabilityAlgorithm, self).__init__([rows], _Grid(gridpoints[-1]), gridpoints=gridpoints)
        self.solver_wrapper = seidelWrapper(self.constraints, self.path, self.gridpoints)
        self._solve = self.solver_wrapper.solve_stagewise_optim
        self._aims = np.column_stack([-2.0 * np.diff(gridpoints), np.full(len(gridpoints) - 1, -1.0)])

    def compute_controllable_sets(self, sdmin: float, sdmax: float) -> FloatArray:
        """Return the least and the largest controllable x (gridpoints, 2): the package's own backward pass.

        But for the search for the least, which is 0, and the checks and logs of each step.
        """
        sets, largest = np.zeros((self._N + 1, 2)), sdmax**2
        sets[-1] = sdmin**2, largest
        for i in range(self._N - 1, -1, -1):
            largest = self._solve(i, None, LARGEST_X, np.nan, np.nan, 0.0, largest)[1]
            if math.isnan(largest):
                sets[i] = np.nan
                break
            sets[i, 1] = largest
        return sets

    def _forward_step(self, i: int, x: float, K_next: FloatArray) -> list[float]:
        """Return the largest u from x into the next controllable set: the package's own method, but for its checks."""
        step: list[float] = self._solve(i, None, self._aims[i], x, x, K_next[0], K_next[1])
        return step


def _from_nothing(lengths: FloatArray, rows: LinearRows, bounds: FloatArray) -> Reach:
    """Return what can be reached by the package's algorithm, all in a unit in which x is about 1."""
    gridpoints = np.concatenate([[0.0], np.cumsum(lengths)])
    search = _FromRestToRest(_Rows.scaled(rows, bounds), gridpoints)
    _, speeds, _ = search.compute_parameterization(0.0, 0.0)
    if speeds is None:
        raise SolverFailed
    return Reach(search.problem_data.K[:, 1], speeds**2)


class _Solver:
    """The package's compiled solver of the linear programs in x and u, all in a unit in which x is about 1.

    It copies all rows that it is made of, which takes as long as it takes to solve with them. So there is one for each
    block of intervals, made when it is first needed.
    """

    def __init__(self, lengths: FloatArray, rows: LinearRows, bounds: FloatArray) -> None:
        self.lengths = lengths
        self._rows = rows
        self._bounds = bounds
        self._blocks: dict[int, Callable[..., FloatArray]] = {}

    def of_block(self, first: int) -> Callable[..., FloatArray]:
        """Return what solves the linear program of an interval, counted from the first of the block."""
        if first not in self._blocks:
            block = slice(first, first + BLOCK)
            constraint = _Rows.scaled(
                LinearRows(*(part[block] for part in self._rows)), self._bounds[first : first + BLOCK + 1]
            )
            gridpoints = np.concatenate([[0.0], np.cumsum(self.lengths[block])])
            made: Any = seidelWrapper([constraint], _Grid(gridpoints[-1]), gridpoints)
            self._blocks[first] = made.solve_stagewise_optim
        return self._blocks[first]


def _again(lengths: FloatArray, rows: LinearRows, bounds: FloatArray, known: Reach, changed: np.ndarray) -> Reach:
    """Return what can be reached where it is known for other limits on some intervals: see `_from_nothing`."""
    solver = _Solver(lengths, rows, bounds)
    controllable = _controllable(solver, known.controllable, changed)
    changed = changed | (controllable != known.controllable)[1:]
    return Reach(controllable, _reached(solver, known.x, changed, controllable))


def _controllable(solver: _Solver, known: FloatArray, changed: np.ndarray) -> FloatArray:
    """Return the largest controllable x (gridpoints,), from the last to the first.

    Standing still keeps every limit: each controllable set is all from 0 up to its largest x.

    Args:
        solver: The solver of the linear programs.
        known: (gridpoints,), what it was before limits on some intervals changed.
        changed: (intervals,), whether they did.
    """
    last_changed = np.maximum.accumulate(np.where(changed, np.arange(len(changed)), -1)).tolist()
    before, sets = known.tolist(), known.tolist()
    sets[-1], i, first = 0.0, len(changed) - 1, len(changed)
    while i >= 0:
        following = sets[i + 1]
        if last_changed[i] < i and abs(following - before[i + 1]) <= NEARLY_MET * following:
            sets[i + 1] = before[i + 1]
            i = last_changed[i]
            continue
        if i < first:
            first = i // BLOCK * BLOCK
            solve = solver.of_block(first)
        sets[i] = solve(i - first, None, LARGEST_X, np.nan, np.nan, 0.0, following)[1]
        if math.isnan(sets[i]):
            raise SolverFailed
        i -= 1
    return np.array(sets)


def _reached(solver: _Solver, known: FloatArray, changed: np.ndarray, controllable: FloatArray) -> FloatArray:
    """Return the largest x (gridpoints,) that can be reached, from the first to the last.

    Args:
        solver: The solver of the linear programs.
        known: (gridpoints,), what it was before limits or controllable sets of some intervals changed.
        changed: (intervals,), whether they did.
        controllable: (gridpoints,), the largest controllable x.
    """
    count, twice = len(changed), 2.0 * solver.lengths
    aims = np.column_stack([-twice, np.full(count, -1.0)])
    next_changed = np.minimum.accumulate(np.where(changed, np.arange(count), count)[::-1])[::-1].tolist()
    before, sets, x, lengths = known.tolist(), controllable.tolist(), known.tolist(), twice.tolist()
    x[0], i, end, tries = 0.0, 0, 0, 0
    while i < count:
        if next_changed[i] > i and abs(x[i] - before[i]) <= NEARLY_MET * x[i]:
            x[i] = before[i]
            i = next_changed[i]
            continue
        if i >= end:
            end = i // BLOCK * BLOCK + BLOCK
            solve = solver.of_block(end - BLOCK)
        u = solve(i + BLOCK - end, None, aims[i], x[i], x[i], 0.0, sets[i + 1])[0]
        if math.isnan(u):
            # By rounding x is beyond what is controllable.
            x[i], tries = max(x[i] - TINY, 0.999 * x[i]), tries + 1
            if tries > MOST_TRIES:
                raise SolverFailed
            continue
        reached = x[i] + lengths[i] * u
        x[i + 1] = min(max(reached - TINY, 0.9999 * reached, 0.0), sets[i + 1])
        i, tries = i + 1, 0
    return np.array(x)


def fastest_profile(
    lengths: FloatArray,
    rows: LinearRows,
    bounds: FloatArray,
    rests: np.ndarray,
    known: Reach | None = None,
    changed: np.ndarray | None = None,
) -> Reach:
    """Return what can be reached at the gridpoints: the fastest profile.

    Where it is known for other limits on some intervals, it is solved again only from where these are to where it meets
    the known one.

    Args:
        lengths: (intervals,).
        rows: Limits on x at an interval's start and the constant or mean u on it.
        bounds: (intervals + 1,), of x.
        rests: (intervals + 1,): where x is 0; both ends at least.
        known: What could be reached before limits changed; nothing, if not given.
        changed: (intervals,), whether the limits on them did, or the gridpoint at their start is new.

    Raises:
        SolverFailed: The solver found no profile.
    """
    units, spans = _units(lengths, rows, bounds, rests)
    scale = np.append(units, units[-1]) ** 2
    bounds = np.where(rests, 0.0, bounds / scale)
    long = lengths / spans >= LEAST_LENGTH
    for short in np.flatnonzero(~long).tolist():
        # Over so short an interval x hardly changes: its limits bound x alone.
        least = -rows.c[short] / np.maximum(rows.b[short] * scale[short], LEAST_NORM)
        bounds[short : short + 2] = np.minimum(bounds[short : short + 2], least.min())
    own, at_rest = _joined(long, rests)
    starts = np.flatnonzero(np.diff(own, prepend=-1))
    # Over a short interval x stays the same; from rest and into it, it changes as on the long interval there.
    gridpoints = np.concatenate([[0.0], np.cumsum(np.where(long | at_rest, lengths / spans, 0.0))])
    marks = np.append(starts, len(lengths))
    by_u = (scale[:-1] / spans)[long, None]
    rows = LinearRows(rows.a[long] * by_u, rows.b[long] * scale[:-1][long, None], rows.c[long])
    bounds = np.append(np.minimum.reduceat(bounds[:-1], starts), 0.0)
    problem = np.diff(gridpoints[marks]), rows, bounds
    try:
        if known is None or changed is None:
            found = before = _from_nothing(*problem)
        else:
            # A bound at a gridpoint is that of the intervals on both sides.
            changed = np.logical_or.reduceat(changed | np.append(False, changed[:-1]), starts)
            before = known.of(marks, scale[marks])
            found = _again(*problem, before, changed)
    except (ToppraError, ArithmeticError) as failure:
        raise SolverFailed from failure
    if not np.isfinite(found).all():
        raise SolverFailed

    squares = [np.where(rests, 0.0, np.interp(gridpoints, gridpoints[marks], part) * scale) for part in found]
    if known is not None:
        for part, was, old, new in zip(squares, known, before, found, strict=True):
            same = marks[new == old]
            part[same] = was[same]  # to the last digit
    return Reach(*squares)


def _joined(long: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the long intervals each interval (intervals,) is solved with, and whether it lies next to rest.

    That is the next one, or the one before where the robot rests between it and the next.
    """
    runs = np.cumsum(rests[:-1])
    following = np.cumsum(long) - long
    has_next = np.append(runs[long], -1)[following] == runs
    has_one_before = np.append(-1, runs[long])[following] == runs
    return np.where(has_next, following, following - 1), ~(has_next & has_one_before)


def _units(
    lengths: FloatArray, rows: LinearRows, bounds: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Return the units of s' and of s (intervals,) for the solver, the same from rest to rest, in which x is about 1.

    Its tolerances are absolute. A curve is about as fast as its bounds allow, or as it can get from rest on half of it.
    The unit of s is what is travelled at that speed in 1 s, but no more than the whole curve: u is then about 1, too.
    """
    runs = np.cumsum(rests[:-1]) - 1
    with np.errstate(divide="ignore"):
        gains = 1.0 / np.abs(rows.a).max(axis=1)
    starts = np.flatnonzero(rests[:-1])
    bound, gain = (
        np.array([np.sort(part)[len(part) // 2] for part in np.split(values, starts[1:])])
        for values in (np.maximum(bounds[:-1], bounds[1:]), gains)
    )
    whole = np.bincount(runs, lengths)
    units = np.sqrt(np.minimum(bound, gain * whole))
    return units[runs], np.minimum(units, whole)[runs]
