"""Files of trajectories that `planner validate` reads: requests, answers of plans, and CSV."""

from __future__ import annotations

import csv
from io import StringIO
from typing import TYPE_CHECKING, Any

import orjson
import typer

from api.base.errors import invalid, invalid_at
from api.contract.requests import ValidateRequest
from api.work.tasks.trajectories import validation_of
from cli.work.local_plan import checked_request
from cli.work.robots.files import FileOptions, NamedRobot
from cli.work.shared import read, refusals, robot_named
from cli.work.terminal import certificate_table, terminal, warning_line

if TYPE_CHECKING:
    from pathlib import Path

CHECKED_COLUMNS = ("position", "velocity", "acceleration")
"""The quantities of a CSV file that are checked; others may stand beside them."""


def read_trajectory(text: bytes, robot: str | None = None, interpolation: str | None = None) -> ValidateRequest:
    """Read a trajectory to check against limits.

    Args:
        text: A request of POST /v1/trajectories/validate, an answer of POST /v1/trajectories, or CSV with the columns
            `time`, `position.<joint>` and perhaps `velocity.<joint>` and `acceleration.<joint>`.
        robot: The id of the robot in place of the document's; CSV names none.
        interpolation: The interpolation of the controller, in place of the document's.

    Raises:
        InvalidRequest: With everything that is wrong with it.
    """
    document = _document(text)
    if isinstance(document, dict):
        document |= {} if robot is None else {"robot": robot}
        document |= {} if interpolation is None else {"interpolation": interpolation}
    return checked_request(ValidateRequest, document)


def _document(text: bytes) -> Any:
    if not text.lstrip().startswith((b"{", b"[")):
        return {"samples": _columns(text)}
    try:
        document = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        raise invalid_at("", f"not JSON: {error}") from None
    return _of_answer(document) if isinstance(document, dict) and "certificate" in document else document


def _of_answer(answer: dict[str, Any]) -> dict[str, Any]:
    """Take the checked fields from an answer."""
    parts = {"robot": answer.get("robot"), "samples": answer.get("samples"), "polynomials": answer.get("polynomials")}
    if isinstance(parts["samples"], dict):
        parts["samples"] = {name: parts["samples"].get(name) for name in ("time", *CHECKED_COLUMNS)}
    if parts["polynomials"] is not None:
        parts["interpolation"] = "polynomials"
    return parts


def _columns(text: bytes) -> dict[str, Any]:
    """Read the columns of a CSV file by quantity; joints stay in the order of the file."""
    try:
        rows = list(csv.reader(StringIO(text.decode("utf-8-sig"), newline="")))
        header, values = rows[0], [[float(cell) for cell in row] for row in rows[1:] if row]
        time = header.index("time")
    except (UnicodeDecodeError, csv.Error, IndexError, ValueError) as error:
        raise invalid_at("", f"neither JSON nor CSV with a column `time`: {error}") from None
    if any(len(row) != len(header) for row in values):
        raise invalid(
            [{"pointer": "", "message": f"Each row of the CSV must have {len(header)} cells, as its header."}]
        )
    samples: dict[str, Any] = {"time": [row[time] for row in values]}
    for quantity in CHECKED_COLUMNS:
        columns = [k for k, name in enumerate(header) if name.startswith(f"{quantity}.")]
        if columns:
            samples[quantity] = [[row[k] for k in columns] for row in values]
    return samples


def validate_file(
    trajectory: str, interpolation: str | None, robot: str | None, srdf: Path | None, tip: str | None
) -> None:
    """Check the trajectory in a file against the limits of its robot; see `planner validate`."""
    text = read(trajectory, "TRAJECTORY")
    with refusals():
        named = None if robot is None else robot_named(robot, FileOptions(srdf, tip))
        asked = read_trajectory(text, None if named is None else named.id, interpolation)
        model = (named or NamedRobot(asked.robot)).load()
        found = validation_of(asked, model)
        warnings = list(found.warnings)
    console = terminal()
    console.print(certificate_table(found.certificate, model))
    if (collision := found.further.get("collision")) is not None:
        console.print(collision["detail"], style="red")
    console.print(f"interpolation: {found.interpolation}")
    for warning in warnings:
        console.print(warning_line(warning))
    if not found.certificate.satisfied:
        raise typer.Exit(1)
