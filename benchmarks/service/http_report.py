"""The figures of both versions for a person, beside the targets."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import orjson
from rich.text import Text

from benchmarks.checkouts import NAMES, SLOWER
from benchmarks.machine import print_machine
from benchmarks.service.http import MEGABYTE
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from rich.table import Table

ADDED, START, MEMORY = 1e-3, 3.0, 180.0 * MEGABYTE
"""Aims for the median latency besides the plan, s, the start, s, and a worker, bytes."""

RATES = {2: 1000.0, 10: 500.0}
"""Aims for requests a second, by the number of waypoints."""

LATENCIES = {2: 1.5e-3, 10: 3e-3}
"""Aims for the median latency, s, by the number of waypoints."""

STAGES = (
    ("plan", "inverse kinematics, time scaling, certificate"),
    ("queue", "hand the request to a worker"),
    ("validate", "schema, conversion, request hash"),
    ("serialise", "sample, write JSON"),
    ("hand_over", "parse, bring the answer back, rest of the server"),
    ("transport", "sockets and client"),
    ("client_total", "all of it, as the client sees it"),
)

COLUMNS = (*NAMES, "ratio")


def print_json(figures: dict[str, Any]) -> None:
    document = orjson.dumps(figures, option=orjson.OPT_INDENT_2 | orjson.OPT_NON_STR_KEYS)
    sys.stdout.write(document.decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    print_machine(console, figures["machine"])
    alone = figures["in_process"]["plans_per_second"]
    console.print(f"{figures['workers']} workers; the library alone plans {alone:.0f} times 10 waypoints a second\n")
    console.print(_overview(figures), "")
    for size, versions in figures["latency"].items():
        console.print(_where_the_time_goes(size, versions), "")
    for size, loads in figures["throughput"].items():
        console.print(_throughput(size, loads), "")
    table = plain_table("MB", "RSS", "PSS", "USS", right=["RSS", "PSS", "USS"], title="Memory")
    for when, title in (("idle", "idle"), ("after_load", "after load")):
        for process in ("worker", "server"):
            for name in NAMES:
                sizes = figures["memory"][when][name][process]
                cells = (f"{sizes[kind] / MEGABYTE:.0f}" for kind in ("rss", "pss", "uss"))
                table.add_row(f"{process}, {title}, {name}", *cells)
    console.print(table, "")


def _overview(figures: dict[str, Any]) -> Table:
    table = plain_table("figure", *COLUMNS, "aim", right=[*COLUMNS, "aim"])
    start = [figures["start_to_ready"][name]["median"] for name in NAMES]
    table.add_row("start to ready, s", *_cells(*start), f"{START:g}")
    memory = [figures["memory"]["after_load"][name]["worker"]["rss"] / MEGABYTE for name in NAMES]
    table.add_row("memory of a worker after load (RSS), MB", *_cells(*memory), f"{MEMORY / MEGABYTE:g}")
    for size, versions in figures["latency"].items():
        for stage, words, aim in (
            ("added", "added to the plan", ADDED),
            ("client_total", "latency", LATENCIES[size]),
        ):
            for key in ("median", "p99"):
                times = [versions[name][stage][key] * 1e3 for name in NAMES]
                said = f"{aim * 1e3:g}" if key == "median" else ""
                table.add_row(f"{words}, {size} waypoints, {key}, ms", *_cells(*times), said)
    for size, loads in figures["throughput"].items():
        rates = [max(load[name]["requests_per_second"] for load in loads) for name in NAMES]
        table.add_row(f"requests a second, {size} waypoints", *_rates(*rates), f"{RATES[size]:g}")
    return table


def _cells(before: float, now: float) -> tuple[str, str, Text]:
    """Write a figure of both versions, and the ratio, red where it has grown by more than 5 %."""
    ratio = now / before
    return f"{before:.3f}", f"{now:.3f}", Text(f"{ratio:.3f}", style="red" if ratio > SLOWER else "green")


def _rates(before: float, now: float) -> tuple[str, str, Text]:
    """Write a rate of both versions, and the ratio, red where it has fallen by more than 5 %."""
    ratio = now / before
    return f"{before:.0f}", f"{now:.0f}", Text(f"{ratio:.3f}", style="red" if ratio * SLOWER < 1.0 else "green")


def _where_the_time_goes(size: int, versions: dict[str, Any]) -> Table:
    title = f"Where the time goes: median of one client's requests with {size} waypoints, ms"
    table = plain_table("stage", *COLUMNS, "what", right=COLUMNS, title=title)
    for name, what in STAGES:
        times = [versions[version][name]["median"] * 1e3 for version in NAMES]
        style = "bold" if name == "client_total" else ""
        table.add_row(name.replace("_", " "), *_cells(*times), Text(what, style="dim"), style=style)
    return table


def _throughput(size: int, loads: list[dict[str, Any]]) -> Table:
    numbers = ["requests/s", "ratio", "median", "99 of 100", "worst", "failed", "workers", "server", "client"]
    title = f"Requests a second with {size} waypoints; latency, and processor time for a request, in ms"
    table = plain_table("clients", *numbers, right=numbers, title=title)
    for load in loads:
        ratio = _rates(*(load[name]["requests_per_second"] for name in NAMES))[2]
        for name in NAMES:
            own = load[name]
            table.add_row(
                f"{own['connections']}, {name}",
                f"{own['requests_per_second']:.0f}",
                ratio if name == "now" else "",
                *(f"{own[f'latency_{key}'] * 1e3:.1f}" for key in ("median", "p99", "worst")),
                str(own["failures"]),
                *(f"{own[f'{who}_cpu'] * 1e3:.2f}" for who in ("workers", "server", "client")),
            )
    return table
