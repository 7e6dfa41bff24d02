"""The nonlinear program of a least-cost motion as CasADi expressions: a cubic B-spline in time under its limits.

Each joint is a cubic B-spline over the segments of a run, every segment in equal intervals: C2, with piecewise linear
acceleration and piecewise constant jerk. The coefficients of a B-spline and of its derivatives bound it (de Boor, A
Practical Guide to Splines, 2001, ch. IX and XI), so position, velocity, acceleration and jerk keep their limits
everywhere if the coefficients do. Torques are held, and the cost is summed, at the breakpoints; where the tool's
speed is limited, halfway between them, too. The first and the last three coefficients are the ends: rest, without
acceleration.

Unknown are the other coefficients and the durations of the segments. Lengths are measured by the run's largest travel,
times by its mean segment, so that motions of any size look alike to the solver. CasADi differentiates; the second
derivatives of the torques are put together by the chain rule from one function mapped over the instants, which
saves colouring the whole program for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import casadi as ca

    from planner.backends.effort_cost import Objective
    from planner.backends.effort_stage import Stage

RESTING = 3
"""Coefficients at each end that are the end position itself."""


class Layout(NamedTuple):
    """What a program is built for; motions of the same layout differ in numbers only.

    Attributes:
        segments: Passed without stopping.
        intervals: Of the spline on each segment.
        objective: What is minimised.
        watches_tool: Whether the tool's speed is limited.
    """

    segments: int
    intervals: int
    objective: Objective
    watches_tool: bool

    @property
    def instants(self) -> int:
        """At which torques, tool speeds and costs are looked at: the inner breakpoints; with the tool also halfway.

        A tool held at the breakpoints alone would hurry between them.
        """
        pieces = self.segments * self.intervals
        return 2 * pieces - 1 if self.watches_tool else pieces - 1


class Parameters:
    """Symbols of all numbers, in the order of `Program.solve`."""

    def __init__(self, layout: Layout, joints: int, watched: int) -> None:
        import casadi as ca

        pieces = layout.segments * layout.intervals
        self.end = ca.MX.sym("end", joints)
        self.units_of_length_and_time = ca.MX.sym("scale", 2)
        self.via = ca.MX.sym("via", joints, layout.segments - 1)
        # Reciprocals of limits, 0: none; of the coefficients of velocity, acceleration and jerk, and at the instants.
        self.velocity = ca.MX.sym("velocity", joints, pieces - 2)
        self.acceleration = ca.MX.sym("acceleration", joints, pieces - 1)
        self.jerk = ca.MX.sym("jerk", joints, pieces)
        self.watched = ca.MX.sym("watched", watched, layout.instants)
        self.units = ca.MX.sym("units", 2, joints)
        self.unit_of_jerk = ca.MX.sym("unit_of_jerk", joints)
        self.is_free = ca.MX.sym("is_free", layout.segments)
        self.time_weight = ca.MX.sym("time_weight")
        self.resting = ca.MX.sym("resting", 2)
        self.origin = ca.MX.sym("origin", joints)
        self.per_cost = ca.MX.sym("per_cost")

    @property
    def all(self) -> ca.MX:
        """One column."""
        import casadi as ca

        column: ca.MX = ca.veccat(*vars(self).values())
        return column


class Terms(NamedTuple):
    """The program by its unknowns x and parameters p, before its derivatives.

    Attributes:
        x: Coefficients, then durations.
        states: (3 joints + 1, instants), what the stage is a function of.
        smooth: The part of the cost that has nothing to do with torques.
        rest: Constraints that have nothing to do with torques: rates, waypoints, total duration.
        at_via: Those of the waypoints.
        motion: Position, velocity and acceleration at the breakpoints, jerk and length of the pieces.
    """

    x: ca.MX
    states: ca.MX
    smooth: ca.MX
    rest: ca.MX
    at_via: ca.MX
    motion: list[ca.MX]


def build_terms(layout: Layout, n: int, p: Parameters) -> Terms:
    """The unknowns of a motion of n joints, and what follows from them."""
    import casadi as ca

    pieces = layout.segments * layout.intervals
    x = ca.MX.sym("x", n * (pieces + 3 - 2 * RESTING) + layout.segments)
    durations = x[-layout.segments :]
    unknown = ca.reshape(x[: -layout.segments], n, -1)
    coefficients = ca.horzcat(ca.MX(n, RESTING), unknown, ca.repmat(p.end, 1, RESTING))
    length, unit_time = ca.vertsplit(p.units_of_length_and_time)
    h = ca.repmat(ca.kron(durations.T / layout.intervals, ca.DM.ones(1, layout.intervals)), n, 1)
    shape, *rates, bounds = _spline(coefficients, h)
    v, a, j = (rate * length / unit_time**order for order, rate in enumerate(rates, 1))
    bounds = bounds * length / unit_time
    q, h = shape * length, h[0, :] * unit_time

    share = 3.0 if layout.watches_tool else 1.0  # Simpson's rule, where there are instants between the breakpoints
    inner, stands_for = [q[:, 1:-1], v[:, 1:-1], a[:, 1:-1]], (h[:-1] + h[1:]) / 2.0 / share
    if layout.watches_tool:
        half = ca.repmat(h / 2.0, n, 1)
        middle = (
            q[:, :-1] + half * (v[:, :-1] + half * (a[:, :-1] / 2.0 + half * j / 6.0)),
            v[:, :-1] + half * (a[:, :-1] + half * j / 2.0),
            a[:, :-1] + half * j,
        )
        inner = [ca.horzcat(*pair) for pair in zip(inner, middle, strict=True)]
        stands_for = ca.horzcat(stands_for, h * 2.0 / 3.0)
    states = ca.vertcat(inner[0] + ca.repmat(p.origin, 1, layout.instants), *inner[1:], stands_for)
    ends = (p.resting[0] * h[0] + p.resting[1] * h[-1]) / 2.0 / share
    smooth = p.time_weight * ca.sum1(durations) * unit_time + ends
    if layout.objective == "jerk":
        smooth = smooth + ca.sum2(ca.sum1((j / ca.repmat(p.unit_of_jerk, 1, pieces)) ** 2) * h)
    at_via = ca.vec(shape[:, layout.intervals : -1 : layout.intervals] - p.via)
    rest = ca.veccat(bounds[:, 2:-2] * p.velocity, a[:, 1:-1] * p.acceleration, j * p.jerk)
    return Terms(x, states, smooth, ca.vertcat(rest, at_via, ca.dot(p.is_free, durations)), at_via, [q, v, a, j, h])


def with_derivatives(terms: Terms, parameters: Parameters, stage: Stage) -> dict[str, ca.Function]:
    """The program and the derivatives that the solver asks for, by the solver's names for them.

    With D the derivative of the states by x, blocks of the stage's derivatives at each instant are chained by D; the
    states' own second derivative is weighted by the stage's first.
    """
    import casadi as ca

    x, p = terms.x, parameters.all
    states, instants = terms.states.shape
    watched = parameters.watched.shape[0]
    at = (terms.states, ca.repmat(parameters.units, 1, instants))

    def blocks(values: ca.MX, rows: int) -> ca.MX:
        return ca.sparsity_cast(ca.vec(values), ca.diagcat(*[ca.Sparsity.dense(rows, states)] * instants))

    cost, used = stage.value.map(instants)(*at)
    f = (ca.sum2(cost) + terms.smooth) * parameters.per_cost
    g = ca.vertcat(ca.vec(used * parameters.watched), terms.rest)
    chain = ca.jacobian(ca.vec(terms.states), x)
    by_watched = stage.slopes.map(instants)(terms.states)
    by_cost = stage.gradient.map(instants)(*at)
    gradient = (ca.vec(by_cost).T @ chain + ca.jacobian(terms.smooth, x)) * parameters.per_cost
    of_watched = ca.diag(ca.vec(parameters.watched)) @ (blocks(by_watched, watched) @ chain)
    jacobian = ca.vertcat(of_watched, ca.jacobian(terms.rest, x))

    factor, multipliers = ca.MX.sym("factor"), ca.MX.sym("multipliers", g.numel())
    of_stage, of_rest = ca.vertsplit(multipliers, [0, watched * instants, g.numel()])
    weights = ca.reshape(of_stage, watched, instants) * parameters.watched
    second, first, stiffness, by_torques = stage.curvature.map(instants)(
        *at, ca.repmat(factor * parameters.per_cost, 1, instants), weights
    )
    of_torques = blocks(by_torques, stiffness.shape[0]) @ chain
    held = ca.MX.sym("held", states * instants)
    other = (
        factor * parameters.per_cost * terms.smooth + ca.dot(of_rest, terms.rest) + ca.dot(held, ca.vec(terms.states))
    )
    bent = ca.graph_substitute(ca.hessian(other, x)[0], [held], [ca.vec(first)])
    stiff = of_torques.T @ (ca.diag(ca.vec(stiffness)) @ of_torques)
    hessian = ca.triu(chain.T @ blocks(second, states) @ chain + stiff + bent)
    return {
        "value": ca.Function("value", [x, p], [f, g]),
        "grad_f": ca.Function("nlp_grad_f", [x, p], [f, gradient.T], ["x", "p"], ["f", "grad_f_x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l", [x, p, factor, multipliers], [hessian], ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
        ),
    }


def _spline(c: ca.MX, h: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX, ca.MX]:
    """Position, velocity and acceleration at the breakpoints, jerk between them, and the coefficients of velocity.

    Args:
        c: (joints, pieces + 3), coefficients of the cubic B-spline.
        h: (joints, pieces), lengths of the intervals, the same in each row; the first and last go on beyond the ends.
    """
    import casadi as ca

    pieces = h.shape[1]
    h = ca.horzcat(h[:, 0], h[:, 0], h, h[:, -1], h[:, -1])
    d = 3.0 * (c[:, 1:] - c[:, :-1]) / (h[:, : pieces + 2] + h[:, 1 : pieces + 3] + h[:, 2:])
    before, after = h[:, 1 : pieces + 2], h[:, 2 : pieces + 3]
    both = before + after
    a = 2.0 * (d[:, 1:] - d[:, :-1]) / both
    v = (d[:, :-1] * after + d[:, 1:] * before) / both
    q = c[:, 1:-1] + (d[:, 1:] * before**2 - d[:, :-1] * after**2) / (3.0 * both)
    j = (a[:, 1:] - a[:, :-1]) / h[:, 2:-2]
    return q, v, a, j, d
