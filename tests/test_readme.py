"""The commands of the README run, and their answers equal the shown ones."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from cli import app
from planner.robots import catalogue_ids
from tests.documents.shown_answers import assert_shown, parse_shown
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.api.conftest import RunningService

README = (ROOT / "README.md").read_text(encoding="utf-8")
REQUESTS = (ROOT / "docs" / "requests.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
BLOCKS = BLOCK.findall(README)
CONSOLE = [text for language, text in BLOCKS if language == "console"]
CURL = [
    text for language, text in BLOCKS + BLOCK.findall(REQUESTS) if language == "console" and text.startswith("$ curl")
]
COMMANDS = [line[2:] for text in CONSOLE for line in text.splitlines() if line.startswith("$ planner")]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def test_the_readme_has_at_most_1200_words() -> None:
    assert len(README.split()) <= 1200


def test_the_readme_has_its_examples() -> None:
    assert len(CURL) == 3
    assert len(COMMANDS) == 7


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
@pytest.mark.parametrize("example", CURL, ids=["plan", "problem", "collision"])
def test_curl_gets_the_answer_shown(example: str, service: RunningService) -> None:
    command, answer = re.fullmatch(r"\$ (curl .*?')\n(\{.*)", example, flags=re.DOTALL).groups()  # type: ignore[union-attr]
    assert "http://127.0.0.1:8000" in command
    arguments = shlex.split(command.replace("http://127.0.0.1:8000", service.url))
    real = subprocess.run(arguments, check=True, capture_output=True).stdout
    assert_shown(parse_shown(answer), json.loads(real))


@pytest.mark.large_only
def test_command_lines_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the order in which they stand: one reads what another has written."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    for command in COMMANDS:
        ran = CliRunner().invoke(app, command.split()[1:])
        assert ran.exit_code == 0, ran.output
    assert (tmp_path / "refuelling.csv").read_text().startswith("time,segment,position.joint_1")
    assert "<svg" in (tmp_path / "refuelling.html").read_text()


@pytest.mark.large_only
def test_python_prints_what_is_shown() -> None:
    (code,) = (text for language, text in BLOCKS if language == "python")
    (shown,) = (text for language, text in BLOCKS if language == "text")
    ran = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, check=True, capture_output=True, text=True)
    assert ran.stdout == shown


def test_every_robot_named_is_in_the_catalogue_and_the_other_way_round() -> None:
    table = README.partition("## Robots")[2].partition("\n\nYour own")[0]
    optional = {"ur5", "panda", "xarm7"}
    named = set(re.findall(r"`([a-z0-9_]+)`", table)) - optional
    own = {path.stem for path in (ROOT / "planner/robots/data").glob("*.json")}
    assert named == own
    assert own <= set(catalogue_ids())


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)h][^)]*)\)", README):
        assert (ROOT / target).is_file(), target
