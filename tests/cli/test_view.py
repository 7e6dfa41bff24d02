"""`planner view`: requests and saved plans in a browser, until Ctrl-C."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

import planner
from cli import app
from planner.plots.viewer import Viewer

REQUEST = {
    "robot": "three_dof_arm",
    "waypoints": [
        {"kind": "joint", "position": [0.0, 0.5, 0.5]},
        {"kind": "joint", "position": [0.5, 1.0, 1.0]},
    ],
}


def test_without_the_extra_a_sentence_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    file = tmp_path / "request.json"
    file.write_text(json.dumps(REQUEST))
    result = CliRunner().invoke(app, ["view", str(file)])
    assert result.exit_code == 2
    assert 'pip install "trajectory-planner[view]"' in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("plan.planner", "planner-plan/1 0\n[]", "is damaged"),
        ("plan.planner", "planner-plan/0 0\n[]", "has the format planner-plan/0"),
        ("-", "planner-plan/1 0\n[]", "not from stdin"),
    ],
)
def test_saved_plans_that_cannot_be_read_are_refused_in_a_sentence(
    file: str, content: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plan.planner").write_text(content)
    result = CliRunner().invoke(app, ["view", file], input=content)
    assert result.exit_code == 2
    assert told in result.stderr


def test_requests_and_saved_plans_are_shown_until_ctrl_c(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser", reason="the extra `view` is not installed")
    pages: list[int] = []

    def interrupted(viewer: Viewer) -> None:
        pages.append(httpx.get(viewer.url).status_code)
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "wait", interrupted)
    request, saved = tmp_path / "request.json", tmp_path / "plan.planner"
    request.write_text(json.dumps(REQUEST))
    arm = planner.load_robot("three_dof_arm")
    planner.plan(planner.PlanningProblem(arm, [[0.0, 0.5, 0.5], [0.5, 1.0, 1.0]])).save(saved)
    for file in (request, saved):
        result = CliRunner().invoke(app, ["view", str(file), "--port", "8961"])
        assert result.exit_code == 0
        assert "http://127.0.0.1:" in result.stdout
        assert "Ctrl-C ends it" in result.stdout
    assert pages == [200, 200]
