"""The comparison of two versions for a person."""

from __future__ import annotations

import sys
from typing import Any

import orjson
from rich.text import Text

from benchmarks.checkouts import NAMES, SLOWER
from benchmarks.machine import print_machine
from cli.work.terminal import plain_table, terminal

WIDTH = 140
"""Characters of a line that holds the longest name and all figures."""

COLUMNS = ("request", "before ms", "now ms", "time", "p99", "worst", "cost", "least", "most", "changed", "refused")


def print_json(figures: dict[str, Any]) -> None:
    sys.stdout.write(orjson.dumps(figures, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    console.width = max(console.width, WIDTH)
    print_machine(console, figures["machine"])
    table = plain_table(*COLUMNS, right=COLUMNS[1:])
    for row in figures["kinds"]:
        table.add_row(row["name"], *_cells(row))
    console.print(table, "")
    for line in (
        "before, now: processor time of the worker for a request; time, p99, worst: now's by before's, of each request",
        "cost, least, most: what the answers cost now by what they cost before (duration, effort, way of the joints)",
        "changed, refused: requests with answers of another cost, of all; requests refused before and now",
    ):
        console.print(line, style="dim")
    slower, kinds = len(figures["slower"]), len(figures["kinds"])
    console.print(f"\nslower by more than {100.0 * (SLOWER - 1.0):.0f} %: {slower} of {kinds} kinds")


def _cells(row: dict[str, Any]) -> list[str | Text]:
    refused = " ".join(str(row["refused"][name]) for name in NAMES)
    if row["times"] is None:
        return [*[""] * (len(COLUMNS) - 2), refused]
    time, cost = row["time"], row["cost"]
    return [
        *(f"{row['times'][name] * 1e3:.2f}" for name in NAMES),
        Text(f"{time['p50']:.3f}", style="red" if time["p50"] > SLOWER else "green"),
        *(f"{time[key]:.3f}" for key in ("p99", "worst")),
        *(f"{cost[key]:.4f}" for key in ("p50", "least", "most")),
        f"{row['changed']}/{row['requests']}",
        refused,
    ]
