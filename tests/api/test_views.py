"""The forms of a plan for people: reports that need no network, and pictures."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson
import pytest

from api import views
from api.cli.local_plan import plan_request, read_request, report_of
from api.errors import NotAcceptable
from tests.api import requests
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PATH = "/v1/trajectories"
MOST_BYTES = 3e6
built = pytest.mark.skipif(not (ROOT / "api/built_page/report").is_dir(), reason="the page is not built")


def data_of(report: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="plan">(.*?)</script>', report, flags=re.DOTALL)
    data: dict[str, Any] = orjson.loads(text)
    return data


@built
def test_a_report_holds_the_request_the_plan_and_the_robot(service: RunningService) -> None:
    name = "</script><script>alert(1)</script>"
    waypoints = [requests.joint(0.1, 0.2, 0.3, name=name), requests.joint(0.3, 0.1, 0.5)]
    request = requests.plan_request(waypoints=waypoints)
    plain = service.post(PATH, request).json()
    answer = service.post(PATH, request, headers={"Accept": "text/html"})
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.text.count("</script>") == 2, "a name ends no element"
    data = data_of(answer.text)
    assert data["request"] == request
    assert data["answer"]["request_hash"] == plain["request_hash"]
    assert data["answer"]["certificate"] == plain["certificate"]
    assert data["answer"]["samples"]["time"][-1] == pytest.approx(plain["duration"], rel=1e-6)
    assert data["robot"]["joint_names"] == plain["joint_names"]
    assert "default-src 'none'" in answer.text


@built
def test_the_report_of_eleven_waypoints_is_small() -> None:
    request = read_request((ROOT / "examples/welding.json").read_bytes())
    assert len(report_of(plan_request(request), request, "welding")) < MOST_BYTES


def test_a_report_without_its_program_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "files", lambda _: tmp_path)
    request = read_request((ROOT / "examples/welding.json").read_bytes())
    with pytest.raises(NotAcceptable, match="not built"):
        report_of(plan_request(request), request, "welding")


@pytest.mark.parametrize(("name", "begins"), [("svg", b"<?xml"), ("png", b"\x89PNG\r\n")])
def test_pictures_are_pictures(service: RunningService, name: str, begins: bytes) -> None:
    answer = service.client.post(f"{PATH}/export?format={name}", json=requests.plan_request())
    assert answer.status_code == 200
    assert answer.content.startswith(begins)
    assert answer.headers["content-disposition"] == f'attachment; filename="trajectory.{name}"'
    if name == "svg":
        assert ElementTree.fromstring(answer.text).tag.endswith("svg")  # noqa: S314 - our own
