"""The fastest profile of the path velocity by the package toppra: its algorithm, constraint and compiled solver.

A backward pass finds the controllable sets: the values x = s'^2 at each gridpoint from which braking is still possible.
A forward pass then accelerates as much as the limits and these sets allow. See Pham and Pham, "A New Approach to
Time-Optimal Path Parameterization Based on Reachability Analysis", IEEE Transactions on Robotics 34 (3), 2018.
"""

from __future__ import annotations

import logging
import math
from typing import Any, NamedTuple

import numpy as np

from planner.backends.toppra.intervals import PROBES
from planner.backends.toppra.package import (
    TOPPRA,
    AbstractGeometricPath,
    LinearConstraint,
    ReachabilityAlgorithm,
    ToppraError,
    seidelWrapper,
)
from planner.backends.toppra.path_limits import MOST_GRAVITY, MOST_SQUARE
from planner.backends.toppra.solvers import SolverFailed
from planner.kernels.profile import PathLimits
from planner.spatial import FloatArray

LEAST_NORM = 1e-9
"""Norm of a row (a, b), in the solver's unit, below which it is rounding and limits nothing."""

LEAST_LENGTH = 1e-6
"""Length of an interval, in the solver's unit, below which it is solved together with its neighbour.

The absolute tolerance of the solver, 1e-10, would leave its path acceleration undecided.
"""

REACHABLE_TOLERANCE = 1e-9
"""Share of a limit within which what can be reached at most counts as reaching it."""

POINT_SHARES = np.array([0.0, 0.5, 1.0])
"""Points of limits, as shares of an interval."""

QUADRATIC_TO_BERNSTEIN = np.array([[1.0, -0.5, 0.0], [0.0, 2.0, 0.0], [0.0, -0.5, 1.0]])
"""Matrix from the values of a quadratic at these points to its Bernstein coefficients, which bound it."""

PARALLEL_TO_X = 1e-10
"""Ratio to the largest coefficient of u on its interval below which a coefficient does not limit u."""

LARGEST_X = np.array([1e-9, -1.0])
"""Aim of the backward pass, to be made least: the largest x, and among equals the least u."""

X_TAKEN_OFF = 1e-8
"""Amount, in the solver's unit, that the package subtracts from x at each gridpoint."""

logging.getLogger("toppra").setLevel(logging.ERROR)


class LinearRows(NamedTuple):
    """Limits on x at an interval's start and the mean u on it: a u + b x + c <= 0.

    Attributes:
        a: (intervals, limits).
        b: (intervals, limits).
        c: (intervals, limits), negative.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray

    def that_bind(self, highest: FloatArray) -> LinearRows:
        """Return the limits that some (x, u) within the others can reach.

        Args:
            highest: (intervals,), the bound on x.
        """
        a, b, c = self
        binds_u = np.abs(a) > PARALLEL_TO_X * np.abs(a).max(axis=1, keepdims=True)
        least = c + np.minimum(b, 0.0) * highest[:, None]
        reach = np.divide(-least, a, out=np.zeros_like(a), where=binds_u)
        upper = np.where(binds_u & (a > 0.0), reach, MOST_SQUARE).min(axis=1)[:, None]
        lower = np.where(binds_u & (a < 0.0), reach, -MOST_SQUARE).max(axis=1)[:, None]
        farthest = np.maximum(a * upper, a * lower) + np.maximum(b, 0.0) * highest[:, None]
        binding = farthest >= -c * (1.0 - REACHABLE_TOLERANCE)
        width = max(int(binding.sum(axis=1).max(initial=0)), 1)
        order = np.argsort(~binding, axis=1, kind="stable")[:, :width]
        kept = np.take_along_axis(binding, order, axis=1)
        parts = zip(self, (0.0, 0.0, -1.0), strict=True)
        return LinearRows(*(np.where(kept, np.take_along_axis(part, order, axis=1), none) for part, none in parts))


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
        """Return coefficients of F (a u + b x + c) <= g at gridpoints, and the bounds of u and x."""
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


def fastest_profile(limits: PathLimits, throughout: np.ndarray, rests: np.ndarray) -> FloatArray:
    """Return the fastest profile (intervals + 1,) of x by the package.

    Raises:
        SolverFailed: The solver found no profile.
    """
    lengths, rows = limits.lengths, _rows(limits, throughout)
    bounds = np.minimum(np.append(limits.bounds[0], np.inf), np.insert(limits.bounds[-1], 0, np.inf))
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
    grid = np.concatenate([[0.0], np.cumsum(np.diff(gridpoints[marks]))])
    try:
        _, speeds, _ = _FromRestToRest(_Rows.scaled(rows, bounds), grid).compute_parameterization(0.0, 0.0)
    except (ToppraError, ArithmeticError) as failure:
        raise SolverFailed from failure
    if speeds is None or not np.isfinite(speeds).all():
        raise SolverFailed
    return np.where(rests, 0.0, np.interp(gridpoints, gridpoints[marks], speeds**2) * scale)


def _rows(limits: PathLimits, throughout: np.ndarray) -> LinearRows:
    """Return the limits on x at the start of each interval and on the mean u, as in `profile.hpp`."""
    straight = limits.bounds[:1] + (limits.bounds[-1:] - limits.bounds[:1]) * PROBES[:, None]
    middle = limits.per_u[1] + limits.lengths[:, None] * limits.per_x[1], limits.per_x[1], limits.rest[1]
    rows = _signed(limits._replace(bounds=np.maximum(limits.bounds, straight)), *middle)
    if not throughout.any():
        return rows
    part = limits.of(np.flatnonzero(throughout))
    grows = 2.0 * part.lengths[:, None]
    by_point = part.per_u + POINT_SHARES[:, None, None] * grows * part.per_x, part.per_x, part.rest
    bounding = (np.moveaxis(values, 0, 2) @ QUADRATIC_TO_BERNSTEIN for values in by_point)
    everywhere = _signed(part, *(values.reshape(len(part.lengths), -1) for values in bounding))
    everywhere = everywhere.that_bind(part.bounds[0])
    width = max(rows.a.shape[1], everywhere.a.shape[1])
    merged = []
    for own, fresh, nothing in zip(rows, everywhere, (0.0, 0.0, -1.0), strict=True):
        values = np.full((len(throughout), width), nothing)
        values[~throughout, : own.shape[1]] = own[~throughout]
        values[throughout, : fresh.shape[1]] = fresh
        merged.append(values)
    return LinearRows(*merged)


def _signed(limits: PathLimits, a: FloatArray, b: FloatArray, c: FloatArray) -> LinearRows:
    """Return |a u + b x + c| <= 1 and the bounds of x at the inner probes as rows."""
    bound, c = limits.bounds[1:-1].T, np.clip(c, -MOST_GRAVITY, MOST_GRAVITY)
    speeds = 2.0 * limits.lengths[:, None] * PROBES[1:-1] / bound, 1.0 / bound, np.full_like(bound, -1.0)
    signed = (a, b, c - 1.0), (-a, -b, -c - 1.0), speeds
    return LinearRows(*(np.hstack(parts) for parts in zip(*signed, strict=True)))


def _joined(long: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the long intervals each interval (intervals,) is solved with, and whether it lies next to rest.

    That is the next one, or the one before where the robot rests between it and the next.
    """
    groups = np.cumsum(rests[:-1])
    following = np.cumsum(long) - long
    has_next = np.append(groups[long], -1)[following] == groups
    has_one_before = np.append(-1, groups[long])[following] == groups
    return np.where(has_next, following, following - 1), ~(has_next & has_one_before)


def _units(
    lengths: FloatArray, rows: LinearRows, bounds: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Return the units of s' and s (intervals,), constant from rest to rest, that make x about 1.

    The tolerances of the solver are absolute. The unit of s' is the bound on the speed, or the speed reached from rest
    on half of the curve. The unit of s is the distance at that speed in 1 s, at most the curve: u is then about 1, too.
    """
    groups = np.cumsum(rests[:-1]) - 1
    with np.errstate(divide="ignore"):
        gains = 1.0 / np.abs(rows.a).max(axis=1)
    starts = np.flatnonzero(rests[:-1])
    bound, gain = (
        np.array([np.sort(part)[len(part) // 2] for part in np.split(values, starts[1:])])
        for values in (np.maximum(bounds[:-1], bounds[1:]), gains)
    )
    whole = np.bincount(groups, lengths)
    units = np.sqrt(np.minimum(bound, gain * whole))
    return units[groups], np.minimum(units, whole)[groups]
