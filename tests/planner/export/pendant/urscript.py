"""URScript programs, read back by a grammar of its statements; poses by scipy and Pinocchio."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

from planner.robots import load_robot
from tests.planner.export.pendant.program import Program, Statement, floats, transform
from tests.planner.export.pendant.waypoints import pinocchio_pose

N = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
ROW = ", ".join([N] * 6)
PLACED = rf"pose_trans\(base, p\[{ROW}\]\)"
ENDING = r"a=(\d+\.\d{4}), v=(\d+\.\d{4})(?:, r=(\d+\.\d{4}))?"
BASE_OF_CONTROLLER = transform(np.array([0.1, -0.2, 0.3]), np.diag([-1.0, -1.0, 1.0]))
"""The plan's base in the base of a controller, which has its own."""


def read(program: str) -> Program:
    """Parse a program, or fail at a line outside the grammar; poses are brought back to the plan's base."""
    lines = [line for line in program.split("\n") if not line.startswith("#")]
    assert lines[0] == "def planned_trajectory():" and lines[-3:] == ["end", "planned_trajectory()", ""]
    match = re.fullmatch(rf"  start = \[{ROW}\]", lines[1])
    assert match is not None
    start = floats(match.groups())
    robot_name = re.match(r"# (\w+),", program)
    assert robot_name is not None
    approach = lines.index("  movej(start, t=1.0)")
    base, tool, waypoint = np.full((4, 4), np.nan), None, 0
    before: list[object] = []
    found: list[Statement] = []

    def placed(values: tuple[str, ...]) -> np.ndarray:
        in_plan: np.ndarray = np.linalg.inv(BASE_OF_CONTROLLER) @ base @ matrix(floats(values))
        return in_plan

    for line in (row.removeprefix("  ") for row in lines[approach + 1 : -3]):
        rest = found[-1].rest if found else before
        if match := re.fullmatch(r"# waypoint (\d+)", line):
            waypoint = int(match[1])
        elif match := re.fullmatch(rf"base = pose_trans\(get_forward_kin\(start\), pose_inv\(p\[{ROW}\]\)\)", line):
            own = load_robot(robot_name[1])
            at_start = pinocchio_pose(own, start) @ (np.eye(4) if tool is None else tool)
            base = BASE_OF_CONTROLLER @ at_start @ np.linalg.inv(matrix(floats(match.groups())))
        elif match := re.fullmatch(rf"set_tcp\(p\[{ROW}\]\)", line):
            tool = matrix(floats(match.groups()))
        elif match := re.fullmatch(rf"movej\(\[{ROW}\], {ENDING}\)", line):
            statement = Statement("joint", waypoint, [floats(match.groups()[:6])], *_ending(match[9]), {})
            names = ("leading_acceleration", "leading")
            statement.speeds = {name: (float(match[i]), 1e-4) for name, i in zip(names, (7, 8), strict=True)}
            found.append(statement)
        elif match := re.fullmatch(rf"mov(?:el|ec)\({PLACED}(?:, {PLACED})?, {ENDING}(, mode=0)?\)", line):
            is_circle = line.startswith("movec")
            assert is_circle == (match[7] is not None) == (match[16] is not None)
            values = [placed(match.groups()[:6])] + ([placed(match.groups()[6:12])] if is_circle else [])
            speeds = {"linear_acceleration": (float(match[13]), 1e-4), "linear": (float(match[14]), 1e-4)}
            kind = "circle" if is_circle else "line"
            found.append(Statement(kind, waypoint, values, *_ending(match[15]), speeds, tool))
        elif match := re.fullmatch(rf"sleep\({N}\)", line):
            rest.append(float(match[1]))
        else:
            match = re.fullmatch(r"set_(standard_digital_out)\(([0-7]), (True|False)\)", line)
            assert match is not None, line
            rest.append((f"{match[1]}_{match[2]}", match[3] == "True"))
    assert all(value > 0.0 for each in found for value, _ in each.speeds.values())
    return Program(start, before, found)


def _ending(radius: str | None) -> tuple[float, bool]:
    return float(radius or 0.0), radius is not None


def matrix(values: np.ndarray) -> np.ndarray:
    """Return the transform of a position, m, and a rotation vector, rad, by scipy."""
    return transform(values[:3], Rotation.from_rotvec(values[3:]).as_matrix())
