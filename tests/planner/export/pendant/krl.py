"""KRL programs, read back by a grammar of KUKA's statements; poses by scipy."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

from tests.planner.export.pendant.program import Program, Statement, floats, transform

N = r"(-?\d+\.\d+)"
AXES = r"\{" + ", ".join(f"A{i} {N}" for i in range(1, 7)) + r"\}"
FRAME = r"\{" + ", ".join(f"{axis} {N}" for axis in "XYZABC") + r"\}"
SUBPROGRAM = [
    "DEF axis_speed(velocity :IN, acceleration :IN)", "DECL INT velocity, acceleration, axis", "FOR axis = 1 TO 6",
    "$VEL_AXIS[axis] = velocity", "$ACC_AXIS[axis] = acceleration", "ENDFOR", "END",
]  # fmt: skip
UNITS = {"$VEL.CP": ("linear", 1.0, 1e-4), "$VEL.ORI1": ("angular", np.radians(1.0), np.radians(0.01))}
"""The speed, unit and resolution that each variable sets."""


def read(program: str) -> Program:
    """Parse a program by the grammar of KRL, or fail at the statement that is none."""
    lines = program.split("\r\n")
    assert lines[0] == "DEF planned_trajectory()" and lines[-1] == ""
    assert lines[-8:-1] == SUBPROGRAM and lines[-9] == "END"
    settings: dict[str, float] = {}
    found: list[Statement] = []
    waypoint, tool = 0, None
    rows = iter(lines[1:-9])
    for line in rows:
        if match := re.fullmatch(r"; waypoint (\d+)", line):
            waypoint = int(match[1])
        elif line.startswith(";"):
            assert not found
        elif line.startswith("IF "):
            assert [next(rows).split(" ;")[0] for _ in range(3)] == ["HALT", "RETURN", "ENDIF"] and not found
        elif line in ("$BASE = $ROBROOT", "$ORI_TYPE = #VAR", "$CIRC_TYPE = #BASE", "PTP_SPLINE"):
            pass
        elif match := re.fullmatch(r"axis_speed\((\d+), (\d+)\)(?: ; percent)?", line):
            settings |= {"joint": int(match[1]), "joint_acceleration": int(match[2])}
            assert all(1 <= settings[name] <= 100 for name in ("joint", "joint_acceleration"))
        elif match := re.fullmatch(r"(\$(?:VEL|ACC)\.(?:CP|ORI[12])|\$APO\.C(?:DIS|PTP)) = (\d+(?:\.\d+)?)", line):
            settings[match[1]] = float(match[2])
            assert settings[match[1]] > 0.0
        elif match := re.fullmatch(rf"\$TOOL = {FRAME}", line):
            tool = matrix(floats(match.groups()))
        elif match := re.fullmatch(rf"S?PTP {AXES}((?: C_PTP| C_DIS| C_SPL)*)", line):
            speeds = {name: (settings[name] / 100.0, 0.01) for name in ("joint", "joint_acceleration")}
            values = [np.radians(floats(match.groups()[:6]))]
            blend = None if match[7] else 0.0
            found.append(Statement("joint", waypoint, values, blend, bool(match[7]), speeds))
        elif match := re.fullmatch(rf"S?(LIN|CIRC) {FRAME}(?:, {FRAME})?( C_DIS| C_SPL)?", line):
            assert (match[1] == "CIRC") == (match[8] is not None)
            numbers = [match.groups()[1:7]] + ([match.groups()[7:13]] if match[8] else [])
            of_tool = {name: (settings[key] * unit, least) for key, (name, unit, least) in UNITS.items()}
            blend = settings["$APO.CDIS"] / 1e3 if match[14] else 0.0
            kind = {"LIN": "line", "CIRC": "circle"}[match[1]]
            poses = [matrix(floats(each)) for each in numbers]
            found.append(Statement(kind, waypoint, poses, blend, bool(match[14]), of_tool, tool))
        elif match := re.fullmatch(r"ENDSPLINE( C_SPL)?", line):
            found[-1].is_passed = bool(match[1])
        elif match := re.fullmatch(rf"WAIT SEC {N}", line):
            found[-1].rest.append(float(match[1]))
        else:
            match = re.fullmatch(r"([A-Za-z]\w{0,23}) = (TRUE|FALSE)", line)
            assert match is not None, line
            found[-1].rest.append((match[1], match[2] == "TRUE"))
    start = found.pop(0)
    assert start.kind == "joint" and not start.is_passed
    return Program(start.values[0], start.rest, found)


def matrix(values: np.ndarray) -> np.ndarray:
    """Return the transform of X, Y, Z, mm, and A, B, C, degrees, by scipy."""
    return transform(values[:3] / 1e3, Rotation.from_euler("ZYX", values[3:], degrees=True).as_matrix())
