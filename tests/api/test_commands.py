"""The command line in process: what it prints, what it writes, how it ends."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from api.cli import app
from tests.api.conftest import RunningService
from tests.locations import ROOT

EXAMPLES = ROOT / "examples"
SHORT = {
    "robot": "three_dof_arm",
    "waypoints": [
        {"kind": "joint", "name": "low", "position": [0.0, 0.5, 0.5]},
        {"kind": "joint", "name": "high", "position": [0.5, 1.0, 1.0], "duration": 2.0},
    ],
    "sample_period": 0.5,
}


def planner(*arguments: str | Path, stdin: str | None = None) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments], input=stdin)


@pytest.fixture
def request_file(tmp_path: Path) -> Path:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(SHORT))
    return path


def test_help_loads_nothing_heavy() -> None:
    code = "import sys, api.cli; print([m for m in ('numpy', 'pydantic', 'pinocchio', 'fastapi') if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert ran.stdout.strip() == "[]"


def test_plan_shows_waypoints_and_certificate(request_file: Path) -> None:
    result = planner("plan", request_file)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[1].startswith("three_dof_arm   cubic   2 s")
    (high,) = (line for line in lines if line.startswith("high"))
    assert high.split() == ["high", "2.000", "0.5000", "1.0000", "1.0000"]
    (velocity,) = (line for line in lines if line.startswith("velocity"))
    # The cubic's peak is 1.5 times the mean: 1.5 * 0.5 rad / 2 s, of 180 degrees a second.
    assert velocity.split()[2:7] == ["0.375", "3.142", "rad/s", "11.9", "%"]


def test_plan_reads_stdin() -> None:
    assert planner("plan", "-", stdin=json.dumps(SHORT)).exit_code == 0


def test_plan_takes_another_back_end(request_file: Path) -> None:
    result = planner("plan", request_file, "--backend", "trapezoidal")
    assert result.exit_code == 0
    assert "three_dof_arm   trapezoidal   2 s" in result.stdout


def test_plan_writes_json(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.json").exit_code == 0
    answer = json.loads((tmp_path / "out.json").read_text())
    assert answer["samples"]["time"] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert answer["samples"]["position"][2] == pytest.approx([0.25, 0.75, 0.75])


def test_plan_writes_what_the_service_answers(service: RunningService, tmp_path: Path) -> None:
    request = EXAMPLES / "three_joint_arm_first.json"
    assert planner("plan", request, "-o", tmp_path / "out.json").exit_code == 0
    answer = service.client.post("/v1/trajectories", content=request.read_bytes()).raise_for_status()
    assert (tmp_path / "out.json").read_bytes() == answer.content


def test_plan_writes_csv(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.csv").exit_code == 0
    with (tmp_path / "out.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time"]) for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert float(rows[2]["position.joint_1"]) == pytest.approx(0.25)


def test_plan_writes_ros2(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.ros2.json").exit_code == 0
    points = json.loads((tmp_path / "out.ros2.json").read_text())["points"]
    assert points[1]["time_from_start"] == {"sec": 0, "nanosec": 500_000_000}
    assert points[2]["positions"] == pytest.approx([0.25, 0.75, 0.75])


def test_a_problem_comes_with_its_remedies() -> None:
    hasty = json.dumps(SHORT).replace('"duration": 2.0', '"duration": 0.01')
    result = planner("plan", "-", stdin=hasty)
    assert result.exit_code == 1
    assert result.stdout == ""
    assert "infeasible_duration" in result.stderr
    assert "/waypoints/1/duration →" in result.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("[]", "/"),
        ('{"robot": "three_dof_arm", "waypoints": []}', "/waypoints"),
        (json.dumps(SHORT | {"speed": 1}), "/speed"),
        (json.dumps(SHORT | {"robot": "nobody"}), "unknown_robot"),
    ],
)
def test_a_bad_request_is_a_problem_too(text: str, said: str) -> None:
    result = planner("plan", "-", stdin=text)
    assert result.exit_code == 1
    assert said in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan"],
        ["plan", "no-such-file.json"],
        ["plan", str(EXAMPLES / "welding.json"), "-o", "out.xlsx"],
        ["plan", str(EXAMPLES / "welding.json"), "--backend", "magic"],
        ["serve", "--port", "70000"],
        ["dance"],
    ],
)
def test_wrong_usage_ends_with_2(arguments: list[str]) -> None:
    assert planner(*arguments).exit_code == 2


def test_a_bad_environment_ends_with_2_and_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_QUEUE_SIZE", "many")
    result = planner("serve")
    assert result.exit_code == 2
    assert "PLANNER_QUEUE_SIZE" in result.stderr


def test_robots_are_listed() -> None:
    result = planner("robots")
    assert result.exit_code == 0
    assert "ngv_refuelling_arm_published" in result.stdout


def test_a_robot_is_shown_with_the_provenance_of_its_limits() -> None:
    result = planner("robots", "date_sorting_arm")
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines()]
    assert ["l1", "prismatic", "0", "..", "0.5", "m"] in [line[:6] for line in lines]
    assert ["l1", "published"] in [line[:2] for line in lines]


def test_an_unknown_robot_is_a_problem() -> None:
    result = planner("robots", "nobody")
    assert result.exit_code == 1
    assert "unknown_robot" in result.stderr
