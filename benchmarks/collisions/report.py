"""The figures of free motions for a person."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import orjson

from benchmarks.collisions.measure import OURS
from benchmarks.machine import print_machine
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from rich.console import Console

AIMS = {"solved": 0.99, "p50": {"panda": 0.15, "ur5": 0.3}, "p95": 1.5, "touching": 0.0}
"""Share; s, of an arm; s; share."""


def print_json(figures: dict[str, Any]) -> None:
    sys.stdout.write(orjson.dumps(figures | {"aims": AIMS}, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    print_machine(console, figures["machine"])
    console.print(f"scenes: {', '.join(figures['kinds'])}; times in ms, of the processor\n")
    columns = ["planner", "solved", "wrong", "p50", "p95", "length", "duration", "touching"]
    for arm, measured in figures["arms"].items():
        table = plain_table(*columns, right=columns[1:], title=f"{arm}, {measured['problems']} problems")
        for name, row in measured["solvers"].items():
            table.add_row(name, *_cells(row), style="bold" if name == OURS else "")
        console.print(table)
        console.print(f"{measured['no_way']} of these problems have no way at all, as ours proved")
        for one in measured["unsolved"]:
            if not one["no_way"]:
                by = ", ".join(one["found_by"]) or "nobody: there may be none"
                console.print(f"not solved in time by ours: {one['kind']} {one['number']}; a way was found by {by}")
        console.print()
        _print_proofs(console, arm, measured["proofs"])
    for line in (
        "aims: 99 % solved, p50 150 ms for panda and 300 ms for ur5, p95 1500 ms, none touching",
        f"solved: in {figures['seconds']:g} s, of those not proved to have no way; wrong: answers to these",
        "ours: found, timed and certified; the others': a path, made shorter",
        "length: of the joints' way, rad; duration: s, of what we deliver, and of the others' paths as we time them",
        "touching: the share of answers that touch something, of samples 5 mm apart and closer, with the true meshes",
    ):
        console.print(line, style="dim")
    for name in figures["absent"]:
        console.print(f"not installed, not measured: {name}", style="yellow")


def _cells(row: dict[str, Any]) -> list[str]:
    counts = [f"{row['solved']}/{row['solvable']}", str(row["wrong"])]
    if not row["solved"]:
        return [*counts, *[""] * 5]
    duration = "" if row["duration"] is None else f"{row['duration']:.2f}"
    times = [f"{row[key] * 1e3:.0f}" for key in ("p50", "p95")]
    return [*counts, *times, f"{row['length']:.2f}", duration, f"{row['touching']:.1%}"]


def _print_proofs(console: Console, arm: str, proofs: dict[str, Any]) -> None:
    columns = ["among", "free", "proof p50", "p95", "clearance to 1 mm p50", "p95"]
    table = plain_table(*columns, right=columns[1:], title=f"{arm}, proofs of random motions")
    for name, row in proofs.items():
        cells = [
            "" if row[what] is None else f"{row[what][key] * 1e3:.1f}"
            for what in ("proof", "clearance")
            for key in ("p50", "p95")
        ]
        table.add_row(name, f"{row['free']}/{row['of']}", *cells)
    console.print(table, "")
