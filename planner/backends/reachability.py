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
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.kinematics.poses import FloatArray

PARALLEL = 1e-10
"""A limit whose coefficient of u is smaller, in units in which u is about 1, does not limit u."""

UNLIMITED = 1e8
"""Bound on u and x, in units in which they are about 1."""


def fastest_law(
    lengths: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray], most: FloatArray, rests: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """The squares of the speed x = s'^2 at the breakpoints, and the constant u = s'' between them.

    Args:
        lengths: (intervals,).
        limits: a, b and c, each (intervals, limits): a u + b x <= c, with x at the start of the interval; c > 0.
        most: (intervals + 1,), of x.
        rests: (intervals + 1,): where x is 0; both ends at least.

    Returns:
        x (intervals + 1,) and u (intervals,).
    """
    a, b, c = limits
    unit_x, unit_s = _units(lengths, a, b, c, most)
    # The first row is x + 2 d u <= (x at the next breakpoint), the second the same with -x - 2 d u <= 0.
    d = lengths[:, None] / unit_s
    one = np.ones_like(d)
    a = np.ascontiguousarray(np.hstack([2.0 * d, -2.0 * d, a * (unit_x / unit_s)]))
    b = np.ascontiguousarray(np.hstack([one, -one, b * unit_x]))
    c = np.ascontiguousarray(np.hstack([one, 0.0 * one, c]))
    most = np.where(rests, 0.0, np.minimum(most / unit_x, UNLIMITED))
    best = _backward(a, b, c, most)
    x, u = _forward(a, b, c, best)
    return x * unit_x, u * (unit_x / unit_s)


def _units(lengths: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, most: FloatArray) -> tuple[float, float]:
    """Units of x and s in which both, and u, are about 1: the solver's tolerances are absolute."""
    steepest = float(np.median((np.abs(a) / c).max(axis=1, initial=0.0)))
    x = float(np.median(np.minimum(most[:-1], 1.0 / np.maximum((b / c).max(axis=1, initial=0.0), 1e-300))))
    s = float(lengths.sum())
    return (min(x, s / steepest) if steepest > 0.0 else x), s


def _backward(a: FloatArray, b: FloatArray, c: FloatArray, most: FloatArray) -> FloatArray:
    """The largest x at each breakpoint that can be braked in time."""
    solve = _linear_program()
    best = np.zeros(len(most))
    upwards, active = np.array([0.0, 1.0, 0.0]), np.array([-1, -1])
    low, high = np.array([-UNLIMITED, 0.0]), np.array([UNLIMITED, 0.0])
    minus_c = -c
    for i in range(len(a) - 1, 0, -1):
        if most[i] == 0.0:
            continue
        minus_c[i, 0] = -best[i + 1]
        high[1] = most[i]
        feasible, _, optimum, tight = solve(upwards, a[i], b[i], minus_c[i], low, high, active)
        if feasible:
            best[i] = max(optimum[1], 0.0)
            active[0], active[1] = tight
    return best


def _forward(a: FloatArray, b: FloatArray, c: FloatArray, best: FloatArray) -> tuple[FloatArray, FloatArray]:
    """As fast as can be from breakpoint to breakpoint."""
    x, u = np.zeros(len(best)), np.zeros(len(a))
    c[:, 0] = best[1:]
    a = np.where(a > PARALLEL, a, np.nan)  # no upper bound on u: left out of the smallest ratio
    with np.errstate(invalid="ignore"):
        for i in range(len(a)):
            u[i] = np.fmin.reduce((c[i] - b[i] * x[i]) / a[i])
            x[i + 1] = min(max(x[i] + a[i, 0] * u[i], 0.0), best[i + 1])
    return x, u


@cache
def _linear_program() -> Callable[..., Any]:
    """`solve_lp2d` of toppra: Seidel's algorithm for two variables.

    The package imports scipy and matplotlib, 84 MB and 1.5 s, for parts that are not used here; its compiled solver
    needs neither, 0.4 MB and 2 ms. So the solver is loaded by itself, and what it imports from its package and never
    uses for a single program, an enumeration of constraints, is left empty.
    """
    name = "toppra.solverwrapper.cy_seidel_solverwrapper"
    if "toppra" in sys.modules:
        from toppra.solverwrapper import cy_seidel_solverwrapper

        return cy_seidel_solverwrapper.solve_lp2d
    package = find_spec("toppra")
    if package is None or package.origin is None:
        raise ImportError("toppra is not installed")
    folder = Path(package.origin).parent / "solverwrapper"
    file = next(path for suffix in EXTENSION_SUFFIXES if (path := folder / f"cy_seidel_solverwrapper{suffix}").exists())
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} cannot be loaded")
    stand_ins = {part: ModuleType(part) for part in ("toppra", "toppra.solverwrapper", "toppra.constraint")}
    for stand_in in stand_ins.values():
        stand_in.__path__ = []
    stand_ins["toppra.constraint"].ConstraintType = None
    sys.modules.update(stand_ins)
    try:
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        for part in stand_ins:
            del sys.modules[part]
    return module.solve_lp2d
