"""The figures for a person, beside the targets."""

from __future__ import annotations

import sys
from typing import Any

import orjson
from rich.text import Text

from benchmarks.machine import print_machine
from benchmarks.service.http import MEGABYTE
from cli.work.terminal import plain_table, terminal

AIMS = {"added_median": 1e-3, "added_p99": 5e-3, "requests_per_second": 800.0, "start": 3.0, "memory": 180.0 * MEGABYTE}
"""s, 1/s, bytes."""

STAGES = (
    ("plan", "inverse kinematics, time law, certificate"),
    ("queue", "parse, hand the request to a worker"),
    ("validate", "schema, conversion, request hash"),
    ("serialise", "sample, write JSON"),
    ("hand_over", "bring the answer back, rest of the server"),
    ("transport", "sockets and client"),
    ("client_total", "all of it, as the client sees it"),
)


def print_json(figures: dict[str, Any]) -> None:
    sys.stdout.write(orjson.dumps(figures | {"aims": AIMS}, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    latency, memory = figures["latency"], figures["memory"]
    print_machine(console, figures["machine"])
    console.print(f"{figures['workers']} workers, answers of {latency['response_bytes'] / 1e3:.0f} kB\n")
    console.print(_overview(figures), "")
    console.print(_where_the_time_goes(figures), "")
    console.print(_throughput(figures), "")
    table = plain_table("MB", "RSS", "PSS", "USS", right=["RSS", "PSS", "USS"], title="Memory")
    for when, title in (("idle", "idle"), ("after_load", "after load")):
        for process in ("worker", "server"):
            sizes = memory[when][process]
            table.add_row(f"{process}, {title}", *(f"{sizes[kind] / MEGABYTE:.0f}" for kind in ("rss", "pss", "uss")))
    console.print(table, "")


def _overview(figures: dict[str, Any]) -> Any:
    added, start = figures["latency"]["added"], figures["start_to_ready"]
    best = max(figures["throughput"], key=lambda load: load["requests_per_second"])
    memory = figures["memory"]["after_load"]["worker"]["rss"]
    table = plain_table("figure", "measured", "aim", "worst seen", right=["measured", "aim", "worst seen"])
    rows = (
        ("added to the plan, median", added["median"], AIMS["added_median"], 1e3, "ms", added["worst"]),
        ("added to the plan, 99 of 100", added["p99"], AIMS["added_p99"], 1e3, "ms", None),
        ("start to ready", start["median"], AIMS["start"], 1.0, "s", start["worst"]),
        ("memory of a worker after load (RSS)", memory, AIMS["memory"], 1.0 / MEGABYTE, "MB", None),
    )
    rate, aim = best["requests_per_second"], AIMS["requests_per_second"]
    for name, value, bound, scale, unit, worst in rows:
        measured = Text(f"{value * scale:.3g} {unit}", style="green" if value <= bound else "yellow")
        table.add_row(
            name, measured, f"{bound * scale:.3g} {unit}", "" if worst is None else f"{worst * scale:.3g} {unit}"
        )
    table.add_row(
        f"requests a second ({best['connections']} clients)",
        Text(f"{rate:.0f}", style="green" if rate >= aim else "yellow"),
        f"{aim:.0f}",
        "",
    )
    return table


def _where_the_time_goes(figures: dict[str, Any]) -> Any:
    latency = figures["latency"]
    numbers = ["median", "99 of 100", "worst"]
    title = f"Where the time goes, ms (one client, {latency['requests']} requests)"
    table = plain_table("stage", *numbers, "what", right=numbers, title=title)
    for name, what in STAGES:
        values = latency[name]
        style = "bold" if name == "client_total" else ""
        cells = (f"{values[key] * 1e3:.3f}" for key in ("median", "p99", "worst"))
        table.add_row(name.replace("_", " "), *cells, Text(what, style="dim"), style=style)
    return table


def _throughput(figures: dict[str, Any]) -> Any:
    numbers = ["clients", "requests/s", "median", "99 of 100", "worst", "failed", "workers", "server", "client"]
    alone = figures["in_process"]
    title = (
        "Requests a second; latency, and processor time for a request, in ms\n"
        f"(the library alone, in process on one core: {alone['plans_per_second']:.0f} a second)"
    )
    table = plain_table(*numbers, right=numbers, title=title)
    for load in figures["throughput"]:
        table.add_row(
            str(load["connections"]),
            f"{load['requests_per_second']:.0f}",
            *(f"{load[f'latency_{key}'] * 1e3:.1f}" for key in ("median", "p99", "worst")),
            str(load["failures"]),
            *(f"{load[f'{who}_cpu'] * 1e3:.2f}" for who in ("workers", "server", "client")),
        )
    return table
