"""Reads CSV: poses or joint positions, one a row."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import StringIO

import numpy as np

from planner.path_files.steps import Step, ToolPath
from planner.path_files.texts import MOST_FAULTS, MOST_STEPS, parse_number, refused
from planner.robots import Robot
from planner.spatial import FloatArray, Pose, rotation_from_quaternion, rotation_from_rpy

POSITION = ("x", "y", "z")
"""Columns of a position."""

RPY = ("roll", "pitch", "yaw")
"""Columns of an orientation as angles."""

QUATERNION = ("qx", "qy", "qz", "qw")
"""Columns of an orientation as a quaternion."""

SPEED = "speed"
"""Column of the limit on the speed of the tool."""

JOINT = "position."
"""Beginning of the columns of joint positions, as the CSV of a plan has them."""

SMALLEST_NORM = 0.5
"""The smallest norm of a quaternion; a smaller one is a mistake."""


class Table:
    """Rows of a CSV file, with their lines.

    Attributes:
        columns: The names of the columns.
        rows: The line and the cells of each row.
    """

    def __init__(self, text: str) -> None:
        header = next((line for line in text.splitlines() if line.strip() and line[0] != "#"), "")
        delimiter = next((sign for sign in ";\t" if sign in header), ",")
        reader = csv.reader(StringIO(text, newline=""), delimiter=delimiter)
        self.rows: list[tuple[int, list[str]]] = []
        try:
            for row in reader:
                if any(cell.strip() for cell in row) and not row[0].startswith("#"):
                    self.rows.append((reader.line_num, [cell.strip() for cell in row]))
                if len(self.rows) > MOST_STEPS + 1:
                    raise refused(f"line {reader.line_num}: must have at most {MOST_STEPS} rows. Split the file.")
        except csv.Error as error:
            raise refused(f"line {reader.line_num}: is not CSV: {error}.") from None
        if not self.rows:
            raise refused("must have a header and rows.")
        self.line, self.columns = self.rows.pop(0)
        if doubled := [name for name in dict.fromkeys(self.columns) if self.columns.count(name) > 1]:
            raise refused(f"line {self.line}: column `{doubled[0][:40]}` must be there once.")
        faults = [
            f"line {line}: must have {len(self.columns)} cells, as the header; got {len(row)}."
            for line, row in self.rows
            if len(row) != len(self.columns)
        ]
        if faults:
            raise refused(*faults)

    def read(self, units: Mapping[str, float]) -> FloatArray:
        """Read columns (rows, columns) in SI units.

        Args:
            units: The unit of each column, in SI units.

        Raises:
            InvalidProblem: With every cell that is no number.
        """
        cells = {name: self.columns.index(name) for name in units}
        values = np.zeros((len(self.rows), len(units)))
        faults: list[str] = []
        for k, (line, row) in enumerate(self.rows):
            for column, (name, cell) in enumerate(cells.items()):
                try:
                    values[k, column] = parse_number(row[cell], name, units[name])
                except ValueError as error:
                    faults.append(f"line {line}: {error}")
            if len(faults) >= MOST_FAULTS:
                break
        if faults:
            raise refused(*faults)
        return values

    def others(self, used: Sequence[str]) -> list[str]:
        """Return the note on columns that are not used; empty if all are."""
        names = [f"`{name[:40]}`" for name in self.columns if name not in used]
        return [f"left out column{'s' if len(names) > 1 else ''} {', '.join(names[:10])}"] if names else []


def has_poses(table: Table) -> bool:
    """Return whether a table has columns of positions of the tool."""
    return set(POSITION) <= set(table.columns)


def read_poses(table: Table, length: float, angle: float, rotation: FloatArray) -> ToolPath:
    """Read the poses of a table.

    Args:
        table: The table.
        length: The unit of length, in m.
        angle: The unit of angle, in rad.
        rotation: (3, 3): the orientation of the tool where the table has none.

    Raises:
        InvalidProblem: With every fault of the rows.
    """
    orientation = next((names for names in (RPY, QUATERNION) if set(names) & set(table.columns)), ())
    if missing := [name for name in orientation if name not in table.columns]:
        raise refused(f"line {table.line}: must have the column {missing[0]} beside the other parts of an orientation.")
    limited = (SPEED,) if SPEED in table.columns else ()
    values = table.read(
        dict.fromkeys(POSITION, length)
        | dict.fromkeys(orientation, angle if orientation == RPY else 1.0)
        | dict.fromkeys(limited, length)
    )
    lines = [line for line, _ in table.rows]
    faults: list[str] = []
    if orientation == QUATERNION:
        norms = np.linalg.norm(values[:, 3:7], axis=1)
        wrong = np.flatnonzero(norms < SMALLEST_NORM)
        faults += [f"line {lines[k]}: a quaternion must have the norm 1; got {norms[k]:.3g}." for k in wrong]
    if limited:
        faults += [
            f"line {lines[k]}: `{SPEED}` must be greater than 0." for k in np.flatnonzero(values[1:, -1] <= 0.0) + 1
        ]
    if faults:
        raise refused(*faults)
    angles = values[:, 3 : 3 + len(orientation)]
    make = {RPY: lambda row: rotation_from_rpy(*row), QUATERNION: rotation_from_quaternion}
    rotations = [make[orientation](row) if orientation else rotation for row in angles]
    poses = [Pose(row[:3], turned) for row, turned in zip(values, rotations, strict=True)]
    speeds = [float(row[-1]) if limited else None for row in values]
    steps = [Step(pose, None, speed) for pose, speed in zip(poses[1:], speeds[1:], strict=True)]
    used = [*POSITION, *orientation, *limited]
    return ToolPath(poses[0] if poses else None, steps, table.others(used))


def read_joint_positions(
    table: Table, robot: Robot | None, length: float, angle: float
) -> tuple[FloatArray, Sequence[str]]:
    """Read the joint positions of a table (rows, joints), and notes.

    Args:
        table: The table.
        robot: The robot, whose joints are columns.
        length: The unit of sliding joints, in m.
        angle: The unit of turning joints, in rad.

    Raises:
        InvalidProblem: Columns are missing, or with every fault of the rows.
    """
    if robot is None:
        message = "is required: the file has no columns x, y and z, so its columns must be joints. Give the robot."
        raise refused(message, field="robot")
    units = np.where(robot.is_angle, angle, length).tolist()
    prefix = JOINT if any(name.startswith(JOINT) for name in table.columns) else ""
    names = [prefix + name for name in robot.joint_names]
    if missing := [name for name in names if name not in table.columns]:
        raise refused(
            f"line {table.line}: must have the columns x, y and z, or one for each joint of {robot.id}; "
            f"{', '.join(missing)} not found."
        )
    positions = table.read(dict(zip(names, units, strict=True)))
    return positions, table.others(names)
