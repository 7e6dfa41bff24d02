"""The two checkers of proof files, in Python and in Go, agree on honest files, false ones and arbitrary changes."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.proofs.plans import plans
from benchmarks.proofs.tampering import KINDS, tampered, with_any_number_changed, with_digests
from planner import ProofRejected, check_proof, write_proof

SOURCE = Path(__file__).parents[1] / "proof_checker"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    built = tmp_path_factory.mktemp("go") / "proofchecker"
    for command in (["go", "vet", "."], ["go", "build", "-o", str(built), "."]):
        subprocess.run(command, cwd=SOURCE, check=True)
    for command in (["gofmt", "-l", "."],):
        assert not subprocess.run(command, cwd=SOURCE, check=True, capture_output=True).stdout
    return built


@pytest.fixture(scope="module")
def proofs() -> list[dict[str, Any]]:
    return [write_proof(plan) for plan in plans(np.random.default_rng(21), 5)]


def verdicts(program: Path, files: list[Any]) -> list[bool]:
    """Return whether Go accepts each file."""
    lines = "\n".join(json.dumps(file) for file in files)
    done = subprocess.run([program, "-"], input=lines, check=True, capture_output=True, text=True)
    found = [line.startswith("accepted") for line in done.stdout.splitlines()]
    assert len(found) == len(files)
    return found


def is_accepted(file: Any) -> bool:
    try:
        check_proof(file)
    except ProofRejected:
        return False
    return True


def test_both_accept_honest_files(program: Path, proofs: list[dict[str, Any]]) -> None:
    assert all(verdicts(program, proofs))
    assert all(map(is_accepted, proofs))


def test_both_reject_files_with_a_false_claim_or_a_gap(program: Path, proofs: list[dict[str, Any]]) -> None:
    generator = np.random.default_rng(1)
    files = [changed for proof in proofs for _, changed in tampered(proof, generator, len(KINDS))]
    assert not any(verdicts(program, files))
    assert not any(map(is_accepted, files))


def test_both_agree_on_any_changed_number(program: Path, proofs: list[dict[str, Any]]) -> None:
    """Half of the changes are of the last bit: most of those files are still true."""
    generator = np.random.default_rng(2)
    files = [with_digests(with_any_number_changed(proof, generator)) for proof in proofs * 6]
    found = verdicts(program, files)
    assert found == list(map(is_accepted, files))
    assert set(found) == {True, False}


@pytest.mark.parametrize("file", [{}, [], None, 1, {"format": "planner-proof/1", "digests": {}}])
def test_both_reject_anything_else(program: Path, file: Any) -> None:
    assert verdicts(program, [file]) == [is_accepted(file)] == [False]


def test_expected_digests_are_compared(program: Path, proofs: list[dict[str, Any]], tmp_path: Path) -> None:
    file = tmp_path / "proof.json"
    file.write_text(json.dumps(proofs[0]))
    digests = [proofs[0]["digests"][name] for name in ("statement", "trajectory")]
    for expected, status in (([], 0), (digests[:1], 0), (digests, 0), (digests[1:], 1)):
        assert subprocess.run([program, file, *expected], check=False, capture_output=True).returncode == status
