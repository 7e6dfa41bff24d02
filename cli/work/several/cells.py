"""Cells of several robots without a service: `planner cell`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from api.work.answers.formats import FORMATS
from api.work.conversion.problems import to_backend, to_planning_problem
from cli.work.local_plan import read_request, render
from cli.work.shared import read, refusals, write
from cli.work.terminal import terminal
from planner.cells import CellRobot, plan_cell
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.cells import CellPlan


def cell_files(requests: Sequence[str], output: Path | None, format_: str, margin: float, skew: float) -> None:
    """Plan the requests in files as a cell, show waits and clearances, and write the trajectories into a folder."""
    form = FORMATS.get(format_)
    if form is None:
        raise typer.BadParameter(f"must be one of {', '.join(FORMATS)}", param_hint="--format")
    if output is not None and not output.is_dir():
        raise typer.BadParameter(f"{output}: no such folder", param_hint="--output")
    texts = [read(name) for name in requests]
    with refusals():
        asked = [read_request(text) for text in texts]
        robots = [
            CellRobot(Path(name).stem, to_planning_problem(one, load_robot(one.robot)), to_backend(one.backend))
            for name, one in zip(requests, asked, strict=True)
        ]
        start = time.perf_counter()
        cell = plan_cell(robots, margin=margin, skew=skew)
        taken = time.perf_counter() - start
        files = [render(plan, one, form) for plan, one in zip(cell.plans, asked, strict=True)]
    console = terminal(stderr=False)
    console.print(_robots_table(cell), _clearances_table(cell))
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
