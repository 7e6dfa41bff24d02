"""`planner convert`: saved plans in other formats, and completion of the names of formats and back ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

import planner
from cli import app
from cli.options import back_end_kinds, format_names
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result

REQUEST = ROOT / "examples/past_a_switch.json"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def test_a_saved_plan_becomes_the_files_that_its_request_becomes(tmp_path: Path) -> None:
    saved = tmp_path / "job.plan"
    assert run("plan", REQUEST, "--save", saved, "-o", tmp_path / "first.csv").exit_code == 0
    for suffix in ("csv", "ros2.json", "moves.script"):
        run("plan", REQUEST, "-o", tmp_path / f"planned.{suffix}")
        result = run("convert", saved, "-o", tmp_path / f"converted.{suffix}")
        assert result.exit_code == 0, result.stderr
        planned, converted = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("planned", "converted"))
        assert converted == planned
    assert run("convert", saved, "-o", "-", "--period", "0.1").stdout_bytes.startswith(b'{"robot"')
    rows = run("convert", saved, "-o", "-", "--format", "csv", "--period", "0.1").stdout.splitlines()
    assert [float(row.split(",")[0]) for row in rows[1:3]] == [0.0, 0.1]
    assert planner.load(saved).problem.robot.id == "ur5e"


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        ((REQUEST, "-o", "plan.csv"), 2, "planner plan -o converts requests"),
        (("plan", "-o", "plan.txt"), 2, "must end with one of"),
        (("plan", "-o", "plan.csv", "--format", "val3"), 2, "must be one of json, "),
        (("-", "-o", "plan.csv"), 2, "not from stdin"),
        (("absent.plan", "-o", "plan.csv"), 2, "No such file"),
        (("plan", "-o", "-", "--format", "krl_kss8"), 1, "Universal Robots"),
    ],
)
def test_a_plan_that_cannot_be_converted_is_refused_in_a_sentence(
    arguments: tuple[object, ...], status: int, told: str, tmp_path: Path
) -> None:
    saved = tmp_path / "plan"
    arm = planner.load_robot("ur5e")
    planner.plan(planner.PlanningProblem(arm, [[0.0] * 6, [0.1] * 6])).save(saved)
    result = run("convert", *(saved if argument == "plan" else argument for argument in arguments))
    assert result.exit_code == status
    assert told in " ".join(result.stderr.replace("│", " ").split())


def test_back_ends_and_formats_are_completed() -> None:
    assert back_end_kinds("t") == ["trapezoidal", "toppra"]
    assert format_names("krl") == ["krl", "krl_kss5", "krl_kss8"]
