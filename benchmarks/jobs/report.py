"""The corpus's figures for a person."""

from __future__ import annotations

import sys
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from benchmarks.corpus.corpus import BACK_ENDS, VARIANTS
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from rich.console import Console

COLUMNS = ("planned", "refused", "crashed", "broken", "slow", "own path", "own law", "twin", "budget", "ms", "most")
GIVEN_UP = ("crashed", "died", "hung", "out_of_time")
EXAMPLES = 3
"""Of each kind of fault."""

MOST_CAUSES = 60
CAUSE_WORDS = 4
"""Words of a message that tell one cause from another."""


def print_json(records: list[dict[str, Any]]) -> None:
    sys.stdout.write(orjson.dumps(records, option=orjson.OPT_INDENT_2).decode() + "\n")


def print_table(records: list[dict[str, Any]]) -> None:
    """Print a table by family and back end, then the faults, most frequent first."""
    console = terminal()
    console.width = max(console.width, 140)
    for title, key, rows in (("by back end", "backend", BACK_ENDS), ("by family", "family", tuple(VARIANTS))):
        table = plain_table(title, "plans", *COLUMNS, right=["plans", *COLUMNS])
        for row in rows:
            chosen = [it for it in records if it.get(key, it["job"].split("-")[0]) == row]
            if chosen:
                table.add_row(row, *_cells(chosen))
        table.add_row("all", *_cells(records))
        console.print(table, "")
    console.print(_by_both(records), "")
    print_faults(console, records)


def _cells(records: list[dict[str, Any]]) -> list[str]:
    outcomes = Counter(it["outcome"] for it in records)
    kinds = Counter(kind for it in records for kind in {kind for kind, _ in it["faults"]})
    seconds = [it["seconds"] for it in records if "seconds" in it] or [np.nan]
    given_up = sum(outcomes[outcome] for outcome in GIVEN_UP)
    counts = (
        *(len(records), outcomes["planned"], kinds["refused"], given_up, kinds["broken"]),
        *(kinds["slow"], kinds["slow on its path"], kinds["slow by its law"]),
        *(kinds["unlike twin"], kinds["over budget"]),
    )
    return [*map(str, counts), f"{1e3 * np.median(seconds):.0f}", f"{1e3 * max(seconds):.0f}"]


def _by_both(records: list[dict[str, Any]]) -> Any:
    """Share of the plans without any fault, by family and back end."""
    table = plain_table("without a fault, of", *BACK_ENDS, right=BACK_ENDS)
    for family in VARIANTS:
        cells = []
        for kind in BACK_ENDS:
            chosen = [it for it in records if it["backend"] == kind and it["job"].split("-")[0] == family]
            cells.append(f"{sum(not it['faults'] for it in chosen)} / {len(chosen)}" if chosen else "")
        if any(cells):
            table.add_row(family, *cells)
    return table


def print_faults(console: Console, records: list[dict[str, Any]]) -> None:
    """Group faults into causes by kind and first words, with the smallest jobs that show them."""
    causes: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for it in records:
        for kind, what in it["faults"]:
            causes.setdefault((kind, cause(kind, what)), []).append(it)
    for (kind, what), found in sorted(causes.items(), key=lambda item: -len(item[1]))[:MOST_CAUSES]:
        back_ends = Counter(it["backend"] for it in found)
        families = Counter(it["job"].split("-")[0] for it in found)
        console.print(f"{len(found):4d} {kind}: {what}", style="bold")
        console.print(f"     {_listed(back_ends)}; {_listed(families)}", style="dim")
        smallest = {it["job"]: it for it in sorted(found, key=lambda it: -it.get("waypoints", 0))}
        for it in list(smallest.values())[: -EXAMPLES - 1 : -1]:
            full = next(text for its, text in it["faults"] if its == kind and cause(its, text) == what)
            console.print(f"     python -m benchmarks jobs --job {it['job']} --backend {it['backend']}")
            console.print(f"       {full}", style="dim")


def cause(kind: str, what: str) -> str:
    """Return the key of a cause: the first words without their numbers."""
    if kind in ("slow", "slow on its path", "slow by its law", "unlike twin", "over budget", "false warning"):
        return ""
    words = ("".join(letter for letter in word if not letter.isdigit()) for word in what.split())
    return " ".join(list(words)[:CAUSE_WORDS])


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())
