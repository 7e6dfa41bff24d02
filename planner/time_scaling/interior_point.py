"""The core of a primal-dual interior-point method without slack variables, and the quadratic program it solves.

A program minimises f(x) where slacks s(x) > 0 are left of its limits. Each slack has a dual z > 0, and on the central
path s z = mu, the barrier, which goes to 0 at the optimum (Nocedal and Wright, Numerical Optimization, 2006, ch. 16.6
and 19). With the change of the duals eliminated, Newton's step towards a barrier mu solves

    (f'' + J^T (z / s) J) dx = -f' + J^T (mu / s)        J = ds / dx
    dz = mu / s - z - (z / s) J dx

f'' includes the curvature of the limits, weighted by their duals. How the first line is solved is for each program to
say, as its structure decides that: dense here, banded for the time law along a curve, block by block for the states at
which waypoints are passed. The rest is the same for all: the duals, the steps to the boundary, the next barrier.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.spatial import FloatArray

SHARE_TO_BOUNDARY = 0.98
"""Share of the way to where a slack or a dual vanishes that a step goes at most: the next step begins inside, too."""

QUADRATIC_SHARE_TO_BOUNDARY = 0.99
"""The same in a quadratic program, whose slacks are linear: a longer step costs none of its accuracy."""

QUADRATIC_CENTRING = 0.03
"""Share of the mean complementarity s z that is the next barrier of a quadratic program: little, as steps are long."""

MOST_QUADRATIC_STEPS = 25
"""Newton steps in one quadratic program; 8 to 12 are common."""

MOST_DENSE = 150
"""Number of variables from which on it pays to look for zeros in the matrix of a quadratic program."""

SPARSE = 0.1
"""Share of elements that are not zero, below which such a matrix counts as sparse."""


class NewtonTerms(NamedTuple):
    """The terms that the limits add to Newton's system, each of the shape of the slacks.

    Attributes:
        push: mu / s, the force of the barrier on each slack.
        stiffness: z / s, the derivative of that force.
    """

    push: FloatArray
    stiffness: FloatArray


class InteriorStep(NamedTuple):
    """The shares of a Newton step that can be made.

    Attributes:
        primal: Share of the step of x that keeps the slacks positive, to first order.
        dual: Share of the step of the duals that keeps them positive.
        dual_changes: The full step of the duals, of their shape.
    """

    primal: float
    dual: float
    dual_changes: FloatArray


@dataclass(frozen=True, eq=False)
class InteriorPoint:
    """Slacks of limits and their duals, all positive.

    Attributes:
        slacks: What is left of each limit, of any shape.
        duals: The multiplier of each limit, of the same shape.
    """

    slacks: FloatArray
    duals: FloatArray

    @classmethod
    def on_central_path(cls, slacks: FloatArray, barrier: float) -> InteriorPoint:
        """Return the point with these slacks at which each s z is the barrier."""
        return cls(slacks, barrier / slacks)

    @property
    def gap(self) -> float:
        """The sum of all s z: at most what a convex program's objective is above its optimum."""
        return float(np.einsum("i,i->", self.slacks.ravel(), self.duals.ravel()))

    def towards(self, barrier: float) -> NewtonTerms:
        """Return the terms of Newton's system for the point of the central path with a barrier."""
        return NewtonTerms(barrier / self.slacks, self.duals / self.slacks)

    def step(
        self, terms: NewtonTerms, slack_changes: FloatArray, share_to_boundary: float = SHARE_TO_BOUNDARY
    ) -> InteriorStep:
        """Limit the step when Newton's step of x changes the slacks by `slack_changes`, to first order."""
        dual_changes = terms.push - self.duals - terms.stiffness * slack_changes
        return InteriorStep(
            longest_step(self.slacks, slack_changes, share_to_boundary),
            longest_step(self.duals, dual_changes, share_to_boundary),
            dual_changes,
        )

    def moved(self, slacks: FloatArray, step: InteriorStep) -> InteriorPoint:
        """Return the next point: its slacks, which the program knows exactly, and its duals by the step."""
        return InteriorPoint(slacks, self.duals + step.dual * step.dual_changes)


def longest_step(values: FloatArray, changes: FloatArray, share_to_boundary: float = SHARE_TO_BOUNDARY) -> float:
    """Return the share of a step, at most 1, up to a share of the way to where a positive value is 0."""
    fastest = -float((changes / values).min(initial=0.0))
    return 1.0 if fastest <= share_to_boundary else share_to_boundary / fastest


def next_centring(made: float, least: float) -> float:
    """Return the share of the mean complementarity that is the next barrier.

    Args:
        made: Share of the last Newton step that could be made; the shorter of the primal and the dual one.
        least: The share after a full step.
    """
    return float(max(least, (1.0 - made) ** 0.5))


class QuadraticProgram(NamedTuple):
    """Minimise cost . x + curvature . x^2 / 2 where matrix x <= bounds and lower <= x <= upper.

    Attributes:
        cost: (variables,).
        curvature: (variables,), not negative: the diagonal of the second derivative.
        matrix: (limits, variables).
        bounds: (limits,).
        lower: (variables,), finite.
        upper: (variables,), finite and above the lower ones.
    """

    cost: FloatArray
    curvature: FloatArray
    matrix: FloatArray
    bounds: FloatArray
    lower: FloatArray
    upper: FloatArray

    def slacks(self, x: FloatArray) -> FloatArray:
        """Return the slacks (limits + 2 variables,) of the limits, of the lower and of the upper bounds."""
        return np.concatenate([self.bounds - self.matrix @ x, x - self.lower, self.upper - x])


def solve_quadratic_program(
    program: QuadraticProgram, start: FloatArray, is_solved: Callable[[FloatArray, float], bool]
) -> FloatArray:
    """Return the minimum (variables,), as near to it as is asked.

    Args:
        program: The program, in units in which cost and variables are about 1.
        start: (variables,), within all limits and bounds and on none of them.
        is_solved: Whether to stop, by x and about how far its objective is above the optimum.
    """
    variables, count = len(start), len(program.bounds)
    is_sparse = variables > MOST_DENSE and np.count_nonzero(program.matrix) < SPARSE * program.matrix.size
    newton_step = _sparse_newton_step(program.matrix) if is_sparse else _dense_newton_step(program.matrix)
    x, slacks = start, program.slacks(start)
    if not (slacks > 0.0).all():  # so far from 1 that rounding puts the start onto a limit
        return start
    limits, lower, upper = slice(count), slice(count, count + variables), slice(count + variables, None)
    point = InteriorPoint.on_central_path(slacks, 1.0 / len(slacks))
    for _ in range(MOST_QUADRATIC_STEPS):
        barrier = QUADRATIC_CENTRING * point.gap / len(slacks)
        terms = point.towards(barrier)
        push, stiffness = terms
        curvature = program.curvature + stiffness[lower] + stiffness[upper]
        slope = program.cost + program.curvature * x + program.matrix.T @ push[limits] - push[lower] + push[upper]
        try:
            change = newton_step(stiffness[limits], curvature, slope)
        except np.linalg.LinAlgError:  # the limits are too far from 1 for the numbers: it goes no nearer
            break
        slack_changes = np.concatenate([-(program.matrix @ change), change, -change])
        step = point.step(terms, slack_changes, QUADRATIC_SHARE_TO_BOUNDARY)
        x = x + step.primal * change
        point = point.moved(program.slacks(x), step)
        if is_solved(x, barrier * len(slacks)):
            break
    return x


def _dense_newton_step(matrix: FloatArray) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray]:
    """Solve (M^T D M + C) x = -g for the weights of D, the diagonal C and the slope g."""

    def step(weights: FloatArray, curvature: FloatArray, slope: FloatArray) -> FloatArray:
        hessian = (matrix.T * weights) @ matrix
        hessian.flat[:: len(hessian) + 1] += curvature
        return np.asarray(np.linalg.solve(hessian, -slope), dtype=np.float64)

    return step


def _sparse_newton_step(matrix: FloatArray) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray]:
    """Do the same where nearly all of M is zero, in a time that goes with what is not."""
    # Loaded by the first long program: importing the library stays quick.
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import spsolve

    rows = csr_array(matrix)

    def step(weights: FloatArray, curvature: FloatArray, slope: FloatArray) -> FloatArray:
        hessian = rows.T @ diags_array(weights) @ rows + diags_array(curvature)
        return np.asarray(spsolve(hessian.tocsc(), -slope, permc_spec="MMD_AT_PLUS_A"), dtype=np.float64)

    return step
