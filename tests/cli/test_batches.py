"""`planner batch` and `planner sweep`: results, files in any form, exit codes, and going on after Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from api.contract.requests import PlanRequest
from cli import app
from cli.work.local_plan import plan_request as plan_here
from tests.api.conftest import RunningService, wait_until
from tests.api.requests import joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path


def planner(*arguments: Any) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def lines(folder: Path) -> list[Any]:
    return [json.loads(line) for line in (folder / "results.ndjson").read_text().splitlines()]


def write_requests(file: Path, asked: list[Any]) -> Path:
    file.write_text("".join(json.dumps(request) + "\n" for request in asked))
    return file


@pytest.mark.large_only
def test_a_batch_is_planned_and_summed_up(service: RunningService, tmp_path: Path) -> None:
    asked = [plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3 + 0.1 * k, 0.1, 0.5)]) for k in range(4)]
    file = write_requests(tmp_path / "asked.ndjson", asked)
    report = tmp_path / "report.html"
    result = planner("batch", file, "-o", tmp_path / "out", "--url", service.url, "--report", report)
    assert result.exit_code == 0, result.output
    assert '<script type="application/json" id="batch">' in report.read_text()
    found = lines(tmp_path / "out")
    assert [line["index"] for line in found] == list(range(4))
    alone = [service.post("/v1/trajectories", request).json() for request in asked]
    assert [line["trajectory"] for line in found] == alone
    assert [line["duration"] for line in found] == [plan["duration"] for plan in alone]
    assert (tmp_path / "out/durations.png").read_bytes().startswith(b"\x89PNG")
    assert f"{min(plan['duration'] for plan in alone):.3f} to" in result.stderr


@pytest.mark.large_only
def test_a_sweep_writes_a_file_for_each_plan_and_tells_of_refusals(service: RunningService, tmp_path: Path) -> None:
    template = tmp_path / "template.json"
    template.write_text(json.dumps(plan_request()))
    vary = ["--vary", "/waypoints/1/duration=[0.001,2.0]", "--vary", '/backend/kind=["cubic","quintic"]']
    result = planner("sweep", template, *vary, "-o", tmp_path / "out", "--format", "csv", "--url", service.url)
    assert result.exit_code == 1, result.output
    assert [line["status"] for line in lines(tmp_path / "out")] == ["infeasible_duration"] * 2 + ["planned"] * 2
    assert {file.name for file in (tmp_path / "out").glob("*.csv")} == {"000002.csv", "000003.csv"}
    assert "infeasible_duration" in result.stderr and "2.000 to 2.000 s" in result.stderr


@pytest.mark.large_only
def test_a_sweep_varies_fields_whose_objects_the_template_leaves_out(service: RunningService, tmp_path: Path) -> None:
    """At half of the velocity limits a cubic that is limited by them takes twice as long."""
    template = tmp_path / "template.json"
    ends = [joint(0.0, 0.5, 0.5), joint(2.0, 0.5, 0.5)]
    template.write_text(json.dumps(plan_request(waypoints=ends)))
    vary = ["--vary", "/limits/velocity_scale=[0.1,0.05]", "--vary", "/waypoints/1/limits/velocity_scale=[1.0,0.5]"]
    result = planner("sweep", template, *vary, "-o", tmp_path / "out", "--url", service.url)
    assert result.exit_code == 0, result.output
    durations = [line["duration"] for line in lines(tmp_path / "out")]
    assert durations == pytest.approx([durations[0] * times for times in (1.0, 2.0, 2.0, 4.0)])


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["sweep", "FILE", "--vary", "/waypoints/9/duration=[1]"], "/grid/vary/0/pointer"),
        (["sweep", "FILE", "--vary", "/backend=cubic"], "must be a JSON list"),
        (["sweep", "FILE", "--vary", "/no/such/field=[1]"], "/grid/vary/0/pointer"),
        (["batch", "FILE", "--format", "of_nobody"], "not_acceptable"),
        (["batch", "no such file"], "does not exist"),
    ],
)
def test_what_is_no_batch_ends_with_2(service: RunningService, tmp_path: Path, arguments: list[str], told: str) -> None:
    file = write_requests(tmp_path / "asked.ndjson", [plan_request()])
    given = [str(file) if argument == "FILE" else argument for argument in arguments]
    result = planner(*given, "-o", tmp_path / "out", "--url", service.url)
    assert result.exit_code == 2, result.output
    assert told in result.stderr


@pytest.mark.large_only
def test_a_batch_goes_on_after_ctrl_c(tmp_path: Path) -> None:
    """The command starts its own service, which stores the progress beside the results."""
    asked = [plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3 + 1e-4 * k, 0.1, 0.5)]) for k in range(1500)]
    file = write_requests(tmp_path / "asked.ndjson", asked)
    command = [sys.executable, "-m", "cli", "batch", str(file), "-o", str(tmp_path / "out"), "--workers", "1"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    reachable = ["env", "--default-signal=INT"]  # a shell lets what it starts in the background ignore the signal
    first = subprocess.Popen([*reachable, *command], env=environment, stderr=subprocess.PIPE, start_new_session=True)
    database = tmp_path / "out/.planner/planner.sqlite3-wal"
    wait_until(lambda: database.exists() and database.stat().st_size > 2**20, 60.0)
    os.killpg(first.pid, signal.SIGINT)  # as a terminal does
    _, told = first.communicate(timeout=60.0)
    assert first.returncode == 130, told
    assert b"goes on" in told and not (tmp_path / "out/results.ndjson").exists()
    second = subprocess.run(command, env=environment, check=False, capture_output=True, text=True)
    assert second.returncode == 0, second.stderr
    found = lines(tmp_path / "out")
    assert [line["index"] for line in found] == list(range(len(asked)))
    expected = plan_here(PlanRequest.model_validate(asked[-1]))
    assert found[-1]["duration"] == pytest.approx(expected.trajectory.duration)
    assert not (tmp_path / "out/.planner").exists()
