"""URScript, the language of Universal Robots: streamed joint positions, or one instruction for each waypoint."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import floor

import numpy as np

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format
from planner.export.instructions import Instruction, instructions
from planner.export.programs import (
    APPROACH,
    AT_START,
    JOINTS,
    Loop,
    name_of,
    origin,
    program_order,
    repeated,
    rounded_down,
    stops,
)
from planner.kinematics import FloatArray
from planner.kinematics.forward import tool_pose, tool_poses
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.spatial import Pose, rotation_vector

LOOKAHEAD = 0.03
"""The smoothing time of the controller, s: the shortest that it accepts."""

GAIN = 300
"""The controller's default gain towards the positions that it is sent."""

LOOP = Loop(
    "URScript",
    (("  cycle = 0", "  while cycle < {count}:"), ("    cycle = cycle + 1", "  end")),
    (("  while True:",), ("  end",)),
)
"""Loops of URScript, which counts by itself."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program of joint positions at the sample period, which the controller follows.

    Raises:
        UnsupportedFormat: The arm does not have six revolute joints, the trajectory begins or ends in motion, or an
            output has an unknown name.
    """
    robot = plan.path.robot
    if robot.dof != JOINTS or not robot.is_angle.all():
        raise UnsupportedFormat(f"URScript moves arms of {JOINTS} joints that turn, which {robot.id} is not")
    stops(plan, "URScript")
    samples = plan.samples(options.sample_period, options.include)
    in_order = samples.position[:, program_order(robot)]
    positions, periods = list(map(joints, in_order)), (samples.time[1:] - samples.time[:-1]).tolist()
    outputs: dict[int, list[str]] = {}
    for timed in plan.actions:
        if isinstance(timed.action, SetOutput):
            nearest = int(np.abs(samples.time - timed.time).argmin())
            outputs.setdefault(nearest, []).append(f"  {set_output(timed.action)}")
    motions = (
        line
        for k, (position, period) in enumerate(zip(positions[1:], periods, strict=True), 1)
        for line in (
            f"  servoj({position}, t={period!r}, lookahead_time={LOOKAHEAD}, gain={GAIN})",
            *outputs.get(k, ()),
        )
    )
    lines = [
        f"# {origin(plan)}: joint positions (rad) every {options.sample_period:g} s.",
        f"# The controller runs behind them by up to {LOOKAHEAD} s; outputs are set with the nearest point;",
        "# velocities and torques are not carried.",
        "def planned_trajectory():",
        *halt_away_from_start(in_order[0]),
        *repeated(plan, options, LOOP, [*outputs.get(0, ()), *motions]),
        "  stopj(2.0)",
        "end",
        "planned_trajectory()",
    ]
    return ("\n".join(lines) + "\n").encode()


def halt_away_from_start(position: FloatArray) -> list[str]:
    """Write the lines that move the robot to its start from nearby, and otherwise halt the program."""
    return [
        f"  start = {joints(position)}",
        "  actual = get_actual_joint_positions()",
        "  i = 0",
        f"  while i < {JOINTS}:",
        f"    if norm(actual[i] - start[i]) > {AT_START}:",
        '      popup("The robot is not at the start of the trajectory", title="Halted", error=True)',
        "      halt",
        "    end",
        "    i = i + 1",
        "  end",
        f"  movej(start, t={APPROACH})",
    ]


def set_output(output: SetOutput) -> str:
    """Write what sets an output, which is called like standard_digital_out_3.

    Raises:
        UnsupportedFormat: It has another name.
    """
    if isinstance(output.value, bool):
        pattern = r"(standard|configurable|tool)_digital_out_(\d)"
        found = name_of(output, pattern, "URScript", "standard_digital_out_3")
        return f"set_{found[1]}_digital_out({found[2]}, {output.value})"
    found = name_of(output, r"standard_analog_out_([01])", "URScript", "standard_analog_out_0 where it takes a number")
    return f"set_standard_analog_out({found[1]}, {output.value!r})"


def joints(position: FloatArray) -> str:
    """Write a joint position (joints,), rad, as a list."""
    return "[" + ", ".join(map(repr, position.tolist())) + "]"


FORMAT = Format("urscript", "text/x-urscript", ".script", render)
"""The form of programs for Universal Robots."""


POINT_BLEND_SHARE = 0.4
"""Blend radius of joint points as a share of the smallest distance of the tool between them: blends do not overlap."""


def render_instructions(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program with one instruction for each waypoint, which the controller plans for itself.

    Joint positions are in rad. Poses are in m with a rotation vector in rad, in the frame of the plan's base.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm is of another maker, or does not have six revolute joints.
    """
    before, found = instructions(plan, "Universal Robots", "URScript", options.sample_period)
    tool = plan.problem.waypoints[0].tool
    start = _pose(tool_pose(plan.problem.robots[0], plan.path.positions[0]))
    motions = (line for i, each in enumerate(found) for line in _instructions(plan, each, found[i + 1 : i + 2]))
    statements = [*_rest(before), *motions]
    has_points = any(each.kind == "points" for each in found)
    has_poses = any(each.kind in ("line", "circle") for each in found)
    body = [
        *halt_away_from_start(plan.path.positions[0]),
        *([f"  set_tcp({_pose(tool)})"] if tool is not None else []),
        *([f"  base = pose_trans(get_forward_kin(start), pose_inv({start}))"] if has_poses else []),
        *repeated(plan, options, LOOP, [f"  {line}" for line in statements]),
    ]
    program = "\n".join(
        [
            f"# {origin(plan)}: joint positions in rad, poses in m and rad.",
            "# The controller's own interpolation sets times and blends: the certified program is the format urscript.",
            "# Speeds and accelerations are at most the plan's.",
            "# The tool has to be the plan's at the start; base is the plan's base in the controller's.",
            *(["# Joint points stand for curves that URScript does not have."] if has_points else []),
            "def planned_trajectory():",
            *body,
            "end",
            "planned_trajectory()",
        ]
    )
    return f"{program}\n".encode()


def _instructions(plan: Plan, each: Instruction, following: Sequence[Instruction]) -> Iterator[str]:
    speeds = each.speeds
    axes = f"a={rounded_down(speeds.leading_acceleration, 4)}, v={rounded_down(speeds.leading, 4)}"
    tool = f"a={rounded_down(speeds.linear_acceleration, 4)}, v={rounded_down(speeds.linear, 4)}"
    radius = f", r={_radius(each.blend)}" if each.is_passed and each.blend > 0.0 else ""
    if each.tool is not None:
        yield f"set_tcp({_pose(each.tool)})"
    yield f"# waypoint {each.waypoint}"
    match each.kind:
        case "joint":
            yield f"movej({joints(np.radians(each.position[0]))}, {axes}{radius})"
        case "points":
            *first, last = (joints(np.radians(row)) for row in each.position)
            own, shared = _point_blend(plan, [each]), _point_blend(plan, [each, *following])
            yield from (f"movej({position}, {axes}, r={_radius(own)})" for position in first)
            yield f"movej({last}, {axes}" + (f", r={_radius(shared)})" if each.is_passed else ")")
        case "line":
            yield f"movel({_placed(each.poses[0])}, {tool}{radius})"
        case "circle":
            via, end = map(_placed, each.poses)
            yield f"movec({via}, {end}, {tool}{radius}, mode=0)"
    yield from _rest(each.rest)


def _point_blend(plan: Plan, curves: Sequence[Instruction]) -> float:
    """Return the blend radius of the joint points of adjacent curves, m."""
    gaps = []
    for each in curves:
        positions = np.vstack([plan.path.positions[each.segment], np.radians(each.position)])
        points, _ = tool_poses(plan.problem.robots[each.segment + 1], positions)
        gaps.append(float(np.linalg.norm(np.diff(points, axis=0), axis=1).min()))
    return POINT_BLEND_SHARE * min(gaps)


def _rest(steps: Sequence[float | SetOutput]) -> Iterator[str]:
    for step in steps:
        yield f"sleep({step!r})" if isinstance(step, float) else set_output(step)


def _radius(value: float) -> str:
    """Round a blend radius down to tenths of a millimetre."""
    return f"{floor(round(value * 1e4, 6)) / 1e4:.4f}"


def _placed(pose: Pose) -> str:
    """Write a pose of the plan's base as a pose of the controller's."""
    return f"pose_trans(base, {_pose(pose)})"


def _pose(pose: Pose) -> str:
    """Return a pose as URScript writes it: a position, m, and a rotation vector, rad."""
    turn = np.zeros(3) if pose.rotation is None else rotation_vector(pose.rotation)
    return f"p[{', '.join(repr(value) for value in [*pose.position.tolist(), *turn.tolist()])}]"


FORMAT_MOVES = Format("urscript_moves", "text/x-urscript-moves", ".moves.script", render_instructions)
"""The form of pendant programs for Universal Robots, with movej, movel and movec."""
