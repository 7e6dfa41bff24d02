"""RAPID modules, read back by a grammar of the allowed statements; poses by scipy."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

from tests.planner.export.pendant.program import Program, Statement, floats, transform

N = r"(-?\d+(?:\.\d+)?)"
NO_AXES = r"\[9E9,9E9,9E9,9E9,9E9,9E9\]"
AXES = rf"\[\[{','.join([N] * 6)}\],{NO_AXES}\]"
PLACE = rf"\[{','.join([N] * 3)}\],\[{','.join([N] * 4)}\]"
TARGET = rf"\[{PLACE},\[0,0,0,0\],{NO_AXES}\]"
SPEED = rf"\[{N},{N},5000,1000\]"
ZONE = rf"(fine|z10|\[FALSE,{','.join([N] * 6)}\])"
FIRST_LINES = ["MODULE PlannedTrajectory", "  PROC planned_trajectory()", "  ENDPROC", "ENDMODULE"]


def read(program: str) -> Program:
    """Parse a module by the grammar of RAPID, or fail at the statement that is none."""
    lines = [line for line in program.split("\r\n") if line]
    tools: dict[str, np.ndarray] = {}
    found: list[Statement] = []
    before: list[object] = []
    start, waypoint, axes, path = np.empty(0), 0, np.nan, np.nan
    for line in (row.strip() for row in lines if row not in FIRST_LINES):
        rest = found[-1].rest if found else before
        if match := re.fullmatch(r"! waypoint (\d+)", line):
            waypoint = int(match[1])
        elif match := re.fullmatch(rf"PERS tooldata (\w+):=\[TRUE,\[{PLACE}\],\[0.001,.*\]\];", line):
            tools[match[1]] = matrix(floats(match.groups()[1:]))
        elif match := re.fullmatch(rf"MoveAbsJ {AXES},v1000\\T:=1.000000,fine,tool0;", line):
            start = np.radians(floats(match.groups()))
        elif match := re.fullmatch(r"AccSet (\d+),100;", line):
            axes = float(match[1]) / 100.0
            assert 0.2 <= axes <= 1.0
        elif match := re.fullmatch(rf"PathAccLim TRUE\\AccMax:={N},TRUE\\DecelMax:={N};", line):
            assert match[1] == match[2]
            path = float(match[1])
        elif line == "PathAccLim FALSE,FALSE;":
            path = np.inf
        elif match := re.fullmatch(rf"MoveAbsJ {AXES},{SPEED},{ZONE},(\w+);", line):
            values = [np.radians(floats(match.groups()[:6]))]
            ending = _zone(match.groups()[8:15])
            assert path == np.inf
            speeds = _speeds(match[7], match[8]) | {"joint_acceleration": (axes, 0.01)}
            found.append(Statement("joint", waypoint, values, *ending, speeds, tools[match[16]]))
        elif match := re.fullmatch(rf"Move[LC] {TARGET}(?:,{TARGET})?,{SPEED},{ZONE},(\w+)\\WObj:=planned_base;", line):
            is_circle = line.startswith("MoveC")
            assert is_circle == (match[8] is not None)
            poses = [matrix(floats(match.groups()[i : i + 7])) for i in ((0, 7) if is_circle else (0,))]
            assert axes == 1.0
            speeds = _speeds(match[15], match[16]) | {"linear_acceleration": (path, 1e-3)}
            kind = "circle" if is_circle else "line"
            found.append(Statement(kind, waypoint, poses, *_zone(match.groups()[16:23]), speeds, tools[match[24]]))
        elif match := re.fullmatch(rf"WaitTime {N};", line):
            rest.append(float(match[1]))
        elif match := re.fullmatch(r"SetDO (\w{1,32}),([01]);", line):
            rest.append((match[1], match[2] == "1"))
        else:
            known = r"!.*|VAR jointtarget actual;|actual:=CJointT\(\);|IF .* THEN|TPWrite \".*\";|EXIT;|ENDIF"
            known += r"|PERS wobjdata planned_base:=.*|ConfL\\Off;"
            assert re.fullmatch(known, line), line
    return Program(start, before, found)


def _speeds(linear: str, angular: str) -> dict[str, tuple[float, float]]:
    return {
        "linear": (float(linear) / 1e3, 1e-4),
        "angular": (float(np.radians(float(angular))), float(np.radians(0.1))),
    }


def _zone(groups: tuple[str, ...]) -> tuple[float, bool]:
    if groups[0] in ("fine", "z10"):
        return {"fine": 0.0, "z10": 0.01}[groups[0]], groups[0] != "fine"
    tool, reorientation, external, degrees, linear, rotating = floats(groups[1:])
    assert reorientation == external == linear and degrees == rotating
    assert reorientation >= tool > 0.0
    return tool / 1e3, True


def matrix(values: np.ndarray) -> np.ndarray:
    """Return the transform of a position, mm, and a quaternion w, x, y, z, by scipy."""
    return transform(values[:3] / 1e3, Rotation.from_quat(values[[4, 5, 6, 3]]).as_matrix())
