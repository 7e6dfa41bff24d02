"""RAPID: a module of absolute joint motions for ABB, each with its time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from planner.export.base import ExportOptions, Format
from planner.export.programs import APPROACH, JOINTS, Move, moves, name_of, numbers, origin, tolerances_of
from planner.kinematics import FloatArray
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot

RAPID_EXTERNAL_AXES = 6
"""The most external axes that RAPID has, eax_a to eax_f."""

NO_AXIS = "9E9"
"""The value of RAPID for an external axis that there is not."""

NAMES = (*(f"robax.rax_{i}" for i in range(1, JOINTS + 1)), *(f"extax.eax_{letter}" for letter in "abcdef"))
"""The names of the axes in a position, the arm's first."""

OUTPUT_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
"""The names of signals: identifiers of 32 characters at most."""


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
        *(f"    {line}" for move in motions for line in _statements(move)),
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
