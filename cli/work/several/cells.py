"""Cells of several robots without a service: `planner cell`."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from api.contract.cells import CellRequest
from api.work.answers.cells import options_of_plans
from api.work.answers.formats import FORMATS
from api.work.conversion.cells import in_request, rules_of, to_cell
from api.work.conversion.task_orders import at_field
from cli.work.local_plan import read_document
from cli.work.shared import read, refusals, write
from cli.work.terminal import terminal
from planner.cells import plan_cell
from planner.robots import load_robot

if TYPE_CHECKING:
    from pathlib import Path

    from planner.cells import CellPlan


def cell_file(request: str, output: Path | None, format_: str) -> None:
    """Plan the cell in a file, show waits and clearances, and write the trajectories into a folder."""
    form = FORMATS.get(format_)
    if form is None:
        raise typer.BadParameter(f"must be one of {', '.join(FORMATS)}", param_hint="--format")
    if output is not None and not output.is_dir():
        raise typer.BadParameter(f"{output}: no such folder", param_hint="--output")
    text = read(request)
    with refusals(), at_field(in_request):
        asked, _ = read_document(CellRequest, text, {})
        robots, scene = to_cell(asked, [load_robot(member.robot) for member in asked.robots])
        start = time.perf_counter()
        cell = plan_cell(robots, scene=scene, **rules_of(asked))
        taken = time.perf_counter() - start
        options = options_of_plans(asked, {})
        if form is FORMATS["json"]:
            options = [replace(own, include=own.include | {"polynomials"}) for own in options]
        files = [form.render(plan, own) for plan, own in zip(cell.plans, options, strict=True)]
    console = terminal(stderr=False)
    console.print(_robots_table(cell), _clearances_table(cell))
    for meeting in cell.meetings:
        console.print(f"{' and '.join(meeting.waypoints)} meet at {meeting.name!r} until {meeting.time:.3f} s")
    console.print(f"all end after {cell.duration:.4g} s; planned in {taken * 1e3:.0f} ms")
    for name, content in zip(cell.names, files, strict=True):
        if output is not None:
            write(output / f"{name}{form.suffix}", content, console)


def _robots_table(cell: CellPlan) -> Table:
    """Return the durations and waits of the robots."""
    table = Table("Robot", "alone, s", "here, s", "waits", box=None, title_justify="left")
    for name, alone, plan, waits in zip(cell.names, cell.unhindered, cell.plans, cell.waits, strict=True):
        texts = [f"{wait:.3f} s at waypoint {k}" for k, wait in enumerate(waits) if wait > 0.0]
        table.add_row(name, f"{alone:.3f}", f"{plan.trajectory.duration:.3f}", ", ".join(texts) or "none")
    return table


def _clearances_table(cell: CellPlan) -> Table:
    """Return the proved clearance of each pair of robots, and the least distance seen."""
    table = Table("Clearance", "at least, m", "seen, m", "at, s", box=None, title_justify="left")
    for between in cell.clearances:
        clearance = between.clearance
        seen = ("", "") if clearance.upper is None else (f"{clearance.upper:.3f}", f"{clearance.time:.3f}")
        table.add_row(" and ".join(between.movers), f"{clearance.lower:.3f}", *seen)
    return table
