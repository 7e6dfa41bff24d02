"""Sizes of proof files, times to write and check them, and verdicts of both checkers on tampered ones."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import machine, print_machine
from benchmarks.proofs.plans import plans
from benchmarks.proofs.tampering import tampered
from cli.work.terminal import plain_table, terminal
from planner import ProofRejected, check_proof, write_proof

GO_SOURCE = Path(__file__).parents[2] / "clients" / "proof_checker"

GO_SECONDS = 120
"""Most processor time of the checker in Go for one file, s; the slowest file known takes a tenth of it."""


def measure(count: int, changes: int, seconds: float) -> dict[str, Any]:
    """Write and check proofs of random plans; then tamper with them for so many seconds at most."""
    place = machine()
    rows, proofs = [], []
    with tempfile.TemporaryDirectory() as folder:
        go = _built(Path(folder))
        for plan in plans(np.random.default_rng(1), count):
            start = time.perf_counter()
            proof = write_proof(plan)
            written = time.perf_counter()
            text = json.dumps(proof)
            check_proof(text)
            checked = time.perf_counter()
            row = {"plan": repr(plan), "pieces": len(plan.trajectory.lengths), "bytes": len(text)}
            row |= {"write": written - start, "check": checked - written, "claims": len(proof["statement"]["claims"])}
            if go is not None:
                accepted = _is_accepted(go, text)
                row |= {"go": time.perf_counter() - checked, "go_accepts": accepted}
            rows.append(row)
            proofs.append(proof)
        return {"machine": place, "proofs": rows, "tampered": _tampered(proofs, go, changes, seconds)}


def _tampered(proofs: list[dict[str, Any]], go: Path | None, changes: int, seconds: float) -> dict[str, Any]:
    """Return how many tampered files each checker tried and rejected within so many seconds."""
    generator, found = np.random.default_rng(2), Counter[str]()
    checkers = {"Python": _is_rejected} | ({} if go is None else {"Go": partial(_is_rejected_by_go, go)})
    left = dict.fromkeys(checkers, seconds)
    each = -(-changes // len(proofs))
    for proof in proofs:
        files = [json.dumps(changed) for _, changed in tampered(proof, generator, each)]
        found["files"] += len(files)
        for name, is_rejected in checkers.items():
            for file in files:
                if left[name] <= 0.0:
                    break
                start = time.perf_counter()
                found[f"tried in {name}"] += 1
                found[f"rejected by {name}"] += is_rejected(file)
                left[name] -= time.perf_counter() - start
    return dict(found)


def _is_rejected(file: str) -> bool:
    try:
        check_proof(file)
    except ProofRejected:
        return True
    return False


def _is_rejected_by_go(go: Path, file: str) -> bool:
    return not _is_accepted(go, file)


def _built(folder: Path) -> Path | None:
    """Compile the checker in Go; None without a compiler."""
    if shutil.which("go") is None:
        return None
    subprocess.run(["go", "build", "-o", str(folder / "checker"), "."], cwd=GO_SOURCE, check=True)
    return folder / "checker"


def _is_accepted(go: Path, file: str) -> bool:
    """Tell whether the checker in Go accepts a file.

    Raises:
        subprocess.CalledProcessError: It crashed, or used more than `GO_SECONDS` of processor time.
    """
    done = subprocess.run(
        [go, "-"],
        input=file,
        capture_output=True,
        text=True,
        check=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (GO_SECONDS, GO_SECONDS)),
    )
    return done.stdout.startswith("accepted")


def print_table(figures: dict[str, Any]) -> None:
    """Print the figures for a person."""
    console = terminal()
    print_machine(console, figures["machine"])
    table = plain_table("plan", "pieces", "claims", "kB", "write, s", "check in Python, s", "in Go, s")
    for row in figures["proofs"]:
        times = [f"{row[name]:.2f}" if name in row else "-" for name in ("write", "check", "go")]
        table.add_row(row["plan"], str(row["pieces"]), str(row["claims"]), f"{row['bytes'] / 1e3:.0f}", *times)
    console.print(table)
    for name, number in figures["tampered"].items():
        console.print(f"{name}: {number} tampered files" if name == "files" else f"{name}: {number}")
