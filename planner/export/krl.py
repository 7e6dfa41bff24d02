"""KRL: a program of splines of the axes for KUKA, with the time of every point."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.export.base import ExportOptions, Format
from planner.export.programs import JOINTS, Move, moves, name_of, numbers, origin, tolerances_of
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot

KRL_EXTERNAL_AXES = 6
"""The most external axes that KRL has, E1 to E6."""

OUTPUT_NAME = r"[A-Za-z][A-Za-z0-9_]{0,23}"
"""The names of signals: identifiers of 24 characters at most."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program of PTP_SPLINE blocks, one a motion from rest to rest, with time blocks.

    Axes are in degrees, A1 to A6 in the order of the joints, external ones, E1 and so on, in degrees or mm. Outputs are
    signals that the controller declares.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm does not have six revolute joints, or has too many external axes.
    """
    robot = plan.path.robot
    motions = moves(plan, "KRL", options.sample_period, KRL_EXTERNAL_AXES)
    start = numbers(motions[0].position[0])
    external = ", E1 and so on its external axes in degrees or mm" if robot.external_axes else ""
    lines = [
        "DEF planned_trajectory()",
        f"; {origin(plan)}: a point every {options.sample_period:g} s",
        f"; A1 to A6 are the joints of the model in degrees{external}: its zeros and signs have to be the robot's",
        "; the controller plans its own spline through the points; velocities and torques are not carried",
        *halt_away_from_start(robot, start),
        f"PTP {position_of(start)}",
        *(line for move in motions for line in _block(move)),
        "END",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def halt_away_from_start(robot: Robot, start: list[str]) -> list[str]:
    """Write the lines that halt a program unless the robot is near the values of its axes at the start."""
    near = zip(_axes(start), tolerances_of(robot), strict=True)
    away = " OR ".join(f"(ABS($AXIS_ACT.{axis} - ({value})) > {most:.3f})" for (axis, value), most in near)
    return [
        f"IF {away} THEN",
        "HALT ; the robot is not at the start of the trajectory",
        "RETURN ; the start key would go on behind a HALT",
        "ENDIF",
    ]


def set_signal(output: SetOutput) -> Iterator[str]:
    """Write what sets a signal after the motions before it.

    Raises:
        UnsupportedFormat: The output has another name.
    """
    name = name_of(output, OUTPUT_NAME, "KRL", "gripper, a signal that is declared")[0]
    yield "WAIT SEC 0.0"  # the interpreter does not run ahead
    yield f"{name} = {str(output.value).upper() if isinstance(output.value, bool) else repr(output.value)}"


def _block(move: Move) -> Iterator[str]:
    duration = float(move.time[-1])
    if duration > 0.0:
        yield "PTP_SPLINE"
        yield "TIME_BLOCK START"
        for angles, part in zip(move.position[1:], np.diff(move.time) / duration * 100.0, strict=True):
            yield f"SPTP {position_of(numbers(angles))}"
            yield f"TIME_BLOCK PART = {part:.9f}"
        yield f"TIME_BLOCK END = {duration:.6f}"
        yield "ENDSPLINE"
    for step in move.steps_of_the_rest():
        if isinstance(step, float):
            yield f"WAIT SEC {step:.6f}"
        else:
            yield from set_signal(step)


def position_of(angles: list[str]) -> str:
    """Write a position of the axes, degrees and mm, the arm's first."""
    return "{" + ", ".join(f"{axis} {value}" for axis, value in _axes(angles)) + "}"


def _axes(values: list[str]) -> Iterator[tuple[str, str]]:
    for i, value in enumerate(values, 1):
        yield (f"A{i}" if i <= JOINTS else f"E{i - JOINTS}"), value


FORMAT = Format("krl", "text/x-krl", ".src", render)
"""The form of programs for KUKA."""
