"""The figures of overload for a person, beside the targets."""

from __future__ import annotations

import sys
from typing import Any

import orjson
from rich.text import Text

from benchmarks.machine import print_machine
from cli.work.terminal import plain_table, terminal

GOODPUT = 0.9
"""Least share of the capacity, or of the offered load if that is less, that is answered."""

REFUSAL = 1.1
"""s, within which 99 of 100 refusals come: the service delays them by up to 1 s where there are many."""

RETRYING_GOODPUT = 0.8
"""Least share of the capacity that is answered while connections repeat refused requests at once."""

LIVENESS = 1.0
"""s, within which 99 of 100 requests of the liveness are answered meanwhile."""

SLOWER = 5.0
"""Largest ratio of the p99 of cheap requests beside others to their p99 alone."""


def print_json(figures: dict[str, Any]) -> None:
    aims = {"goodput": GOODPUT, "refusal_p99": REFUSAL, "cheap_p99_ratio": SLOWER}
    aims |= {"retrying_goodput": RETRYING_GOODPUT, "liveness_p99": LIVENESS}
    sys.stdout.write(orjson.dumps(figures | {"aims": aims}, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(figures: dict[str, Any]) -> None:
    console = terminal()
    print_machine(console, figures["machine"])
    alone = figures["cheap_alone"]["latency"]
    title = (
        f"Arrivals for {figures['seconds']:g} s each, at a rate in times the capacity; p99 in ms\n"
        f"(cheap requests alone: {alone['p99'] * 1e3:.1f}; late: sent so much too late, for want of processors)\n"
        f"aims: goodput {GOODPUT:.0%} of the capacity, refusals within {REFUSAL:g} s, cheap {SLOWER:g} times"
    )
    numbers = ["rate", "asked/s", "goodput", "refused", "else", "p99", "refusal", "cheap", "times", "late"]
    table = plain_table("requests", *numbers, right=numbers, title=title)
    for load in figures["loads"]:
        cheap = load["cheap_beside"]["latency"]
        slower = cheap["p99"] / alone["p99"] if cheap else None
        table.add_row(
            load["requests"],
            f"{load['rate']:g}",
            f"{load['asked'] / figures['seconds']:.1f}",
            _judged(load["goodput"], load["goodput"] >= GOODPUT, "{:.0%}"),
            *(str(load[name]) for name in ("refused", "otherwise")),
            _milliseconds(load["latency"]),
            _milliseconds(load["refusal"], REFUSAL),
            _milliseconds(cheap),
            "" if slower is None else _judged(slower, slower <= SLOWER, "{:.1f}"),
            _milliseconds(load["sent_late"]),
        )
    console.print(table, "")
    title = (
        "Connections that repeat a refused request at once\n"
        f"aims: goodput {RETRYING_GOODPUT:.0%} of the capacity, /livez p99 within {LIVENESS:g} s"
    )
    numbers = ["capacity/s", "goodput", "refused", "else", "/livez p99 ms"]
    table = plain_table("connections", *numbers, right=["connections", *numbers], title=title)
    for load in figures["retrying"]:
        table.add_row(
            str(load["connections"]),
            f"{load['capacity']:.0f}",
            _judged(load["goodput"], load["goodput"] >= RETRYING_GOODPUT, "{:.0%}"),
            str(load["refused"]),
            str(load["otherwise"]),
            _milliseconds(load["liveness"]["latency"], LIVENESS),
        )
    console.print(table, "")


def _milliseconds(times: dict[str, float] | None, aim: float | None = None) -> Text:
    if times is None:
        return Text("")
    return _judged(times["p99"] * 1e3, aim is None or times["p99"] <= aim, "{:.1f}")


def _judged(value: float, is_good: bool, form: str) -> Text:
    return Text(form.format(value), style="" if is_good else "yellow")
