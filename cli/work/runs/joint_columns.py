"""Joint values as `planner simulate` and `planner ros` show them: with units in tables, and as columns of CSV files."""

from __future__ import annotations

import csv
from io import StringIO
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from planner.robots import Robot


def joint_value(robot: Robot, joint: int, value: float) -> str:
    """Write a joint value, rad or m, in degrees or millimetres."""
    return f"{np.degrees(value):.4f} °" if robot.is_angle[joint] else f"{value * 1e3:.4f} mm"


def joint_columns(
    time: npt.NDArray[np.float64], joints: Sequence[str], quantities: Mapping[str, npt.NDArray[np.float64]]
) -> bytes:
    """Write a CSV file: the time (N,), s, and a column for each joint of quantities (N, joints) by name."""
    file = StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(["time", *(f"{name}.{joint}" for name in quantities for joint in joints)])
    writer.writerows(np.column_stack([time, *quantities.values()]).tolist())
    return file.getvalue().encode()
