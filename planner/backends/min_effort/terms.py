"""The nonlinear program of a least-cost motion as CasADi expressions: a cubic B-spline in time under its limits.

Each joint is a cubic B-spline over the segments of a run, every segment in equal intervals: C2, with piecewise linear
acceleration and piecewise constant jerk. The coefficients of a B-spline and of its derivatives bound it (de Boor, A
Practical Guide to Splines, 2001, ch. IX and XI), so position, velocity, acceleration and jerk keep their limits
everywhere if the coefficients do. Torques are held, and the cost is summed, at the breakpoints; the tool's speed, which
is cheaper to know and would rise between them, at shares of the intervals, too. The first and the last three
coefficients are the ends: rest, without acceleration.

Unknown are the other coefficients and the durations of the segments. Lengths are measured by the run's largest travel,
times by its mean segment, so that motions of any size look alike to the solver. CasADi differentiates; the second
derivatives of the torques are put together by the chain rule from one function mapped over the instants, which
saves colouring the whole program for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import casadi as ca

    from planner.backends.min_effort.cost import Objective
    from planner.backends.min_effort.stage import Stage, ToolStage

RESTING = 3
"""Coefficients at each end that are the end position itself."""

TOOL_SHARES = (0.25, 0.5, 0.75)
"""Shares of an interval at which the tool's speed is held."""


class Layout(NamedTuple):
    """The layout that a program is built for; motions of the same layout differ in numbers only.

    Attributes:
        segments: Number of segments that are passed without stopping.
        intervals: Number of intervals of the spline on each segment.
        objective: The cost that is minimised.
        watches_tool: Whether the tool's speed is limited.
    """

    segments: int
    intervals: int
    objective: Objective
    watches_tool: bool

    @property
    def instants(self) -> int:
        """The number of instants at which torques and costs are computed: the inner breakpoints."""
        return self.segments * self.intervals - 1

    @property
    def tool_instants(self) -> int:
        """The number of those of the tool's speed: the inner breakpoints, then the shares of every interval."""
        return self.instants + len(TOOL_SHARES) * (self.instants + 1) if self.watches_tool else 0


class Parameters:
    """Symbols of all numbers, in the order of `Program.solve`."""

    def __init__(self, layout: Layout, joints: int) -> None:
        import casadi as ca

        pieces = layout.segments * layout.intervals
        self.end = ca.MX.sym("end", joints)
        self.units_of_length_and_time = ca.MX.sym("scale", 2)
        self.via = ca.MX.sym("via", joints, layout.segments - 1)
        # Reciprocals of limits, 0: none; of the coefficients of velocity, acceleration and jerk, and at the instants.
        self.velocity = ca.MX.sym("velocity", joints, pieces - 2)
        self.acceleration = ca.MX.sym("acceleration", joints, pieces - 1)
        self.jerk = ca.MX.sym("jerk", joints, pieces)
        self.torque = ca.MX.sym("torque", joints, layout.instants)
        self.tool = ca.MX.sym("tool", 2, layout.tool_instants)
        self.units = ca.MX.sym("units", 2, joints)
        self.unit_of_jerk = ca.MX.sym("unit_of_jerk", joints)
        self.is_free = ca.MX.sym("is_free", layout.segments)
        self.time_weight = ca.MX.sym("time_weight")
        self.resting = ca.MX.sym("resting", 2)
        self.origin = ca.MX.sym("origin", joints)
        self.per_cost = ca.MX.sym("per_cost")

    @property
    def all(self) -> ca.MX:
        """All symbols in one column."""
        import casadi as ca

        column: ca.MX = ca.veccat(*vars(self).values())
        return column


class Terms(NamedTuple):
    """The program by its unknowns x and parameters p, before its derivatives.

    Attributes:
        x: Coefficients, then durations.
        states: (3 joints + 1, instants), what the stage is a function of.
        tool_states: (2 joints, tool instants), what that of the tool is.
        smooth: The part of the cost that has nothing to do with torques.
        rest: Constraints that have nothing to do with torques and the tool: rates, waypoints, total duration.
        at_via: Those of the waypoints.
        motion: Position, velocity and acceleration at the breakpoints, jerk and length of the pieces.
    """

    x: ca.MX
    states: ca.MX
    tool_states: ca.MX
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

    half = (h[:-1] + h[1:]) / 2.0
    origins = ca.repmat(p.origin, 1, layout.instants)
    states = ca.vertcat(q[:, 1:-1] + origins, v[:, 1:-1], a[:, 1:-1], half)
    tool_states = ca.MX(2 * n, 0)
    if layout.watches_tool:
        positions, speeds = [q[:, 1:-1]], [v[:, 1:-1]]
        for share in TOOL_SHARES:
            t = ca.repmat(share * h, n, 1)
            positions.append(q[:, :-1] + t * (v[:, :-1] + t * (a[:, :-1] / 2.0 + t * j / 6.0)))
            speeds.append(v[:, :-1] + t * (a[:, :-1] + t * j / 2.0))
        origins = ca.repmat(p.origin, 1, layout.tool_instants)
        tool_states = ca.vertcat(ca.horzcat(*positions) + origins, ca.horzcat(*speeds))
    ends = (p.resting[0] * h[0] + p.resting[1] * h[-1]) / 2.0
    smooth = p.time_weight * ca.sum1(durations) * unit_time + ends
    if layout.objective == "jerk":
        smooth = smooth + ca.sum2(ca.sum1((j / ca.repmat(p.unit_of_jerk, 1, pieces)) ** 2) * h)
    at_via = ca.vec(shape[:, layout.intervals : -1 : layout.intervals] - p.via)
    rest = ca.veccat(bounds[:, 2:-2] * p.velocity, a[:, 1:-1] * p.acceleration, j * p.jerk)
    return Terms(
        x, states, tool_states, smooth, ca.vertcat(rest, at_via, ca.dot(p.is_free, durations)), at_via, [q, v, a, j, h]
    )


def with_derivatives(
    terms: Terms, parameters: Parameters, stage: Stage, tool: ToolStage | None
) -> dict[str, ca.Function]:
    """Build the program and the derivatives that the solver needs, by the solver's names for them.

    With D the derivative of the states by x, blocks of the stage's derivatives at each instant are chained by D; the
    states' own second derivative is weighted by the stage's first.
    """
    import casadi as ca

    x, p = terms.x, parameters.all
    joints, instants = parameters.torque.shape
    at = (terms.states, ca.repmat(parameters.units, 1, instants))

    cost, torques = stage.value.map(instants)(*at)
    f = (ca.sum2(cost) + terms.smooth) * parameters.per_cost
    chain = ca.jacobian(ca.vec(terms.states), x)
    gradient = (
        ca.vec(stage.gradient.map(instants)(*at)).T @ chain + ca.jacobian(terms.smooth, x)
    ) * parameters.per_cost
    uses = [ca.vec(torques * parameters.torque)]
    slopes = [_scaled(parameters.torque, _blocks(stage.slopes.map(instants)(terms.states), joints, instants) @ chain)]
    if tool is not None:
        tool_instants = parameters.tool.shape[1]
        tool_chain = ca.jacobian(ca.vec(terms.tool_states), x)
        by_tool = _blocks(tool.slopes.map(tool_instants)(terms.tool_states), 2, tool_instants)
        uses.append(ca.vec(tool.value.map(tool_instants)(terms.tool_states) * parameters.tool))
        slopes.append(_scaled(parameters.tool, by_tool @ tool_chain))
    g = ca.vertcat(*uses, terms.rest)
    jacobian = ca.vertcat(*slopes, ca.jacobian(terms.rest, x))

    factor, multipliers = ca.MX.sym("factor"), ca.MX.sym("multipliers", g.numel())
    starts = [0, joints * instants, joints * instants + parameters.tool.numel(), g.numel()]
    of_torques, of_tool, of_rest = ca.vertsplit(multipliers, starts)
    second, first, stiffness, by_torques = stage.curvature.map(instants)(
        *at,
        ca.repmat(factor * parameters.per_cost, 1, instants),
        ca.reshape(of_torques, joints, instants) * parameters.torque,
    )
    bending = chain.T @ _blocks(second, second.shape[0], instants) @ chain
    stiff = _blocks(by_torques, joints, instants) @ chain
    bending = bending + stiff.T @ (ca.diag(ca.vec(stiffness)) @ stiff)
    other = factor * parameters.per_cost * terms.smooth + ca.dot(of_rest, terms.rest)
    held = {"held": (terms.states, first)}
    if tool is not None:
        weights = ca.reshape(of_tool, 2, tool_instants) * parameters.tool
        second, first = tool.curvature.map(tool_instants)(terms.tool_states, weights)
        bending = bending + tool_chain.T @ _blocks(second, second.shape[0], tool_instants) @ tool_chain
        held["tool_held"] = (terms.tool_states, first)
    symbols = {name: ca.MX.sym(name, states.numel()) for name, (states, _) in held.items()}
    for name, (states, _) in held.items():
        other = other + ca.dot(symbols[name], ca.vec(states))
    firsts = [ca.vec(first) for _, first in held.values()]
    bent = ca.graph_substitute(ca.hessian(other, x)[0], list(symbols.values()), firsts)
    hessian = ca.triu(bending + bent)
    return {
        "value": ca.Function("value", [x, p], [f, g]),
        "grad_f": ca.Function("nlp_grad_f", [x, p], [f, gradient.T], ["x", "p"], ["f", "grad_f_x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l", [x, p, factor, multipliers], [hessian], ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
        ),
    }


def _blocks(values: ca.MX, rows: int, instants: int) -> ca.MX:
    """Matrices of so many rows, one beside the other in the values, as the blocks of a diagonal."""
    import casadi as ca

    columns = values.numel() // (rows * instants)
    return ca.sparsity_cast(ca.vec(values), ca.diagcat(*[ca.Sparsity.dense(rows, columns)] * instants))


def _scaled(factors: ca.MX, rows: ca.MX) -> ca.MX:
    """Each row times its factor."""
    import casadi as ca

    return ca.diag(ca.vec(factors)) @ rows


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
