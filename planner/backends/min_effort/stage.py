"""The cost and the limits at one instant as CasADi functions, with their first and second derivatives."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

from planner.backends.min_effort.cost import SMOOTHING, Objective
from planner.dynamics.symbolic import dynamics_content, symbolic_motion, symbolic_tool_position
from planner.last_used import LastUsed
from planner.robots import Robot

BYTES_PER_INSTRUCTION = 90
"""Memory of a CasADi function by its number of instructions, bytes: measured 60 to 90, with six and seven joints."""

STAGE_BYTES = 2**24
"""Memory of the stages that a process keeps, bytes: the stages of about eight robots with six joints."""


class Stage(NamedTuple):
    """Functions of the state z = (positions, velocities, accelerations, weight), (3 joints + 1,).

    The weight is the time of the instant in the integral: cost times weight is its share.

    Attributes:
        value: (z, units) -> weighted cost, and the torques (joints,).
        gradient: (z, units) -> derivative of the weighted cost (states,).
        slopes: (z) -> derivative of the torques (joints, states).
        curvature: (z, units, cost factor, multipliers of the torques) -> derivatives of the sum without J' D J: the
            second (states, states) and the first (states,). Then D's diagonal (joints,), and J (joints, states), the
            slopes of the torques.
    """

    value: ca.Function
    gradient: ca.Function
    slopes: ca.Function
    curvature: ca.Function


class RowStage(NamedTuple):
    """Functions of a state z and constants c whose values, the rows, are limited.

    Attributes:
        value: (z, c) -> the rows (rows,).
        slopes: (z, c) -> their derivative (rows, states).
        curvature: (z, c, multipliers of them) -> second derivative of their sum (states, states), and its first
            (states,).
    """

    value: ca.Function
    slopes: ca.Function
    curvature: ca.Function


def _bytes_of(stage: Stage | RowStage) -> int:
    """Return the memory that the functions take, about."""
    return BYTES_PER_INSTRUCTION * sum(function.n_instructions() for function in stage)


_stages: LastUsed[Stage] = LastUsed(STAGE_BYTES, _bytes_of)
_row_stages: LastUsed[RowStage] = LastUsed(STAGE_BYTES, _bytes_of)


def stage_of(robot: Robot, objective: Objective) -> Stage:
    """Return the functions of a robot with its payload, built at first use."""
    return _stages.get((dynamics_content(robot), objective), lambda: build_stage(robot, objective))


def tool_stage_of(robot: Robot) -> RowStage:
    """Return the squares of the tool's speeds (2,), m^2/s^2 and rad^2/s^2, by positions and velocities (2 joints,)."""
    return _row_stages.get(dynamics_content(robot), lambda: _build_tool_stage(robot))


def _build_tool_stage(robot: Robot) -> RowStage:
    n = robot.dof
    z = ca.SX.sym("z", 2 * n)
    tool = symbolic_motion(robot, z[:n], z[n:], ca.SX(n, 1))
    return _build_row_stage(ca.vertcat(ca.sumsqr(tool.tool_velocity), ca.sumsqr(tool.tool_spin)), z, ca.SX(0, 1))


def path_stage_of(robot: Robot, holds_tool: bool, holds_joints: bool) -> RowStage:
    """Build the distance of a joint position (joints,) from a path: the tool's squared, m^2, then each joint's.

    The joint position is compared with the one at a share u of the path, which is linear in it. The last row is
    2 u - 1, which goes from -1 to 1 on the path. The constants are joint positions (joints,) on the path and their
    share. Then follow the derivative (joints,) of the path by u, and that (joints,) of u by the joint position.

    Args:
        robot: The robot, with its tool.
        holds_tool: Whether the tool's distance is a row.
        holds_joints: Whether the joints' distances, rad or m, are rows.
    """
    key = dynamics_content(robot), holds_tool, holds_joints
    return _row_stages.get(key, lambda: _build_path_stage(robot, holds_tool, holds_joints))


def _build_path_stage(robot: Robot, holds_tool: bool, holds_joints: bool) -> RowStage:
    n = robot.dof
    q, known, known_u, slope, gradient = (ca.SX.sym("way", size) for size in (n, n, 1, n, n))
    beyond, seeds, share = ca.dot(gradient, q - known), ca.SX.sym("seeds", 3), ca.SX.sym("share")
    on_path = known + slope * beyond
    away = symbolic_tool_position(robot, q) - symbolic_tool_position(robot, on_path)
    rows = [ca.sumsqr(away)] * holds_tool + [q - on_path] * holds_joints
    rows.append(2.0 * (known_u + beyond) - 1.0)

    # The chain rule with the distance as seeds takes two thirds of the operations of differentiating its square.
    slopes, bent = ca.jacobian(away, q), ca.hessian(ca.dot(seeds, symbolic_tool_position(robot, q)), q)[0]
    on_path_bent = ca.hessian(ca.dot(seeds, symbolic_tool_position(robot, known + slope * share)), share)[0]
    held = ca.substitute([bent, on_path_bent], [seeds, share], [away, beyond])
    bending = 2.0 * (slopes.T @ slopes + held[0] - held[1] * gradient @ gradient.T)
    constants = ca.vertcat(known, known_u, slope, gradient)
    return _build_row_stage(ca.vertcat(*rows), q, constants, bending if holds_tool else None)


def _build_row_stage(rows: ca.SX, z: ca.SX, constants: ca.SX, bending: ca.SX | None = None) -> RowStage:
    """Return the functions of rows, given the second derivative of the first one where the others are linear."""
    multipliers = ca.SX.sym("multipliers", rows.numel())
    hessian, gradient = ca.hessian(ca.dot(multipliers, rows), z)
    if bending is not None:
        hessian = multipliers[0] * bending
    at = [z, constants]
    return RowStage(
        ca.Function("rows", at, [rows], {"cse": True}),
        ca.Function("slopes", at, [ca.densify(ca.jacobian(rows, z))], {"cse": True}),
        ca.Function("curvature", [*at, multipliers], [ca.densify(hessian), ca.densify(gradient)], {"cse": True}),
    )


def build_stage(robot: Robot, objective: Objective) -> Stage:
    """Return the functions of a robot with its payload.

    `units` (2, joints) are what torque and power of each joint are measured by. The cost is the sum over the joints of
    (torque / unit)^2 for `effort`, of |torque x velocity| / unit for `mechanical_work`, none for `jerk`.
    """
    n = robot.dof
    z, units, factor = ca.SX.sym("z", 3 * n + 1), ca.SX.sym("units", 2, n), ca.SX.sym("factor")
    q, v, a, weight = ca.vertsplit(z, [0, n, 2 * n, 3 * n, 3 * n + 1])
    by_motion = ca.densify(symbolic_motion(robot, q, v, a).torques if robot.has_dynamics else ca.SX(n, 1))
    torques = ca.SX.sym("torques", n)
    scaled = {
        "effort": lambda: ca.sumsqr(torques / units[0, :].T),
        "mechanical_work": lambda: ca.sum1(ca.sqrt((torques * v / units[1, :].T) ** 2 + SMOOTHING**2) - SMOOTHING),
        "jerk": lambda: ca.SX(0),
    }
    of_torques = weight * scaled[objective]()
    cost = ca.substitute(of_torques, torques, by_motion)
    multipliers = ca.SX.sym("multipliers", n)

    # With y = dL/dtorques held, the second derivative of L(torques(z), z) is that of y' torques plus J' L'' J: half the
    # operations of differentiating the whole twice. The part of L'' by torques alone is a diagonal: J' and J are
    # multiplied for all instants at once, by the caller.
    seeds = ca.SX.sym("seeds", n)
    slopes = ca.jacobian(by_motion, z)
    bent = ca.hessian(ca.dot(seeds, by_motion), z)[0]
    second, first = ca.hessian(factor * of_torques, ca.vertcat(torques, z))
    second, first = (ca.substitute([expression], [torques], [by_motion])[0] for expression in (second, first))
    held = multipliers + first[:n]
    crossed = slopes.T @ second[:n, n:]
    hessian = second[n:, n:] + crossed + crossed.T + ca.substitute([bent], [seeds], [held])[0]
    gradient = first[n:] + slopes.T @ held
    arguments: list[Any] = [z, units]
    return Stage(
        ca.Function("value", arguments, [cost, by_motion], {"cse": True}),
        ca.Function("gradient", arguments, [ca.densify(ca.gradient(cost, z))], {"cse": True}),
        ca.Function("slopes", [z], [ca.densify(slopes)], {"cse": True}),
        ca.Function(
            "curvature",
            [*arguments, factor, multipliers],
            [ca.densify(hessian), ca.densify(gradient), ca.densify(ca.diag(second[:n, :n])), ca.densify(slopes)],
            {"cse": True},
        ),
    )
