"""Sizes of proof files, times to write and check them, and the verdicts of both checkers in the large run."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import machine, print_machine
from benchmarks.proofs.plans import plans
from benchmarks.proofs.verdicts import FILES_OF_PLAN, go_checker, run
from cli.work.terminal import plain_table, terminal
from planner import check_proof, write_proof


def measure(count: int, files: int, seconds: float, results: Path | None) -> dict[str, Any]:
    """Write and check proofs of random plans; then try honest and tampered files for so many seconds at most."""
    place, rows = machine(), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with go_checker(folder) as go:
            for plan in plans(np.random.default_rng(1), count):
                start = time.perf_counter()
                proof = write_proof(plan)
                written = time.perf_counter()
                text = json.dumps(proof)
                check_proof(text)
                checked = time.perf_counter()
                row = {"plan": repr(plan), "pieces": len(plan.trajectory.lengths), "bytes": len(text)}
                row |= {
                    "write": written - start,
                    "check": checked - written,
                    "claims": len(proof["statement"]["claims"]),
                }
                if go is not None:
                    row |= {"go_accepts": not go.rejects(text), "go": time.perf_counter() - checked}
                rows.append(row)
        found = run(-(-files // FILES_OF_PLAN), seconds, results or folder / "verdicts.jsonl", folder)
    return {"machine": place, "proofs": rows, "verdicts": found}


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    console = terminal()
    print_machine(console, figures["machine"])
    table = plain_table("plan", "pieces", "claims", "kB", "write, s", "check in Python, s", "in Go, s")
    for row in figures["proofs"]:
        times = [f"{row[name]:.2f}" if name in row else "-" for name in ("write", "check", "go")]
        table.add_row(row["plan"], str(row["pieces"]), str(row["claims"]), f"{row['bytes'] / 1e3:.0f}", *times)
    console.print(table)
    table = plain_table("kind of file", "files", "rejected by Python", "by Go")
    for kind, found in figures["verdicts"]["kinds"].items():
        table.add_row(kind, *(str(found[name]) for name in ("files", "rejected by Python", "rejected by Go")))
    console.print(table)
    for number, kind, python, go in figures["verdicts"]["wrong"]:
        console.print(f"plan {number}, {kind}: rejected by Python {python}, by Go {go}")
