"""Every example and every job through `planner plan`, into each kind of file, and back through `planner validate`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from cli import app
from tests.locations import ROOT
from tests.robots_extra import need_robot

if TYPE_CHECKING:
    from pathlib import Path

EXAMPLES = ROOT / "examples"
FILES = sorted(
    str(path.relative_to(EXAMPLES)) for folder in ("", "jobs") for path in (EXAMPLES / folder).glob("*.json")
)
FILES_WRITTEN = {"-o": "plan.json", "--report": "report.html", "--plot": "picture.svg"}


@pytest.mark.long_table
@pytest.mark.parametrize("name", FILES)
def test_an_example_is_planned_written_and_validated(name: str, tmp_path: Path) -> None:
    """With all output files; quantities of `least_effort` and `inspection` once had no unit."""
    request = EXAMPLES / name
    robot_id = json.loads(request.read_text())["robot"]
    need_robot(robot_id)
    robot = EXAMPLES / "robots" / f"{robot_id}.json"
    written = {option: tmp_path / file for option, file in FILES_WRITTEN.items()}
    options = [text for option, file in written.items() for text in (option, str(file))]
    named = ["--robot", str(robot)] if robot.exists() else []
    result = CliRunner().invoke(app, ["plan", str(request), *options, *named])
    assert result.exit_code == 0, result.stderr + repr(result.exception)
    assert all(file.stat().st_size > 1000 for file in written.values())
    result = CliRunner().invoke(app, ["validate", str(written["-o"]), *named])
    assert result.exit_code == 0, result.stdout + result.stderr
