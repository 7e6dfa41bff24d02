"""The cost and the limits at one instant as CasADi functions, with their first and second derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from planner.backends.last_used import LastUsed
from planner.dynamics.symbolic import dynamics_content, symbolic_motion

if TYPE_CHECKING:
    import casadi as ca

    from planner.backends.effort_cost import Objective
    from planner.robots import Robot

CACHED_STAGES = 4
"""Kept in a worker: most of the time that a program takes to build goes into its stage."""

SMOOTHING = 1e-3
"""Of a joint's largest power: how far the magnitude of its power is rounded where it changes its sign."""


class Stage(NamedTuple):
    """Functions of the state z = (positions, velocities, accelerations, weight), (3 joints + 1,).

    The weight is the time that the instant stands for, so that cost times weight is its share of an integral.

    Attributes:
        value: (z, units) -> weighted cost, and the watched: torques (joints,), then the squares of the tool's speeds
            (m^2/s^2, rad^2/s^2) if asked.
        gradient: (z, units) -> derivative of the weighted cost (states,).
        slopes: (z) -> derivative of the watched (watched, states).
        curvature: (z, units, cost factor, multipliers of the watched) -> second derivative (states, states) of the
            sum but for J' D J, its first (states,), D's diagonal (joints,), and J, slopes of the torques (joints,
            states).
    """

    value: ca.Function
    gradient: ca.Function
    slopes: ca.Function
    curvature: ca.Function


_stages: LastUsed[Stage] = LastUsed(CACHED_STAGES)


def stage_of(robot: Robot, objective: Objective, watches_tool: bool) -> Stage:
    """The functions of a robot with its payload, built when first asked for."""
    key = (dynamics_content(robot), objective, watches_tool)
    return _stages.get(key, lambda: build_stage(robot, objective, watches_tool))


def build_stage(robot: Robot, objective: Objective, watches_tool: bool) -> Stage:
    """The functions of a robot with its payload.

    `units` (2, joints) are what torque and power of each joint are measured by. The cost is the sum over the joints of
    (torque / unit)^2 for `effort`, of |torque x velocity| / unit for `mechanical_work`, none for `jerk`.
    """
    import casadi as ca

    n = robot.dof
    z, units, factor = ca.SX.sym("z", 3 * n + 1), ca.SX.sym("units", 2, n), ca.SX.sym("factor")
    q, v, a, weight = ca.vertsplit(z, [0, n, 2 * n, 3 * n, 3 * n + 1])
    motion = symbolic_motion(robot, q, v, a) if robot.has_dynamics else None
    watched = ca.densify(ca.SX(n, 1) if motion is None else motion.torques)
    torques = ca.SX.sym("torques", n)
    scaled = {
        "effort": lambda: ca.sumsqr(torques / units[0, :].T),
        "mechanical_work": lambda: ca.sum1(ca.sqrt((torques * v / units[1, :].T) ** 2 + SMOOTHING**2) - SMOOTHING),
        "jerk": lambda: ca.SX(0),
    }
    of_torques = weight * scaled[objective]()
    if watches_tool:
        tool = symbolic_motion(robot, q, v, a)
        watched = ca.vertcat(watched, ca.sumsqr(tool.tool_velocity), ca.sumsqr(tool.tool_spin))
    cost = ca.substitute(of_torques, torques, watched[:n])
    multipliers = ca.SX.sym("multipliers", watched.numel())

    # With y = dL/dtorques held, the second derivative of L(torques(z), z) is that of y' torques plus J' L'' J: half the
    # operations of differentiating the whole twice. The part of L'' by torques alone is a diagonal: J' and J are
    # multiplied for all instants at once, by the caller.
    seeds = ca.SX.sym("seeds", watched.numel())
    slopes = ca.jacobian(watched, z)
    bent = ca.hessian(ca.dot(seeds, watched), z)[0]
    own = factor * of_torques
    second, first = ca.hessian(own, ca.vertcat(torques, z))
    second, first = (ca.substitute([expression], [torques], [watched[:n]])[0] for expression in (second, first))
    held = multipliers + ca.vertcat(first[:n], ca.SX(watched.numel() - n, 1))
    crossed = slopes[:n, :].T @ second[:n, n:]
    hessian = second[n:, n:] + crossed + crossed.T + ca.substitute([bent], [seeds], [held])[0]
    gradient = first[n:] + slopes.T @ held
    arguments: list[Any] = [z, units]
    return Stage(
        ca.Function("value", arguments, [cost, watched], {"cse": True}),
        ca.Function("gradient", arguments, [ca.densify(ca.gradient(cost, z))], {"cse": True}),
        ca.Function("slopes", [z], [ca.densify(slopes)], {"cse": True}),
        ca.Function(
            "curvature",
            [*arguments, factor, multipliers],
            [ca.densify(hessian), ca.densify(gradient), ca.densify(ca.diag(second[:n, :n])), ca.densify(slopes[:n, :])],
            {"cse": True},
        ),
    )
