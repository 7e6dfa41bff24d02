"""The core of a primal-dual interior-point method without slack variables.

A program minimises f(x) where slacks s(x) > 0 are left of its limits. Each slack has a dual z > 0, and on the central
path s z = mu, the barrier, which goes to 0 at the optimum (Nocedal and Wright, Numerical Optimization, 2006, ch. 16.6
and 19). With the change of the duals eliminated, Newton's step towards a barrier mu solves

    (f'' + J^T (z / s) J) dx = -f' + J^T (mu / s)        J = ds / dx
    dz = mu / s - z - (z / s) J dx

f'' includes the curvature of the limits, weighted by their duals. How the first line is solved is for each program to
say, as its structure decides that: banded for the time law along a curve, block by block for the states at which
waypoints are passed. The rest is the same for all: the duals, the steps to the boundary, the next barrier.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

SHARE_TO_BOUNDARY = 0.98
"""Share of the way to where a slack or a dual vanishes that a step goes at most: the next step begins inside, too."""


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
