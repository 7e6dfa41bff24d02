"""Reads a path from a file of any format as waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.path_files.drawings import read_dxf
from planner.path_files.gcode import read_gcode
from planner.path_files.steps import SMALLEST_BLEND, to_waypoints
from planner.path_files.tables import Table, has_poses, read_joint_positions, read_poses
from planner.path_files.texts import (
    METRES,
    RADIANS,
    AngleUnit,
    LengthUnit,
    bounded,
    check_choice,
    read_bytes,
    refused,
    text_of,
)
from planner.problems.problem import JointWaypoint, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition
from planner.robots import Robot
from planner.spatial import FloatArray, Pose

TABLES = (".csv",)
"""Suffixes of tables."""

PROGRAMS = (".nc", ".ngc", ".gcode", ".gc", ".tap", ".cnc")
"""Suffixes of G-code."""

DRAWINGS = (".dxf",)
"""Suffixes of drawings."""

DOWN = (0.0, 0.0, -1.0)
"""The direction of a tool that points down."""

ALONG_X = 0.999
"""Component of the tool axis along x above which the tool's own x axis follows y instead."""


@dataclass(frozen=True)
class PathFile:
    """A path in a file.

    Attributes:
        waypoints: Its waypoints: of the tool, or of the joints.
        notes: Remarks on omissions and assumptions, for a person.
    """

    waypoints: Sequence[PoseWaypoint] | Sequence[JointWaypoint]
    notes: Sequence[str] = ()


def read_path(
    path: Path,
    *,
    content: bytes | None = None,
    robot: Robot | None = None,
    units: LengthUnit | None = None,
    angle: AngleUnit = "rad",
    frame: Pose | None = None,
    tool_axis: Sequence[float] = DOWN,
    blend: float | None = None,
    lift: float = 0.0,
) -> PathFile:
    """Read a path from a CSV, G-code or DXF file.

    The tool stops at corners, or rounds them with a `blend`, and passes joins without a corner. Feeds become limits on
    the speed of the tool.

    Args:
        path: The file. `.csv` has the columns `x`, `y`, `z`, or one for each joint. `.nc`, `.ngc`, `.gcode`, `.gc`,
            `.tap` and `.cnc` are G-code. `.dxf` is a drawing (package ezdxf).
        content: The content of the file; None: read from it.
        robot: The robot, whose joints are columns of a CSV file.
        units: The unit of lengths. In G-code it holds until a G20 or G21; it replaces the unit of a drawing. None: the
            unit that the file names, else mm; m for CSV.
        angle: The unit of angles in a CSV file.
        frame: The pose in the base frame of the frame that the file is in; None: the base frame.
        tool_axis: Direction of the tool's z axis in that frame, where the file has no orientations.
        blend: The distance from a corner at which the tool leaves its path, m; None: it stops.
        lift: The distance of moves between the shapes of a drawing, m, against the tool axis.

    Raises:
        OSError: The file cannot be read.
        InvalidProblem: The file cannot be used, with line numbers; or an argument, or ezdxf is not installed.
    """
    if units is not None:
        check_choice("units", units, LengthUnit)
    check_choice("angle", angle, AngleUnit)
    if blend is not None and not SMALLEST_BLEND <= blend < np.inf:
        raise refused(f"must be at least {SMALLEST_BLEND:g} m; got {blend:g}.", field="blend")
    if not 0.0 <= lift < np.inf:
        raise refused(f"must be at least 0; got {lift:g}.", field="lift")
    rotation = _rotation_of(tool_axis)
    suffix = path.suffix.lower()
    if suffix not in (*TABLES, *PROGRAMS, *DRAWINGS):
        known = ", ".join((*TABLES, *PROGRAMS, *DRAWINGS))
        raise refused(f"must have one of the suffixes {known}; got {path.name}.")
    content = bounded(read_bytes(path) if content is None else content)
    if suffix in PROGRAMS:
        tool_path = read_gcode(text_of(content), METRES[units or "mm"], rotation)
    elif suffix in DRAWINGS:
        tool_path = read_dxf(content, None if units is None else METRES[units], rotation, lift)
    else:
        table, length = Table(text_of(content)), METRES[units or "m"]
        if not has_poses(table):
            return _joint_path(*read_joint_positions(table, robot, length, RADIANS[angle]), blend)
        tool_path = read_poses(table, length, RADIANS[angle], rotation)
    return PathFile(tuple(to_waypoints(tool_path, frame, blend)), tuple(tool_path.notes))


def _joint_path(positions: FloatArray, notes: Sequence[str], blend: float | None) -> PathFile:
    """Return joint positions as waypoints."""
    if not len(positions):
        raise refused("must have a row below the header.")
    inside = StopTransition() if blend is None else BlendTransition(blend)
    transitions = [inside] * (len(positions) - 1) + [StopTransition()]
    waypoints = [
        JointWaypoint(position, transition=transition)
        for position, transition in zip(positions.tolist(), transitions, strict=True)
    ]
    return PathFile(tuple(waypoints), tuple(notes))


def _rotation_of(tool_axis: Sequence[float]) -> FloatArray:
    """Return the rotation with a z axis; its x axis is nearest to the frame's x axis, else y axis.

    Raises:
        InvalidProblem: The axis is no direction.
    """
    axis = np.array(tool_axis, dtype=np.float64)
    length = np.linalg.norm(axis)
    if axis.shape != (len(DOWN),) or not 0.0 < length < np.inf:
        raise refused(f"must be three numbers, not all 0; got {list(tool_axis)}.", field="tool_axis")
    z = axis / length
    along = np.array([1.0, 0.0, 0.0] if abs(z[0]) < ALONG_X else [0.0, 1.0, 0.0])
    x = along - (along @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
