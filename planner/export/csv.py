"""CSV: one row a sample, one column a number, SI units."""

from __future__ import annotations

import re

import numpy as np
import orjson

from planner.export.base import ExportOptions, Format, refuse_actions
from planner.kinematics import FloatArray
from planner.plans.result import Plan

FORMULA = re.compile(r"(?<![^,;\s\"])(?=[=+@-])")
"""The places where a spreadsheet would see a formula begin: at the start, or behind what may separate cells."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan in columns `time`, `segment`, `position.<joint>`, `velocity.<joint>`, ... and the included parts.

    Lines end in CRLF, as in RFC 4180.

    Raises:
        UnsupportedFormat: The plan has actions.
    """
    refuse_actions(plan, "CSV")
    names = plan.path.robot.joint_names
    samples = plan.samples(options.sample_period, options.include)
    header, blocks = ["time", "segment"], [samples.time[:, None], samples.segment[:, None].astype(float)]

    def add(quantity: str, columns: tuple[str, ...], values: FloatArray | None) -> None:
        """Add the columns of a quantity, if it is included."""
        if values is not None:
            header.extend(f"{quantity}.{column}" for column in columns)
            blocks.append(values)

    add("position", names, samples.position)
    add("velocity", names, samples.velocity)
    add("acceleration", names, samples.acceleration)
    add("jerk", names, samples.jerk)
    add("torque", names, samples.torque)
    add("tcp_position", ("x", "y", "z"), samples.tcp_position)
    add("tcp_quaternion", ("x", "y", "z", "w"), samples.tcp_quaternion)
    add("tcp_rpy", ("roll", "pitch", "yaw"), samples.tcp_rpy)
    for quantity, values in (("velocity", samples.tcp_velocity), ("acceleration", samples.tcp_acceleration)):
        for kind, rows in zip(("linear", "angular"), values or (None, None), strict=True):
            add(f"tcp_{kind}_{quantity}", ("x", "y", "z"), rows)
    table = np.hstack(blocks)
    # orjson writes the shortest digits that read back exactly, many times faster than the csv module.
    body = orjson.dumps(table, option=orjson.OPT_SERIALIZE_NUMPY)[2:-2].replace(b"],[", b"\r\n")
    return ",".join(map(quoted, header)).encode() + b"\r\n" + body + b"\r\n"


def quoted(cell: str) -> str:
    """Quote a cell with a comma, a quote or a line break by RFC 4180; turn formulas into text."""
    cell = FORMULA.sub("'", cell)
    if any(mark in cell for mark in ',"\r\n'):
        return '"' + cell.replace('"', '""') + '"'
    return cell


FORMAT = Format("csv", "text/csv", ".csv", render)
"""The form for spreadsheets: rows of samples."""
