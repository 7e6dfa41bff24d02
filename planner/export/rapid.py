"""RAPID: a module of absolute joint motions for ABB, each with its time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.export.base import ExportOptions, Format
from planner.export.programs import AT_START, moves, name_of, numbers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.export.programs import Move
    from planner.result import Plan

NO_EXTERNAL_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
"""The value of RAPID for external axes that there are not."""

OUTPUT_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
"""The names of signals: identifiers of 32 characters at most."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a module of MoveAbsJ with the time of every point.

    Axes are in degrees, rax_1 to rax_6 in the order of the joints. Outputs are signals that the controller has.

    Raises:
        UnsupportedFormat: An output is set in motion or has another name, it does not begin and end at rest, or the arm
            has not six joints that turn.
    """
    robot = plan.path.robot
    motions = moves(plan, "RAPID", options.sample_period)
    start, period = numbers(np.degrees(motions[0].position[0])), options.sample_period
    away = " OR ".join(
        f"Abs(actual.robax.rax_{i}-({angle}))>{np.degrees(AT_START):.3f}" for i, angle in enumerate(start, 1)
    )
    lines = [
        "MODULE PlannedTrajectory",
        f"  ! {robot.id}, {plan.backend.kind}, {plan.trajectory.duration!r} s: a point every {period:g} s",
        "  ! rax_1 to rax_6 are the joints of the model in degrees: its zeros and signs have to be the robot's,",
        "  ! and its third joint that of the upper arm; velocities and torques are not carried",
        "  PROC planned_trajectory()",
        "    VAR jointtarget actual;",
        "    actual:=CJointT();",
        f"    IF {away} THEN",
        '      TPWrite "The robot is not at the start of the trajectory";',
        "      EXIT;",
        "    ENDIF",
        *(f"    {line}" for move in motions for line in _statements(move)),
        "  ENDPROC",
        "ENDMODULE",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def _statements(move: Move) -> Iterator[str]:
    last = len(move.time) - 1
    for k in range(1, last + 1):
        target = f"[[{','.join(numbers(np.degrees(move.position[k])))}],{NO_EXTERNAL_AXES}]"
        zone = "fine" if k == last else "z0"
        yield f"MoveAbsJ {target},v1000\\T:={move.time[k] - move.time[k - 1]:.6f},{zone},tool0;"
    for step in move.steps_of_the_rest():
        if isinstance(step, float):
            yield f"WaitTime {step:.6f};"
        else:
            name = name_of(step, OUTPUT_NAME, "RAPID", "doGripper, a signal that is configured")[0]
            yield (
                f"SetDO {name},{int(step.value)};" if isinstance(step.value, bool) else f"SetAO {name},{step.value!r};"
            )


FORMAT = Format("rapid", "text/x-rapid", ".mod", render)
"""The form of programs for ABB."""
