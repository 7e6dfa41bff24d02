"""The large run: verdicts of both checkers on thousands of honest, tampered and forged files."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import numpy as np

from benchmarks.proofs.plans import plan_of
from benchmarks.proofs.tampering import loosened, tampered, with_any_number_changed, with_digests
from planner import ProofRejected, check_proof, write_proof

if TYPE_CHECKING:
    from collections.abc import Iterator

GO_SOURCE = Path(__file__).parents[2] / "clients" / "proof_checker"

MOST_SECONDS = 300
"""Longest time of the checker in Go for one file, s; the slowest file known takes a hundredth of it."""

TAMPERING_SEED = 4
"""Seed of the changes of files."""

FILES_OF_PLAN = 10
"""Number of honest files of each plan, and of tampered ones."""

PLANS_BETWEEN_FORGED = 2
"""Number of plans to one forged file."""

HONEST = "honest"
FORGED = "forged"


class GoChecker:
    """The checker in Go as a process that reads files one a line."""

    def __init__(self, folder: Path) -> None:
        """Compile and start it."""
        program = folder / "checker"
        subprocess.run(["go", "build", "-o", str(program), "."], cwd=GO_SOURCE, check=True)
        self._process = subprocess.Popen([program, "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        self._files, self._answers = cast("IO[bytes]", self._process.stdin), cast("IO[bytes]", self._process.stdout)

    def rejects(self, file: str) -> bool:
        """Tell whether it rejects a file.

        Raises:
            RuntimeError: It crashed, or took more than `MOST_SECONDS`.
        """
        text = memoryview(file.encode() + b"\n")
        while text:
            text = text[self._files.write(text) :]
        if not select.select([self._answers], [], [], MOST_SECONDS)[0]:
            self._process.kill()
            raise RuntimeError(f"the checker in Go takes more than {MOST_SECONDS} s")
        answer = self._answers.readline()
        if not answer.startswith((b"accepted", b"rejected")):
            raise RuntimeError("the checker in Go crashed")
        return answer.startswith(b"rejected")

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


@contextmanager
def go_checker(folder: Path) -> Iterator[GoChecker | None]:
    """Start the checker in Go; None without a compiler."""
    if shutil.which("go") is None:
        yield None
        return
    checker = GoChecker(folder)
    try:
        yield checker
    finally:
        checker.close()


def python_rejects(file: str) -> bool:
    """Tell whether the checker in Python rejects a file."""
    try:
        check_proof(file)
    except ProofRejected:
        return True
    return False


def files_of(number: int) -> Iterator[tuple[str, str]]:
    """Yield honest and tampered files of a random plan, and a forged one at times, each with its kind."""
    proof, generator = write_proof(plan_of(number)), np.random.default_rng([TAMPERING_SEED, number])
    yield HONEST, json.dumps(proof)
    for _ in range(FILES_OF_PLAN - 1):
        yield HONEST, json.dumps(loosened(proof, generator))
    for kind, changed in tampered(proof, generator, FILES_OF_PLAN, FILES_OF_PLAN * number):
        yield kind, json.dumps(changed)
    if number % PLANS_BETWEEN_FORGED == 0:
        yield FORGED, json.dumps(with_digests(with_any_number_changed(proof, generator)))


def run(count: int, seconds: float, results: Path, folder: Path) -> dict[str, Any]:
    """Check the files of so many plans for so many seconds; go on where the file of results ends."""
    known = results.read_text().splitlines() if results.exists() else []
    begin = time.monotonic()
    with go_checker(folder) as go, results.open("a") as rows:
        for number in range(len(known), count):
            if time.monotonic() - begin > seconds:
                break
            row: dict[str, Any] = {"number": number, "verdicts": []}
            for kind, file in files_of(number):
                verdict = [kind, python_rejects(file), go.rejects(file) if go is not None else None]
                row["verdicts"].append(verdict)
            known.append(json.dumps(row))
            rows.write(known[-1] + "\n")
            rows.flush()
            os.fsync(rows.fileno())
    return counted([json.loads(row) for row in known])


def counted(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the verdicts by kind of file, and the numbers of plans with a wrong verdict or a disagreement."""
    kinds: dict[str, Counter[str]] = {}
    wrong: list[list[Any]] = []
    for row in rows:
        for kind, python, go in row["verdicts"]:
            of_kind = kinds.setdefault(kind, Counter())
            of_kind["files"] += 1
            of_kind["rejected by Python"] += python
            of_kind["rejected by Go"] += bool(go)
            is_wrong = kind != FORGED and (kind == HONEST) == python
            if is_wrong or go not in (None, python):
                wrong.append([row["number"], kind, python, go])
    return {"plans": len(rows), "kinds": {kind: dict(found) for kind, found in sorted(kinds.items())}, "wrong": wrong}
