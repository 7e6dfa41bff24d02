"""The figures of the inverse kinematics for a person."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import orjson

from benchmarks.kinematics.check import CLASSES
from benchmarks.machine import print_machine
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from rich.console import Console

AIMS = {"solved": 0.999, "mean": 0.3e-3, "p99": 2e-3, "worst_residual": 1e-6, "sequence": 20e-3, "wrong": 0}
"""Share, s, s, m and rad, s, answers."""


def print_json(figures: dict[str, Any]) -> None:
    sys.stdout.write(orjson.dumps(figures | {"aims": AIMS}, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    print_machine(console, figures["machine"])
    console.print(f"{figures['poses']} random reachable poses of each arm, one process; times in ms")
    aims = "aims: 99.9 % solved, mean 0.3, p99 2, residual 1e-6 m and rad; a sequence of 20 poses in 20; nothing wrong"
    console.print(aims + "\n", style="dim")
    columns = ["solver", "solved", "mean", "p50", "p99", "worst residual", "wrong"]
    for arm, measured in figures["arms"].items():
        table = plain_table(*columns, right=columns[1:], title=arm)
        for solver, row in measured["solvers"].items():
            residual = "" if row["worst_residual"] is None else f"{row['worst_residual']:.0e}"
            style = "bold" if solver == "planner" else ""
            table.add_row(solver, f"{row['solved']:.2%}", *_milliseconds(row), residual, str(row["wrong"]), style=style)
        table.add_row("planner, all solutions", "", *_milliseconds(measured["all_solutions"]), "", "")
        table.add_row("planner, all solutions of 20 poses", "", *_milliseconds(measured["layers"]), "", "")
        sequence = measured["sequence"]
        solved = 1.0 - sequence["refused"] / sequence["count"]
        table.add_row("planner, sequence of 20 poses", f"{solved:.2%}", *_milliseconds(sequence), "", "")
        console.print(table, "")
    _print_checks(console, figures)
    console.print("wrong: called solved, but outside the limits or further from the pose than 1e-6", style="dim")
    prepared = max(measured["prepare"] for measured in figures["arms"].values())
    console.print(f"table of starts, once per robot and process: {prepared * 1e3:.0f} ms at most", style="dim")
    for name in figures["absent"]:
        console.print(f"not installed, not measured: {name}", style="yellow")


def _print_checks(console: Console, figures: dict[str, Any]) -> None:
    columns = ["requests", "asked", "solved", "answers", "wrong", "worst error"]
    title = "random requests to all arms, every answer checked by a plain product of matrices"
    table = plain_table(*columns, right=columns[1:], title=title)
    for name in CLASSES:
        rows = [measured["check"][name] for measured in figures["arms"].values()]
        totals = [str(sum(row[key] for row in rows)) for key in ("requests", "solved", "answers", "wrong")]
        table.add_row(name, *totals, f"{max(row['worst'] for row in rows):.0e}")
    console.print(table, "")


def _milliseconds(times: dict[str, float]) -> tuple[str, ...]:
    return tuple(f"{times[key] * 1e3:.3f}" for key in ("mean", "p50", "p99"))
