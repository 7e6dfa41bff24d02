"""The two checkers of proof files, in Python and in Go, agree on honest files, false ones and arbitrary changes."""

from __future__ import annotations

import copy
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.proofs.damage import damaged_text, damaged_values
from benchmarks.proofs.plans import VARIED, plan_of
from benchmarks.proofs.tampering import KINDS, tampered, with_any_number_changed, with_digests
from planner import ProofRejected, check_proof, write_proof
from planner.proofs import checker
from planner.proofs.checker import DISTANCE_CLAIMS

ROOT = Path(__file__).parents[2]

SOURCE = ROOT / "clients" / "proof_checker"

COMMAND_LINE = """planner() { python -c 'from cli.commands import main; main()' "$@"; }"""
"""The command line as a function of the shell."""


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
    return [write_proof(plan_of(number)) for number in VARIED]


def verdicts(program: Path, files: list[Any]) -> list[bool]:
    """Return whether Go accepts each file."""
    return verdicts_on(program, [json.dumps(file).encode() for file in files])


def verdicts_on(program: Path, files: list[bytes]) -> list[bool]:
    """Return whether Go accepts the content of each file, which is one line."""
    done = subprocess.run([program, "-"], input=b"\n".join(files), check=True, capture_output=True)
    found = [line.startswith(b"accepted") for line in done.stdout.splitlines()]
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


def test_both_reject_a_claim_about_no_pairs(program: Path, proofs: list[dict[str, Any]]) -> None:
    """Plan 26 of the large run: a scene without speed zones kept all of them."""
    for name in DISTANCE_CLAIMS:
        changed = copy.deepcopy(next(proof for proof in proofs if proof["statement"]["scenes"]))
        for scene in changed["statement"]["scenes"]:
            scene[name] = []
        changed["evidence"][name] = []
        changed["statement"]["claims"] = ["continuity", name]
        assert verdicts(program, [with_digests(changed)]) == [is_accepted(changed)] == [False]


def test_both_reject_a_force_beyond_the_tool_of_a_robot_that_no_claim_needs(
    program: Path, proofs: list[dict[str, Any]]
) -> None:
    """Plan 48 of the large run: the robot of a waypoint without a pose carried its tool on a joint before the force."""
    changed = copy.deepcopy(proofs[0])
    robots = changed["statement"]["robots"]
    robots.append(copy.deepcopy(robots[0]))
    changed["statement"]["waypoints"][0]["robot"] = len(robots) - 1
    robots[-1]["tool"]["joint"] = robots[-1]["process_force"][0] = 3
    assert verdicts(program, [with_digests(changed)]) == [is_accepted(changed)] == [True]
    robots[-1]["process_force"][0] = 5
    assert verdicts(program, [with_digests(changed)]) == [is_accepted(changed)] == [False]


def test_both_reject_a_fraction_as_the_robot_of_a_waypoint(program: Path, proofs: list[dict[str, Any]]) -> None:
    """Plan 212 of the large run: only a pose of the tool needs the robot."""
    changed = copy.deepcopy(proofs[0])
    changed["statement"]["waypoints"][0] |= {"robot": 1e-16, "tool_pose": []}
    assert verdicts(program, [with_digests(changed)]) == [is_accepted(changed)] == [False]


@pytest.mark.parametrize("file", [{}, [], None, 1, {"format": "planner-proof/4", "digests": {}}])
def test_both_reject_anything_else(program: Path, file: Any) -> None:
    assert verdicts(program, [file]) == [is_accepted(file)] == [False]


def test_both_reject_damaged_texts_without_a_crash(program: Path, proofs: list[dict[str, Any]], tmp_path: Path) -> None:
    generator = np.random.default_rng(3)
    files = [damaged_text(json.dumps(proof), generator) for proof in proofs * 15]
    files = [file for file in files if file.strip() and b"\n" not in file]
    assert not any(verdicts_on(program, files))
    assert not any(map(is_accepted, files))
    for k, content in enumerate([*files[:6], b"", b" " * (checker.MOST_BYTES_OF_PROOF + 1)]):
        file = tmp_path / f"{k}.json"
        file.write_bytes(content)
        for command in ([program], [sys.executable, checker.__file__]):
            done = subprocess.run([*command, file], check=False, capture_output=True)
            assert (done.returncode, done.stderr[:9]) == (1, b"rejected:")


def test_damaged_values_are_checked_without_a_crash(program: Path, proofs: list[dict[str, Any]]) -> None:
    """Python may accept a file in which a value that no claim needs is malformed."""
    generator = np.random.default_rng(4)
    files = [damaged_values(proof, generator) for proof in proofs * 20]
    for by_go, file in zip(verdicts(program, files), files, strict=True):
        assert by_go <= is_accepted(file)


def test_expected_digests_are_compared(program: Path, proofs: list[dict[str, Any]], tmp_path: Path) -> None:
    file = tmp_path / "proof.json"
    file.write_text(json.dumps(proofs[0]))
    digests = [proofs[0]["digests"][name] for name in ("statement", "trajectory")]
    for expected, status in (([], 0), (digests[:1], 0), (digests, 0), (digests[1:], 1)):
        assert subprocess.run([program, file, *expected], check=False, capture_output=True).returncode == status


def test_the_commands_of_the_page_check_a_plan_with_lines_and_blends(tmp_path: Path) -> None:
    """The checker in Python is alone in its folder."""
    shutil.copytree(SOURCE, tmp_path / "clients" / "proof_checker")
    (tmp_path / "planner" / "proofs").mkdir(parents=True)
    shutil.copy(checker.__file__, tmp_path / "planner" / "proofs")
    shutil.copy(ROOT / "examples" / "blended_lines.json", tmp_path / "request.json")
    page = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    (commands,) = re.findall(r"```sh\n(planner plan.*?)```", page, re.DOTALL)
    paths = {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]), "PYTHONPATH": str(ROOT)}
    shell = ["bash", "-e", "-c", COMMAND_LINE + "\n" + commands]
    done = subprocess.run(shell, cwd=tmp_path, env=os.environ | paths, check=True, capture_output=True, text=True)
    verdicts = [line for line in done.stdout.splitlines() if line.startswith("accepted: ")]
    assert len(verdicts) == 3
    assert len(set(verdicts)) == 1 and "path_deviation" in verdicts[0]
