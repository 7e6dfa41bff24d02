"""Sizes of proof files, times to write and check them, and verdicts of both checkers on tampered ones."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import machine, print_machine
from benchmarks.proofs.plans import plans
from benchmarks.proofs.tampering import tampered
from cli.work.terminal import plain_table, terminal
from planner import ProofRejected, check_proof, write_proof

GO_SOURCE = Path(__file__).parents[2] / "clients" / "proof_checker"


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
                (accepted,) = _verdicts(go, [text])
                row |= {"go": time.perf_counter() - checked, "go_accepts": accepted}
            rows.append(row)
            proofs.append(proof)
        return {"machine": place, "proofs": rows, "tampered": _tampered(proofs, go, changes, seconds)}


def _tampered(proofs: list[dict[str, Any]], go: Path | None, changes: int, seconds: float) -> dict[str, Any]:
    """Return how many tampered files each checker rejected; Python's time is bounded."""
    generator, found, until = np.random.default_rng(2), Counter[str](), time.perf_counter() + seconds
    each = -(-changes // len(proofs))
    for proof in proofs:
        files = [json.dumps(changed) for _, changed in tampered(proof, generator, each)]
        found["files"] += len(files)
        if go is not None:
            found["rejected by Go"] += _verdicts(go, files).count(False)
        for file in files if time.perf_counter() < until else ():
            found["tried in Python"] += 1
            try:
                check_proof(file)
            except ProofRejected:
                found["rejected by Python"] += 1
    return dict(found)


def _built(folder: Path) -> Path | None:
    """Compile the checker in Go; None without a compiler."""
    if shutil.which("go") is None:
        return None
    subprocess.run(["go", "build", "-o", str(folder / "checker"), "."], cwd=GO_SOURCE, check=True)
    return folder / "checker"


def _verdicts(go: Path, files: list[str]) -> list[bool]:
    """Return whether the checker in Go accepts each file."""
    done = subprocess.run([go, "-"], input="\n".join(files), capture_output=True, text=True, check=True)
    return [line.startswith("accepted") for line in done.stdout.splitlines()]


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
