"""`planner cell`: several requests planned on one clock."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner, Result

from cli import app
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

CELL = ROOT / "examples/cell"


def planner(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_cell_shows_waits_and_clearances_and_writes_a_trajectory_for_each_robot(tmp_path: Path) -> None:
    files = [CELL / "left.json", CELL / "right.json"]
    result = planner("cell", *files, "--margin", "0.02", "--skew", "0.02", "-o", tmp_path, "--format", "csv")
    assert result.exit_code == 0, result.stderr
    lines = [line.split() for line in result.stdout.splitlines() if line.split()]
    rows = {line[0]: line for line in lines if line[1] != "and"}
    (wait,) = (float(rows[name][3]) for name in ("left", "right") if rows[name][3] != "none")
    longer = sum(float(rows[name][2]) - float(rows[name][1]) for name in ("left", "right"))
    assert longer == pytest.approx(wait, abs=2e-3)
    clearance = next(line for line in result.stdout.splitlines() if "left and right" in line).split()
    assert float(clearance[3]) == pytest.approx(0.02)
    for name in ("left", "right"):
        written = list(csv.reader((tmp_path / f"{name}.csv").read_text().splitlines()))
        assert float(written[-1][0]) == pytest.approx(float(rows[name][2]), abs=1e-3)


def test_cell_refuses_bad_numbers_of_robots_names_and_options(tmp_path: Path) -> None:
    left, right = CELL / "left.json", CELL / "right.json"
    assert "2 to 4 robots" in " ".join(planner("cell", left).stderr.split())
    assert "2 to 4 robots" in " ".join(planner("cell", *[left] * 5).stderr.split())
    assert "/robots/1/name" in planner("cell", left, left).stderr
    assert planner("cell", left, right, "--skew", "-1").exit_code == 2
    assert planner("cell", left, right, "--format", "none").exit_code == 2
    assert planner("cell", left, right, "-o", tmp_path / "missing").exit_code == 2
    assert planner("cell").exit_code == 2
    beside = json.loads(right.read_text())
    beside["mounting"]["position"] = [0.05, 0.0, 0.0]
    (tmp_path / "inside.json").write_text(json.dumps(beside))
    touching = planner("cell", left, tmp_path / "inside.json")
    assert touching.exit_code == 1
    assert "start_in_collision" in touching.stderr
