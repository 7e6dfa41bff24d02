"""The nonlinear program of a least-cost motion as CasADi expressions: a cubic B-spline in time under its limits.

Each joint is a cubic B-spline over the segments of a group, every segment in equal intervals. It is C2, with piecewise
linear acceleration and piecewise constant jerk. The coefficients of a B-spline and of its derivatives bound it (de
Boor, A Practical Guide to Splines, 2001, ch. IX and XI). So position, velocity, acceleration and jerk keep their limits
at all times if the coefficients do. The program limits torques, and sums the cost, at the breakpoints. The tool's speed
is cheaper to compute and can rise between breakpoints, so the program limits it inside the intervals, too. The same
instants count for a limited deviation from a path. The first and the last three coefficients are fixed: the motion
starts and ends at rest, without acceleration.

The unknowns are the other coefficients and the durations of the segments. The unit of length is the group's largest
travel, that of time its mean segment: motions of any size look alike to the solver. CasADi differentiates. The chain
rule builds the second derivatives of the torques from one function mapped over the instants. So CasADi need not colour
the whole program for them.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import casadi as ca

from planner.backends.min_effort.numbers import TOOL_SHARES, Layout
from planner.backends.min_effort.stage import RowStage, Stage

RESTING = 3
"""Coefficients at each end that are the end position itself."""


class Parameters:
    """Symbols of all numbers, in the order of `Program.solve`."""

    def __init__(self, layout: Layout, joints: int) -> None:
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
        self.near = ca.MX.sym("near", layout.holds_tool + joints * layout.holds_joints + 1, layout.path_instants)
        self.reference = ca.MX.sym("way", 3 * joints + 1, layout.path_instants)
        self.half_spaces = ca.MX.sym("half_spaces", layout.half_spaces * (joints + 1), layout.dense_instants)
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
        column: ca.MX = ca.veccat(*vars(self).values())
        return column


class Terms(NamedTuple):
    """The program by its unknowns x and parameters p, before its derivatives.

    Attributes:
        x: Coefficients, then durations.
        states: (3 joints + 1, instants), the arguments of the stage.
        tool_states: (2 joints, tool instants), the arguments of the tool's stage.
        path_states: (joints, path instants), the arguments of the path's stage.
        smooth: The part of the cost that is independent of torques.
        rest: Constraints independent of torques, the tool and the path: rates, half-spaces (1 at their rims, less
            inside), waypoints, total duration.
        at_via: The constraints of the waypoints.
        motion: Position, velocity and acceleration at the breakpoints, jerk and length of the pieces.
    """

    x: ca.MX
    states: ca.MX
    tool_states: ca.MX
    path_states: ca.MX
    smooth: ca.MX
    rest: ca.MX
    at_via: ca.MX
    motion: list[ca.MX]


def build_terms(layout: Layout, n: int, p: Parameters) -> Terms:
    """Return the unknowns of a motion of n joints, and what follows from them."""
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
    positions, speeds = [q[:, 1:-1]], [v[:, 1:-1]]
    for share in TOOL_SHARES:
        t = ca.repmat(share * h, n, 1)
        positions.append(q[:, :-1] + t * (v[:, :-1] + t * (a[:, :-1] / 2.0 + t * j / 6.0)))
        speeds.append(v[:, :-1] + t * (a[:, :-1] + t * j / 2.0))
    all_positions = ca.horzcat(*positions)
    all_positions = all_positions + ca.repmat(p.origin, 1, all_positions.shape[1])
    tool_states = ca.vertcat(all_positions, ca.horzcat(*speeds))[:, : layout.tool_instants]
    path_states = all_positions[:, : layout.path_instants]
    ends = (p.resting[0] * h[0] + p.resting[1] * h[-1]) / 2.0
    smooth = p.time_weight * ca.sum1(durations) * unit_time + ends
    if layout.objective == "jerk" or layout.adds_jerk:
        smooth = smooth + ca.sum2(ca.sum1((j / ca.repmat(p.unit_of_jerk, 1, pieces)) ** 2) * h)
    at_via = ca.vec(shape[:, layout.intervals : -1 : layout.intervals] - p.via)
    rest = ca.veccat(bounds[:, 2:-2] * p.velocity, a[:, 1:-1] * p.acceleration, j * p.jerk)
    half_spaces = ca.vertsplit(p.half_spaces, n + 1) if layout.half_spaces else []
    inside = [ca.sum1(own[:n, :] * all_positions) - own[n, :] for own in half_spaces]
    rest = ca.vertcat(rest, *[1.0 - depth.T / length for depth in inside], at_via, ca.dot(p.is_free, durations))
    return Terms(x, states, tool_states, path_states, smooth, rest, at_via, [q, v, a, j, h])


class Rows(NamedTuple):
    """Rows of limited values at instants.

    Attributes:
        stage: The functions of a state that are limited.
        states: The states (states, instants).
        constants: Their constants (constants, instants).
        scales: The reciprocals (rows, instants) of the limits.
    """

    stage: RowStage
    states: ca.MX
    constants: ca.MX
    scales: ca.MX


def with_derivatives(terms: Terms, parameters: Parameters, stage: Stage, limited: list[Rows]) -> dict[str, ca.Function]:
    """Build the program and the derivatives that the solver needs, by the solver's names for them.

    Its constraints are the torques, the rows, and the rest.

    D is the derivative of the states by x. It chains the blocks of the stage's derivatives at each instant. The stage's
    first derivative weights the states' own second derivative.
    """
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
    chains = [ca.jacobian(ca.vec(rows.states), x) for rows in limited]
    for rows, own_chain in zip(limited, chains, strict=True):
        count, own_instants = rows.scales.shape
        by_state = rows.stage.slopes.map(own_instants)(rows.states, rows.constants)
        uses.append(ca.vec(rows.stage.value.map(own_instants)(rows.states, rows.constants) * rows.scales))
        slopes.append(_scaled(rows.scales, _blocks(by_state, count, own_instants) @ own_chain))
    g = ca.vertcat(*uses, terms.rest)
    jacobian = ca.vertcat(*slopes, ca.jacobian(terms.rest, x))

    factor, multipliers = ca.MX.sym("factor"), ca.MX.sym("multipliers", g.numel())
    counts = [joints * instants, *(rows.scales.numel() for rows in limited), terms.rest.numel()]
    of_torques, *of_rows, of_rest = ca.vertsplit(multipliers, [0, *accumulate(counts)])
    second, first, stiffness, by_torques = stage.curvature.map(instants)(
        *at,
        ca.repmat(factor * parameters.per_cost, 1, instants),
        ca.reshape(of_torques, joints, instants) * parameters.torque,
    )
    bending = chain.T @ _blocks(second, second.shape[0], instants) @ chain
    stiff = _blocks(by_torques, joints, instants) @ chain
    bending = bending + stiff.T @ (ca.diag(ca.vec(stiffness)) @ stiff)
    other = factor * parameters.per_cost * terms.smooth + ca.dot(of_rest, terms.rest)
    held = [(terms.states, first)]
    for rows, own_chain, own_multipliers in zip(limited, chains, of_rows, strict=True):
        count, own_instants = rows.scales.shape
        weights = ca.reshape(own_multipliers, count, own_instants) * rows.scales
        second, first = rows.stage.curvature.map(own_instants)(rows.states, rows.constants, weights)
        bending = bending + own_chain.T @ _blocks(second, second.shape[0], own_instants) @ own_chain
        held.append((rows.states, first))
    symbols = [ca.MX.sym("held", states.numel()) for states, _ in held]
    for symbol, (states, _) in zip(symbols, held, strict=True):
        other = other + ca.dot(symbol, ca.vec(states))
    firsts = [ca.vec(first) for _, first in held]
    bent = ca.graph_substitute(ca.hessian(other, x)[0], symbols, firsts)
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
    """Arrange matrices, which stand side by side in the values, as the blocks of a diagonal."""
    columns = values.numel() // (rows * instants)
    return ca.sparsity_cast(ca.vec(values), ca.diagcat(*[ca.Sparsity.dense(rows, columns)] * instants))


def _scaled(factors: ca.MX, rows: ca.MX) -> ca.MX:
    """Multiply each row by its factor."""
    return ca.diag(ca.vec(factors)) @ rows


def _spline(c: ca.MX, h: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX, ca.MX]:
    """Return position, velocity, acceleration at the breakpoints, jerk between them, and velocity coefficients.

    Args:
        c: (joints, pieces + 3), coefficients of the cubic B-spline.
        h: (joints, pieces), lengths of the intervals, the same in each row; the first and last continue beyond the
            ends.
    """
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
