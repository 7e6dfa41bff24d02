"""Saved plans, files of `plan.save`: read, and converted to other formats by `planner convert`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from api.work.answers.formats import FORMATS, Format
from api.work.answers.plans import AnswerOptions
from cli.work.local_plan import format_of
from cli.work.shared import read, refusals, write
from cli.work.terminal import terminal
from planner.plans.result import load

if TYPE_CHECKING:
    from planner.plans.result import Plan

SAVED_PLAN = b"planner-plan/"
"""The beginning of a file of `plan.save`."""


def chosen_format(output: str, name: str | None) -> Format:
    """Return the format of a name, or the format of the suffix of a file, or JSON for stdout (`-`).

    Raises:
        BadParameter: There is none.
    """
    form = FORMATS.get(name or "json") if output == "-" or name is not None else format_of(output)
    if form is None and name is not None:
        raise typer.BadParameter(f"must be one of {', '.join(FORMATS)}", param_hint="--format")
    if form is None:
        suffixes = ", ".join(known.suffix for known in FORMATS.values())
        raise typer.BadParameter(f"must end with one of {suffixes}", param_hint="--output")
    return form


def read_saved_plan(file: str) -> Plan:
    """Read a saved plan.

    Raises:
        BadParameter: The file is stdin, is damaged, or is of another version.
    """
    if file == "-":
        raise typer.BadParameter("a saved plan is read from a file, not from stdin", param_hint="FILE")
    try:
        return load(file)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="FILE") from None


def convert_file(file: str, output: str, name: str | None, period: float, repeat: int) -> None:
    """Write a saved plan in another format; see `planner convert`."""
    form = chosen_format(output, name)
    if file != "-" and not read(file, "FILE").startswith(SAVED_PLAN):
        message = f"{file} is no saved plan: planner plan --save writes one, and planner plan -o converts requests"
        raise typer.BadParameter(message, param_hint="FILE")
    plan = read_saved_plan(file)
    include = frozenset({"polynomials"} if form is FORMATS["json"] else ())
    with refusals():
        written = form.render(plan, AnswerOptions(period, include, repeat))
    if output == "-":
        sys.stdout.buffer.write(written)
    else:
        write(Path(output), written, terminal())
