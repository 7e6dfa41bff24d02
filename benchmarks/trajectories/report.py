"""The figures of the trajectories for a person."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import orjson
from rich.text import Text

from benchmarks.machine import print_machine
from benchmarks.trajectories.trajectories import KEPT, MOST_FOR_SLOW, QUANTITIES, REFERENCE, SAMPLES, SLOW
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from pathlib import Path

TITLES = {"through": "passing the waypoints", "stop": "stopping at each waypoint"}
WIDTH = 120
COLUMNS = ("solver", "time", "least", "most", "v", "a", "jerk", "over", "out", "missed", "ms", "p99", "refused")


def print_json(figures: dict[str, Any]) -> None:
    sys.stdout.write(orjson.dumps(figures, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    console.width = max(console.width, WIDTH)
    print_machine(console, figures["machine"])
    console.print(f"{figures['lists']} lists of 2 to 50 joint waypoints on {' and '.join(figures['arms'])}\n")
    for transition, solvers in figures["transitions"].items():
        table = plain_table(*COLUMNS, right=COLUMNS[1:], title=TITLES[transition])
        for name, row in solvers.items():
            table.add_row(name, *_cells(row), style="bold" if name.startswith("our ") else "")
        console.print(table, "")
    for line in (
        f"time, least, most: duration by that of our {REFERENCE}: median, least and most",
        f"v, a, jerk: worst use of a limit, of {SAMPLES} samples of each motion; -: no promise is made",
        "over: motions beyond a promised limit by more than 1e-6; out: motions that leave the joints' ranges",
        "missed: largest distance in any joint from a waypoint; ms, p99: median and 99 of 100, processor time",
        f"{SLOW}: only some lists of at most {MOST_FOR_SLOW} waypoints, with 16 knots; it does not minimise time",
    ):
        console.print(line, style="dim")
    for name in figures["absent"]:
        console.print(f"not installed, not measured: {name}", style="yellow")


def _cells(row: dict[str, Any]) -> list[str | Text]:
    ratio, compute = row["duration_ratio"], row["compute"]
    refused = f"{row['refused']}/{row['asked']}"
    if compute is None:
        return [*[""] * (len(COLUMNS) - 2), refused]
    times = [f"{ratio[key]:.3f}" for key in ("p50", "least", "most")] if ratio else [""] * 3
    over, outside = row["over_limit"], row["outside"]
    return [
        *times,
        *(_use(row["worst"][quantity], quantity in row["promised"]) for quantity in QUANTITIES),
        Text(str(over), style="red" if over else "green"),
        Text(str(outside), style="red" if outside else "green"),
        f"{row['waypoint_error']:.0e}",
        f"{compute['p50'] * 1e3:.1f}",
        f"{compute['p99'] * 1e3:.1f}",
        refused,
    ]


def _use(worst: float, promised: bool) -> Text:
    if not promised:
        return Text("-", style="dim")
    return Text(f"{worst:.4f}", style="red" if worst > KEPT else "green")


def draw(figures: dict[str, Any], file: Path) -> None:
    """Return the duration of every motion relative to the reference's, and its worst use of a promised limit."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 6.0), layout="constrained")
    panels = figure.subplots(1, len(figures["transitions"]), sharey=True)
    for panel, (transition, solvers) in zip(panels, figures["transitions"].items(), strict=True):
        reference = solvers[f"our {REFERENCE}"]["rows"]
        for name, solver in solvers.items():
            points = [
                (row["duration"] / best["duration"], max(row["use"][quantity] for quantity in solver["promised"]))
                for row, best in zip(solver["rows"], reference, strict=True)
                if row and best and "duration" in row and "duration" in best
            ]
            marker = "o" if name.startswith("our ") else "x"
            panel.plot(*zip(*points, strict=True), marker, label=name, alpha=0.6) if points else None
        panel.axhline(1.0, color="black", linewidth=0.8)
        panel.set(title=TITLES[transition], xlabel=f"duration / our {REFERENCE}")
        panel.legend(fontsize="small")
    panels[0].set_ylabel("worst use of a promised limit")
    figure.savefig(file)
