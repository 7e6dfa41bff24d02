"""KRL, the language of KUKA: splines of the axes with the time of every point, or one instruction for each waypoint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import ceil, degrees, floor

import numpy as np

from planner.export.base import ExportOptions, Format
from planner.export.instructions import Instruction, Speeds, instructions
from planner.export.programs import (
    JOINTS,
    MILLIMETRES,
    Loop,
    Move,
    axes_first,
    moves,
    name_of,
    numbers,
    on_one_line,
    origin,
    repeated,
    rounded_down,
    tolerances_of,
)
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot
from planner.spatial import Pose, rpy_from_rotations

KRL_EXTERNAL_AXES = 6
"""The most external axes that KRL has, E1 to E6."""

OUTPUT_NAME = r"[A-Za-z][A-Za-z0-9_]{0,23}"
"""The names of signals: identifiers of 24 characters at most."""

LOOP = Loop("KRL", (("FOR cycle = 1 TO {count}",), ("ENDFOR",)), (("LOOP",), ("ENDLOOP",)))
"""Loops of KRL."""


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
        *(["DECL INT cycle"] if options.repeat > 1 else []),
        f"; {origin(plan)}: a point every {options.sample_period:g} s",
        f"; A1 to A6 are the joints of the model in degrees{external}: its zeros and signs have to be the robot's",
        "; the controller plans its own spline through the points; velocities and torques are not carried",
        *halt_away_from_start(robot, start),
        f"PTP {position_of(start)}",
        *repeated(plan, options, LOOP, (line for move in motions for line in _block(move))),
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


KRL_CYCLE = 0.012
"""The interpolation cycle of the controller, s: waits are whole numbers of it."""

APPROACH_PERCENT = 10
"""Percentage of the axes' full speed with which the program goes to its start."""

POINT_APPROXIMATION = 50
"""Approximation of joint points, percent: each is left at most a quarter of a motion before it."""


@dataclass(frozen=True)
class Dialect:
    """The words of a version of KUKA's system software.

    Attributes:
        version: The name of the version.
        joint: The motion of the axes.
        line: The line of the tool.
        circle: The circle of the tool.
        joint_blend: The ending of an approximated motion of the axes.
        tool_blend: The ending of an approximated motion of the tool.
        has_splines: Whether joint points are a spline of the axes.
    """

    version: str
    joint: str
    line: str
    circle: str
    joint_blend: str
    tool_blend: str
    has_splines: bool


KSS_5 = Dialect("KSS 5", "PTP", "LIN", "CIRC", " C_PTP", " C_DIS", has_splines=False)
"""The words of KR C2."""
KSS_8 = Dialect("KSS 8", "SPTP", "SLIN", "SCIRC", " C_SPL", " C_SPL", has_splines=True)
"""The words of KR C4."""


def render_instructions(dialect: Dialect, plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program with one instruction for each waypoint, which the controller plans for itself.

    Axes are in degrees, poses in mm with A, B and C in degrees in the frame of the robot's base.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm is of another maker, or does not have six revolute joints.
    """
    before, found = instructions(plan, "KUKA", "KRL", options.sample_period)
    robot = plan.path.robot
    start = numbers(axes_first(robot, plan.path.positions[:1])[0], 4)
    has_points = any(each.kind == "points" for each in found)
    lines = [
        "DEF planned_trajectory()",
        *(["DECL INT cycle"] if options.repeat > 1 else []),
        f"; {origin(plan)}, for {dialect.version}",
        "; the controller's own interpolation sets times and blends: the certified program is the format krl",
        "; speeds are at most the plan's; percentages are of the model's limits, which have to be the controller's",
        "; A1 to A6 are the joints of the model: its zeros and signs have to be the robot's",
        f"; $TOOL has to be the plan's tool in the frame {on_one_line(robot.tip_frame)}; poses are in the robot's base",
        *(["; joint points stand for curves that KRL does not have"] if has_points else []),
        *halt_away_from_start(robot, start),
        "$BASE = $ROBROOT",
        "$ORI_TYPE = #VAR",
        "$CIRC_TYPE = #BASE",
        f"axis_speed({APPROACH_PERCENT}, {APPROACH_PERCENT}) ; percent",
        f"PTP {position_of(start)}",
        *repeated(plan, options, LOOP, [*_rest(before), *_motions(dialect, found)]),
        "END",
        "DEF axis_speed(velocity :IN, acceleration :IN)",
        "DECL INT velocity, acceleration, axis",
        "FOR axis = 1 TO 6",
        "$VEL_AXIS[axis] = velocity",
        "$ACC_AXIS[axis] = acceleration",
        "ENDFOR",
        "END",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def _motions(dialect: Dialect, found: list[Instruction]) -> Iterator[str]:
    set_before: dict[str, str] = {}
    for i, each in enumerate(found):
        if each.tool is not None:
            yield f"$TOOL = {_frame(each.tool)}"
        for line in _settings(each):
            variable = line.partition(" = ")[0].partition("(")[0]
            if set_before.get(variable) != line:
                set_before[variable] = line
                yield line
        following = found[i + 1] if i + 1 < len(found) else None
        yield f"; waypoint {each.waypoint}"
        yield from _motion(dialect, each, following)
        yield from _rest(each.rest)


def _motion(dialect: Dialect, each: Instruction, following: Instruction | None) -> Iterator[str]:
    positions = [position_of(numbers(row, 4)) for row in each.position]
    leads_to_line = following is not None and following.kind in ("line", "circle") and not dialect.has_splines
    joint_blend = dialect.joint_blend + (" C_DIS" if leads_to_line else "")
    match each.kind:
        case "points" if dialect.has_splines:
            yield "PTP_SPLINE"
            yield from (f"SPTP {position}" for position in positions)
            yield "ENDSPLINE" + (joint_blend if each.is_passed else "")
        case "points":
            *first, last = positions
            yield from (f"PTP {position}{dialect.joint_blend}" for position in first)
            yield f"PTP {last}" + (joint_blend if each.is_passed else "")
        case "joint":
            is_blended = each.is_passed and _joint_percent(each) > 0
            yield f"{dialect.joint} {positions[0]}" + (joint_blend if is_blended else "")
        case "line":
            yield f"{dialect.line} {_frame(each.poses[0])}" + (dialect.tool_blend if each.is_passed else "")
        case "circle":
            via, end = map(_frame, each.poses)
            yield f"{dialect.circle} {via}, {end}" + (dialect.tool_blend if each.is_passed else "")


def _settings(each: Instruction) -> Iterator[str]:
    """Write the speeds and approximations of a motion."""
    speeds: Speeds = each.speeds
    if each.kind in ("joint", "points"):
        yield f"axis_speed({_percent(speeds.joint)}, {_percent(speeds.joint_acceleration)})"
        if each.kind == "points":
            yield f"$APO.CPTP = {POINT_APPROXIMATION}"
        elif each.is_passed and _joint_percent(each) > 0:
            yield f"$APO.CPTP = {_joint_percent(each)}"
    else:
        yield f"$VEL.CP = {rounded_down(speeds.linear, 4)}"
        yield f"$ACC.CP = {rounded_down(speeds.linear_acceleration, 4)}"
        for axis in (1, 2):
            yield f"$VEL.ORI{axis} = {rounded_down(degrees(speeds.angular), 2)}"
            yield f"$ACC.ORI{axis} = {rounded_down(degrees(speeds.angular_acceleration), 2)}"
    if each.blend > 0.0:
        yield f"$APO.CDIS = {rounded_down(each.blend * MILLIMETRES, 3)}"


def _joint_percent(each: Instruction) -> int:
    """Return the approximation of a joint motion: 100 begins at half of the shorter motion."""
    return min(floor(each.blend_share * 2.0 * 100.0), 100)


def _percent(share: float) -> int:
    """Round a share down to whole percent, of which a controller takes at least one."""
    return max(floor(share * 100.0), 1)


def _rest(steps: tuple[float | SetOutput, ...] | list[float | SetOutput]) -> Iterator[str]:
    for step in steps:
        if isinstance(step, float):
            yield f"WAIT SEC {ceil(round(step / KRL_CYCLE, 6)) * KRL_CYCLE:.3f}"
        else:
            yield from set_signal(step)


def _frame(pose: Pose) -> str:
    """Write a pose in mm and degrees; A, B, C turn about z, new y and new x."""
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    c, b, a = np.degrees(rpy_from_rotations(rotation[None])[0])
    values = numbers(np.array([*(pose.position * MILLIMETRES), a, b, c]), 4)
    return "{" + ", ".join(f"{axis} {value}" for axis, value in zip("XYZABC", values, strict=True)) + "}"


FORMAT_KSS_5 = Format("krl_kss5", "text/x-krl-kss5", ".kss5.src", partial(render_instructions, KSS_5))
"""The form of pendant programs for KUKA's KR C2, with PTP, LIN and CIRC."""

FORMAT_KSS_8 = Format("krl_kss8", "text/x-krl-kss8", ".kss8.src", partial(render_instructions, KSS_8))
"""The form of pendant programs for KUKA's KR C4, with SPTP, SLIN and SCIRC."""
