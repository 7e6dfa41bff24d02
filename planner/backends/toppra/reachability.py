"""The fastest profile of the path velocity by the package toppra: its algorithm, constraint and compiled solver.

A backward pass finds the controllable sets, the x = s'^2 at each gridpoint from which the rest can be braked in time; a
forward pass then accelerates as much as the limits and these sets allow: Pham and Pham, "A New Approach to Time-Optimal
Path Parameterization Based on Reachability Analysis", IEEE Transactions on Robotics 34 (3), 2018.
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
from planner.backends.toppra.solver_failed import SolverFailed

if TYPE_CHECKING:
    from planner.spatial import FloatArray

LEAST_NORM = 1e-9
"""Norm of a row (a, b), in the solver's unit, below which it is rounding and limits nothing."""

LEAST_LENGTH = 1e-6
"""Length of an interval, in the solver's unit, below which it is solved as one with its neighbour: the absolute
tolerance of the solver, 1e-10, would leave the path acceleration on it undecided."""

MARGIN = 4
"""Number of intervals on either side of tighter limits that are solved again first; then twice as many."""

MOST_INSIDE = 0.5
"""Share of the intervals above which all of them are solved again."""

FEWEST_FOR_WINDOWS = 400
"""Number of intervals below which all of them are solved again: several solutions of a few cost as much."""

NEARLY_MET = 1e-7
"""Relative difference of x up to which a profile meets another: more than the solver's rounding, 1e-10 of the unit."""

LARGEST_X = np.array([1e-9, -1.0])
"""Aim of the backward pass, to be made least: the largest x, and among equals the least u."""

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


def fastest_profile(lengths: FloatArray, rows: LinearRows, bounds: FloatArray, rests: np.ndarray) -> FloatArray:
    """Return the largest squares of the path velocity, x = s'^2 (intervals + 1,), at the gridpoints.

    Args:
        lengths: (intervals,).
        rows: Limits on x at an interval's start and the constant or mean u on it.
        bounds: (intervals + 1,), of x.
        rests: (intervals + 1,): where x is 0; both ends at least.

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
    x = _solved(gridpoints[marks], rows, np.append(np.minimum.reduceat(bounds[:-1], starts), 0.0))
    between: FloatArray = np.interp(gridpoints, gridpoints[marks], x) * scale
    return np.where(rests, 0.0, between)


def tightened_profile(
    known: FloatArray, changed: np.ndarray, lengths: FloatArray, rows: LinearRows, bounds: FloatArray, rests: np.ndarray
) -> FloatArray:
    """Return the same as `fastest_profile` where the profile is known for looser limits on some of the intervals.

    It is solved again only near these: as far as it takes until it meets the known one on both sides.

    Args:
        known: (intervals + 1,), the profile for the looser limits.
        changed: (intervals,), whether the limits are tighter; at least one.
        lengths: As of `fastest_profile`, like all that follow.
        rows: See there.
        bounds: See there.
        rests: See there.

    Raises:
        SolverFailed: The solver found no profile.
    """
    x, inside, margin = known.copy(), _near(changed, MARGIN), MARGIN
    while len(changed) >= FEWEST_FOR_WINDOWS and inside.mean() < MOST_INSIDE:
        edges = np.flatnonzero(np.diff(inside, prepend=False, append=False))
        points, found = _solved_between(edges, x, lengths, rows, bounds, rests)
        missed = np.isin(points, edges) & (found < x[points] * (1.0 - NEARLY_MET))
        windows = (np.searchsorted(edges, points, side="right") - 1) // 2
        again = np.isin(windows, windows[missed])
        x[points[~again]] = found[~again]
        if not missed.any():
            return x
        margin *= 2
        inside = np.zeros_like(changed)
        inside[np.minimum(points[again], len(changed) - 1)] = True
        inside = _near(inside, margin)
    return fastest_profile(lengths, rows, bounds, rests)


def _near(intervals: np.ndarray, margin: int) -> np.ndarray:
    """Return which intervals lie within so many of some of them, both (intervals,) of bools."""
    near: np.ndarray = np.convolve(intervals, np.ones(2 * margin + 1), "same") > 0.0
    return near


def _solved_between(
    edges: np.ndarray, known: FloatArray, lengths: FloatArray, rows: LinearRows, bounds: FloatArray, rests: np.ndarray
) -> tuple[np.ndarray, FloatArray]:
    """Return the gridpoints (N,) of windows between edges, where a known profile goes on, and x (N,) at them.

    Between one window and the next the robot comes to rest: over intervals that nothing limits, with the x that is
    known at their other end.
    """
    starts: list[int] = []
    for first, last in edges.reshape(-1, 2).tolist():
        starts += [*([] if rests[first] else [-1]), *range(first, last), *([] if rests[last] else [last])]
    own = ~np.isin(starts, [-1, *edges[1::2]])
    points = np.append(starts, -1)
    intervals = np.where(own, starts, 0)
    nothing = (0.0, 0.0, -1.0)
    limits = LinearRows(*(np.where(own[:, None], part[intervals], no) for part, no in zip(rows, nothing, strict=True)))
    x = fastest_profile(
        np.where(own, lengths[intervals], lengths.mean()),
        limits,
        np.where(np.isin(points, edges), known[points], bounds[points]),
        (points < 0) | rests[points],
    )
    on_path = points >= 0
    return points[on_path], x[on_path]


def _solved(gridpoints: FloatArray, rows: LinearRows, bounds: FloatArray) -> FloatArray:
    """Return x at the gridpoints, all in a unit in which x is about 1."""
    divisor = np.maximum(np.hypot(rows.a, rows.b), LEAST_NORM)
    # The last gridpoint has no interval; the solver wants a row there and does not use it.
    padded = tuple(np.vstack([part, part[-1:]]) for part in (rows.a / divisor, rows.b / divisor, rows.c / divisor))
    search = _FromRestToRest(_Rows(padded, np.column_stack([np.zeros_like(bounds), bounds])), gridpoints)
    try:
        _, speeds, _ = search.compute_parameterization(0.0, 0.0)
    except (ToppraError, ArithmeticError) as failure:
        raise SolverFailed from failure
    if speeds is None or not np.isfinite(speeds).all():
        raise SolverFailed
    x: FloatArray = speeds**2
    return x


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
