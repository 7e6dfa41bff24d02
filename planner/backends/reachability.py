"""The fastest law along curves: reachability analysis, with the linear programs of the toppra package.

With x = s'^2 and u = s'' every limit is linear at a place, a u + b x <= c, and where u is constant over an interval
of length d, x grows by 2 d u. A backward pass finds the largest x at each breakpoint from which the rest can be
braked in time, a forward pass then accelerates as much as limits and that allow: Pham and Pham, "A New Approach to
Time-Optimal Path Parameterization Based on Reachability Analysis", IEEE Transactions on Robotics 34 (3), 2018.

As standing still keeps every limit, the smallest x that can be braked is always 0: one program an interval will do.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray

PARALLEL = 1e-10
"""A limit whose coefficient of u is smaller, in units in which u is about 1, does not limit u."""

MOST_SQUARE = 1e6
"""Bound on x, in units in which it is about 1."""


def fastest_law(
    lengths: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray], most: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """The largest squares of the speed, x = s'^2, at the breakpoints, and the constant u = s'' between them.

    Args:
        lengths: (intervals,).
        limits: a, b and c, each (intervals, limits): |a u + b x + c| <= 1 with x at an interval's start; |c| < 1.
        most: (intervals + 1,), of x.
        rests: (intervals + 1,): where x is 0; both ends at least.

    Returns:
        x (intervals + 1,) and u (intervals,).
    """
    a, b, c = limits
    # The solver's tolerances are absolute: units in which s, x and u are about 1.
    unit_s = float(lengths.sum())
    steepest = float(np.median(np.abs(a).max(axis=1, initial=0.0)))
    unit_x = min(float(np.median(most[:-1])), unit_s / steepest if steepest > 0.0 else np.inf)
    lengths, a, b = lengths / unit_s, a * (unit_x / unit_s), b * unit_x
    most = np.where(rests, 0.0, np.minimum(most / unit_x, MOST_SQUARE))
    best = _backward(lengths, _Limits(a, b, c, most))
    x, u = _forward(lengths, a, b, c, best)
    return x * unit_x, u * (unit_x / unit_s)


class _Limits:
    """What toppra asks of a path and its constraints."""

    identical = True

    def __init__(self, a: FloatArray, b: FloatArray, c: FloatArray, most: FloatArray) -> None:
        self.a, self.b, self.c, self.most = a, b, c, most

    def get_constraint_type(self) -> Any:
        """Linear in u and x."""
        return _solver().ConstraintType.CanonicalLinear

    def get_duration(self) -> float:
        """Length of the path."""
        return 1.0

    def compute_constraint_params(self, *_: Any) -> tuple[Any, ...]:
        """a, b, c, F, g, bounds on u and bounds on x with F (a u + b x + c) <= g, at every breakpoint."""
        a, b, c = (np.vstack([rows, rows[-1:]]) for rows in (self.a, self.b, self.c))
        signs = np.vstack([np.eye(a.shape[1]), -np.eye(a.shape[1])])
        return a, b, c, signs, np.ones(2 * a.shape[1]), None, np.column_stack([np.zeros_like(self.most), self.most])

    def coasting(self) -> FloatArray:
        """(intervals,): the largest x that the limits allow without u."""
        with np.errstate(divide="ignore"):
            allowed = ((1.0 - np.sign(self.b) * self.c) / np.abs(self.b)).min(axis=1, initial=np.inf)
        coasting: FloatArray = np.minimum(allowed, self.most[:-1])
        return coasting


def _backward(lengths: FloatArray, limits: _Limits) -> FloatArray:
    """The largest x at each breakpoint that can be braked in time."""
    solver = _solver().seidelWrapper([limits], limits, np.concatenate([[0.0], np.cumsum(lengths)]))
    solve, upwards, unbounded = solver.solve_stagewise_optim, np.array([0.0, -1.0]), float("nan")
    best = [0.0] * len(limits.most)
    moving, coasting = limits.most > 0.0, limits.coasting().tolist()
    for i in range(len(lengths) - 1, 0, -1):
        if moving[i]:
            x = solve(i, None, upwards, unbounded, unbounded, 0.0, best[i + 1])[1]
            # Where hardly any limit depends on u the solver may give up; without acceleration it goes on in any case.
            best[i] = x if x > 0.0 else min(best[i + 1], coasting[i])
    return np.array(best)


def _forward(
    lengths: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, best: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """As fast as can be from breakpoint to breakpoint."""
    slopes = np.hstack([a, -a])
    limits_u = slopes > PARALLEL
    divisors = np.where(limits_u, slopes, 1.0)
    # Each limit bounds u from above by `start` less `per_x` times x.
    start = np.where(limits_u, np.hstack([1.0 - c, 1.0 + c]) / divisors, np.inf)
    per_x = np.where(limits_u, np.hstack([b, -b]) / divisors, 0.0)
    x, u, smallest = [0.0], [], np.minimum.reduce
    for length, row, row_per_x, most in zip(2.0 * lengths, start, per_x, best[1:].tolist(), strict=True):
        now = x[-1]
        highest = float(smallest(row - row_per_x * now)) if len(row) else np.inf
        x.append(min(max(now + length * highest, 0.0), most))
        u.append((x[-1] - now) / length)
    return np.array(x), np.array(u)


@cache
def _solver() -> Any:
    """The module of toppra with Seidel's algorithm for linear programs of two variables.

    The package imports scipy and matplotlib, 84 MB and 1.5 s, for parts that are not used here; its compiled solver
    needs neither, 0.4 MB and 2 ms. So it is loaded by itself, with a stand-in for the one name that it imports from its
    package, an enumeration of the kinds of constraints.
    """
    name = "toppra.solverwrapper.cy_seidel_solverwrapper"
    if name in sys.modules:
        return sys.modules[name]
    package = find_spec("toppra")
    if package is None or package.origin is None:
        raise ImportError("toppra is not installed")
    folder = Path(package.origin).parent / "solverwrapper"
    file = next(path for suffix in EXTENSION_SUFFIXES if (path := folder / f"cy_seidel_solverwrapper{suffix}").exists())
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} cannot be loaded")
    stand_ins: dict[str, Any] = {
        part: ModuleType(part) for part in ("toppra", "toppra.solverwrapper", "toppra.constraint")
    }
    for stand_in in stand_ins.values():
        stand_in.__path__ = []
    stand_ins["toppra.constraint"].ConstraintType = SimpleNamespace(CanonicalLinear="linear")
    sys.modules.update(stand_ins)
    try:
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        for part in stand_ins:
            del sys.modules[part]
    return module
