"""`planner cell`: the robots of a cell planned on one clock."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner, Result

from cli import app
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

CELL = ROOT / "examples/cell/over_a_table.json"


def planner(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.large_only
def test_cell_shows_waits_and_clearances_and_writes_a_trajectory_for_each_robot(tmp_path: Path) -> None:
    result = planner("cell", CELL, "-o", tmp_path, "--format", "csv")
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


@pytest.mark.parametrize(
    ("command", "example"),
    [("cell", "cell/over_a_table"), ("order", "tasks/drill_and_deburr"), ("plan", "blended_lines")],
)
def test_commands_know_no_stored_scene(tmp_path: Path, command: str, example: str) -> None:
    request = json.loads((ROOT / f"examples/{example}.json").read_text()) | {"scene": "cell_1"}
    (tmp_path / "request.json").write_text(json.dumps(request))
    refused = planner(command, tmp_path / "request.json")
    assert refused.exit_code == 1
    assert "/scene must be the scene itself" in " ".join(refused.stderr.split())


def test_cell_refuses_faults_and_unknown_options(tmp_path: Path) -> None:
    request = json.loads(CELL.read_text())
    left, right = request["robots"]

    def with_robots(*robots: dict[str, Any]) -> Result:
        (tmp_path / "cell.json").write_text(json.dumps(request | {"robots": robots}))
        return planner("cell", tmp_path / "cell.json")

    assert "/robots" in with_robots(left).stderr
    assert "/robots/1/name" in with_robots(left, left).stderr
    unmounted = {name: value for name, value in right.items() if name != "mounting"}
    touching = with_robots(left, unmounted)
    assert touching.exit_code == 1
    assert "start_in_collision" in touching.stderr
    assert planner("cell", CELL, "--format", "none").exit_code == 2
    assert planner("cell", CELL, "-o", tmp_path / "missing").exit_code == 2
    assert planner("cell").exit_code == 2
