"""RAPID, the language of ABB: absolute joint motions with their times, or one instruction for each waypoint."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import degrees, floor

import numpy as np
import pinocchio as pin

from planner.export.base import ExportOptions, Format
from planner.export.instructions import Instruction, instructions
from planner.export.programs import (
    APPROACH,
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
from planner.kinematics import FloatArray
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot
from planner.spatial import Pose, quaternion

RAPID_EXTERNAL_AXES = 6
"""The most external axes that RAPID has, eax_a to eax_f."""

NO_AXIS = "9E9"
"""The value of RAPID for an external axis that there is not."""

NAMES = (*(f"robax.rax_{i}" for i in range(1, JOINTS + 1)), *(f"extax.eax_{letter}" for letter in "abcdef"))
"""The names of the axes in a position, the arm's first."""

OUTPUT_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
"""The names of signals: identifiers of 32 characters at most."""

LOOP = Loop("RAPID", (("FOR cycle FROM 1 TO {count} DO",), ("ENDFOR",)), (("WHILE TRUE DO",), ("ENDWHILE",)))
"""Loops of RAPID."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a module of timed MoveAbsJ statements, after a slow move to the start.

    Axes are in degrees, rax_1 to rax_6 in the order of the joints, external ones, eax_a and so on, in degrees or mm.
    Outputs are signals that the controller has.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm does not have six revolute joints, or has too many external axes.
    """
    robot = plan.path.robot
    motions = moves(plan, "RAPID", options.sample_period, RAPID_EXTERNAL_AXES)
    period = options.sample_period
    lines = [
        "MODULE PlannedTrajectory",
        f"  ! {origin(plan)}: a point every {period:g} s",
        "  ! rax_1 to rax_6 are the joints of the model in degrees: its zeros and signs have to be the robot's,",
        "  ! and its third joint that of the upper arm; velocities and torques are not carried",
        "  PROC planned_trajectory()",
        *halt_away_from_start(robot, motions[0].position[0]),
        *(
            f"    {line}"
            for line in repeated(plan, options, LOOP, (each for move in motions for each in _statements(move)))
        ),
        "  ENDPROC",
        "ENDMODULE",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def halt_away_from_start(robot: Robot, start: FloatArray) -> list[str]:
    """Write the lines that move the robot to its start from nearby, and otherwise end the program."""
    near = zip(NAMES, numbers(start), tolerances_of(robot), strict=False)
    away = " OR ".join(f"Abs(actual.{name}-({value}))>{most:.3f}" for name, value, most in near)
    return [
        "    VAR jointtarget actual;",
        "    actual:=CJointT();",
        f"    IF {away} THEN",
        '      TPWrite "The robot is not at the start of the trajectory";',
        "      EXIT;",
        "    ENDIF",
        f"    {_move(start, APPROACH, 'fine')}",
    ]


def _statements(move: Move) -> Iterator[str]:
    last = len(move.time) - 1
    for k in range(1, last + 1):
        yield _move(move.position[k], float(move.time[k] - move.time[k - 1]), "fine" if k == last else "z0")
    yield from rest(move.steps_of_the_rest())


def rest(steps: Iterable[float | SetOutput]) -> Iterator[str]:
    """Write waits, s, and outputs, which are signals of the controller.

    Raises:
        UnsupportedFormat: An output has another name.
    """
    for step in steps:
        if isinstance(step, float):
            yield f"WaitTime {step:.6f};"
        else:
            name = name_of(step, OUTPUT_NAME, "RAPID", "doGripper, a signal that is configured")[0]
            is_digital = isinstance(step.value, bool)
            yield f"SetDO {name},{int(step.value)};" if is_digital else f"SetAO {name},{step.value!r};"


def _move(position: FloatArray, seconds: float, zone: str) -> str:
    """Return the motion to a position of all axes, in degrees and millimetres, the arm's first, in a time."""
    return f"MoveAbsJ {target(position)},v1000\\T:={seconds:.6f},{zone},tool0;"


def target(position: FloatArray) -> str:
    """Write the position of all axes, in degrees and millimetres, the arm's first."""
    values = numbers(position)
    external = [*values[JOINTS:], *[NO_AXIS] * RAPID_EXTERNAL_AXES][:RAPID_EXTERNAL_AXES]
    return f"[[{','.join(values[:JOINTS])}],[{','.join(external)}]]"


FORMAT = Format("rapid", "text/x-rapid", ".mod", render)
"""The form of programs for ABB."""


LEAST_ACCELERATION_PERCENT = 20
"""The smallest percentage of the axes' acceleration that AccSet takes."""

LEAST_PATH_ACCELERATION = 0.1
"""The smallest acceleration of the tool that PathAccLim takes, m/s^2."""

IDENTITY = "[[0,0,0],[1,0,0,0]]"
"""The pose of a frame in itself, as RAPID writes it."""

NO_LOAD = "[0.001,[0,0,0.001],[1,0,0,0],0,0,0]"
"""The load of `tool0`: the operator enters the tool's own."""

POINT_ZONE = "z10"
"""The zone of joint points: 10 mm, which the controller reduces where points are nearer."""


def render_instructions(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a module with one instruction for each waypoint, which the controller plans for itself.

    Axes are in degrees, poses in mm with quaternions, in the frame of the work object. That is the robot's base, or the
    workpiece that the robot holds under a stationary tool.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm is of another maker, or does not have six revolute joints.
    """
    before, found = instructions(plan, "ABB", "RAPID", options.sample_period, has_fixed_tools=True)
    robot = plan.path.robot
    tools = [_pose(each.tool_in_tip) for each in plan.problem.robots]
    names = {tool: f"planned_tool_{number}" for number, tool in enumerate(dict.fromkeys(tools), 1)}
    frames = ("planned_part", "planned_part") if robot.holds_workpiece else ("", "planned_base")
    statements = [*rest(before), *_instructions(found, [names[tool] for tool in tools], frames)]
    has_points = any(each.kind == "points" for each in found)
    lines = [
        "MODULE PlannedTrajectory",
        f"  ! {origin(plan)}",
        "  ! the controller's own interpolation sets times and blends: the certified program is the format rapid",
        "  ! speeds are at most the plan's; percentages are of the model's limits, which have to be the controller's",
        "  ! rax_1 to rax_6 are the joints of the model in degrees: its zeros and signs have to be the robot's,",
        "  ! and its third joint that of the upper arm",
        *(["  ! joint points stand for curves that RAPID does not have"] if has_points else []),
        *(_held_part(robot, names) if robot.holds_workpiece else _held_tools(robot, names)),
        "  PROC planned_trajectory()",
        *halt_away_from_start(robot, axes_first(robot, plan.path.positions[:1])[0]),
        r"    ConfL\Off;",
        *(f"    {line}" for line in repeated(plan, options, LOOP, statements)),
        "  ENDPROC",
        "ENDMODULE",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def _held_tools(robot: Robot, names: Mapping[str, str]) -> Iterator[str]:
    """Write the data of tools, their names by their poses, and of the base as the work object."""
    yield f"  ! tools are in the frame {on_one_line(robot.tip_frame)}, which has to be tool0; enter their loads"
    yield from (f"  PERS tooldata {name}:=[TRUE,{tool},{NO_LOAD}];" for tool, name in names.items())
    yield "  ! the base of the model in the world"
    yield f'  PERS wobjdata planned_base:=[FALSE,TRUE,"",{IDENTITY},{IDENTITY}];'


def _held_part(robot: Robot, names: Mapping[str, str]) -> Iterator[str]:
    """Write the data of stationary tools, their names by their poses, and of the workpiece that the robot holds."""
    yield "  ! stationary tools are in the base of the model, which has to be the world; enter the loads of the gripper"
    yield from (f"  PERS tooldata {name}:=[FALSE,{tool},{NO_LOAD}];" for tool, name in names.items())
    flange = robot.model.frames[robot.payload_frame_id]
    yield f"  ! the workpiece in the frame {on_one_line(flange.name)}, which has to be tool0"
    yield f'  PERS wobjdata planned_part:=[TRUE,TRUE,"",{_pose(flange.placement.inverse())},{IDENTITY}];'


def _instructions(found: list[Instruction], tools: list[str], frames: tuple[str, str]) -> Iterator[str]:
    """Write each motion.

    Args:
        found: The motions.
        tools: The names of the tools at the waypoints of the plan.
        frames: The work objects of motions of the joints, if any, and of motions of the tool.
    """
    of_joints, of_tool = (rf"\WObj:={frame}" if frame else "" for frame in frames)
    in_force: list[str] = []
    for each in found:
        settings = _accelerations(each)
        yield from (line for line in settings if line not in in_force)
        in_force = settings
        yield f"! waypoint {each.waypoint}"
        yield from _motion(each, tools[each.segment + 1], of_joints, of_tool)
        yield from rest(each.rest)


def _motion(each: Instruction, tool: str, of_joints: str, of_tool: str) -> Iterator[str]:
    speeds = each.speeds
    speed = f"[{rounded_down(speeds.linear * MILLIMETRES, 1)},{rounded_down(degrees(speeds.angular), 1)},5000,1000]"
    ending = f"{speed},{_zone(each)},{tool}"
    match each.kind:
        case "points":
            *first, last = map(target, each.position)
            yield from (f"MoveAbsJ {position},{speed},{POINT_ZONE},{tool}{of_joints};" for position in first)
            yield f"MoveAbsJ {last},{speed},{POINT_ZONE if each.is_passed else 'fine'},{tool}{of_joints};"
        case "joint":
            yield f"MoveAbsJ {target(each.position[0])},{ending}{of_joints};"
        case "line":
            yield f"MoveL {_robtarget(each.poses[0])},{ending}{of_tool};"
        case "circle":
            via, end = map(_robtarget, each.poses)
            yield f"MoveC {via},{end},{ending}{of_tool};"


def _accelerations(each: Instruction) -> list[str]:
    """Write the limits of acceleration of a motion: of the axes in percent, of the tool in m/s^2."""
    if each.kind in ("joint", "points"):
        percent = max(floor(each.speeds.joint_acceleration * 100.0), LEAST_ACCELERATION_PERCENT)
        return [f"AccSet {percent},100;", "PathAccLim FALSE,FALSE;"]
    most = rounded_down(max(each.speeds.linear_acceleration, LEAST_PATH_ACCELERATION), 3)
    return ["AccSet 100,100;", rf"PathAccLim TRUE\AccMax:={most},TRUE\DecelMax:={most};"]


def _zone(each: Instruction) -> str:
    """Write the zone of a blend, mm and degrees, in the proportions of ABB's own z10."""
    if not each.is_passed or each.blend == 0.0:
        return "fine"
    radius = each.blend * MILLIMETRES
    tool, reorientation, degree = (rounded_down(radius * share, 3) for share in (1.0, 1.5, 0.15))
    return f"[FALSE,{tool},{reorientation},{reorientation},{degree},{reorientation},{degree}]"


def _robtarget(pose: Pose) -> str:
    """Write a pose as a target of any configuration, without external axes."""
    rotation = np.eye(3) if pose.rotation is None else pose.rotation
    external = ",".join([NO_AXIS] * RAPID_EXTERNAL_AXES)
    return f"[{_pose(pin.SE3(rotation, pose.position))[1:-1]},[0,0,0,0],[{external}]]"


def _pose(pose: pin.SE3) -> str:
    """Write a position, mm, and a quaternion w, x, y, z."""
    x, y, z, w = quaternion(pose.rotation).tolist()
    position = numbers(pose.translation * MILLIMETRES, 4)
    return f"[[{','.join(position)}],[{','.join(numbers(np.array([w, x, y, z]), 8))}]]"


FORMAT_MOVES = Format("rapid_moves", "text/x-rapid-moves", ".moves.mod", render_instructions)
"""The form of pendant programs for ABB, with MoveAbsJ, MoveL and MoveC."""
