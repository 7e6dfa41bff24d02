"""LS: a teach-pendant program of joint motions for Fanuc in its listing form, each with its time."""

from __future__ import annotations

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format
from planner.export.programs import JOINTS, Loop, moves, name_of, numbers, on_one_line, repeated, units_of
from planner.kinematics import FloatArray
from planner.plans.result import Plan
from planner.problems.actions import SetOutput

MILLISECOND = 1e-3
"""The unit of the times of motions, s."""

FANUC_EXTERNAL_AXES = 3
"""The most external axes of a group, E1 to E3."""

MOST_POINTS = 32_000
"""The most points that are written: no controller numbers more."""

REMARKS = (
    "J3 = third joint - second joint",
    "deg; signs as ROS-Industrial",
    "no velocities, no torques",
    "first goes to the start, slowly",
)
"""Remarks of the program about itself, in lines of at most 32 characters, the width of a pendant."""

LOOP = Loop("LS", (("FOR R[1]=1 TO {count} ;",), ("ENDFOR ;",)), (("LBL[1] ;",), ("JMP LBL[1] ;",)))
"""Loops of LS, which count in the first register."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program of joint motions with times in milliseconds.

    Positions are in degrees, and in mm for prismatic external axes. Fanuc counts J3 from the horizontal, not from the
    link before. So J3 is the model's third joint minus its second, as in the models of ROS-Industrial. Outputs are
    called DO_3, RO_1, AO_1 or GO_1.

    Raises:
        UnsupportedFormat: The plan sets an output in motion or one with another name, or does not begin and end at
            rest. Or the arm does not have six revolute joints, has too many external axes, or the plan has too many
            points.
    """
    motions = moves(plan, "LS", options.sample_period, FANUC_EXTERNAL_AXES)
    units = ["deg"] * JOINTS + units_of(plan.path.robot)
    head, points = (
        [*(f"!{remark} ;" for remark in REMARKS), "UFRAME_NUM=0 ;", "UTOOL_NUM=1 ;"],
        [motions[0].position[0]],
    )
    statements: list[str] = []
    elapsed, written = 0.0, 0
    for move in motions:
        for k in range(1, len(move.time)):
            points.append(move.position[k])
            # Rounded so that the sum does not drift.
            step = max(round((elapsed + move.time[k]) / MILLISECOND) - written, 1)
            written += step
            ending = "FINE" if k == len(move.time) - 1 else "CNT100"
            statements.append(f"J P[{len(points)}] {step}msec {ending} ;")
        elapsed += float(move.time[-1])
        rest = move.steps_of_the_rest()
        statements += [f"WAIT {step:.2f}(sec) ;" if isinstance(step, float) else _output(step) for step in rest]
    statements = [*head, "J P[1] 5% FINE ;", *repeated(plan, options, LOOP, statements)]
    if len(points) > MOST_POINTS:
        raise UnsupportedFormat(f"LS takes {MOST_POINTS} points; ask for a longer sample period")
    comment = on_one_line(plan.path.robot.id)[:16].replace('"', "'")
    lines = [
        "/PROG  PLANNED",
        "/ATTR",
        f'COMMENT = "{comment}";',
        "PROTECT = READ_WRITE;",
        "DEFAULT_GROUP = 1,*,*,*,*;",
        "/MN",
        *(f"{number:5d}:  {statement}" for number, statement in enumerate(statements, 1)),
        "/POS",
        *(line for number, point in enumerate(points, 1) for line in _position(number, point, units)),
        "/END",
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def _output(output: SetOutput) -> str:
    if isinstance(output.value, bool):
        found = name_of(output, r"(DO|RO)_(\d{1,4})", "LS", "DO_3 or RO_1")
        return f"{found[1]}[{found[2]}]={'ON' if output.value else 'OFF'} ;"
    found = name_of(output, r"(AO|GO)_(\d{1,4})", "LS", "AO_1 or GO_1 where the value is a number")
    return f"{found[1]}[{found[2]}]={round(output.value)} ;"


def _position(number: int, axes: FloatArray, units: list[str]) -> list[str]:
    """Write a position of all axes, in degrees and millimetres, the arm's first."""
    of_controller = axes.copy()
    of_controller[2] -= of_controller[1]
    names = (f"J{i}" if i <= JOINTS else f"E{i - JOINTS}" for i in range(1, len(axes) + 1))
    values = zip(names, numbers(of_controller), units, strict=True)
    lines = [f"\t{name} = {value} {unit}" for name, value, unit in values]
    return [f"P[{number}]{{", "   GP1:", "\tUF : 0, UT : 1,", ",\r\n".join(lines), "};"]


FORMAT = Format("fanuc_ls", "text/x-fanuc-ls", ".ls", render)
"""The form of listed teach-pendant programs for Fanuc."""
