"""The forms of a plan for people: reports that need no network, and pictures."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
import pytest

from api.base.errors import NotAcceptable
from api.work.answers import views
from cli.work.local_plan import plan_request, read_request, report_of
from tests.api import requests
from tests.documents.read_pictures import graphs_of
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PATH = "/v1/trajectories"
MOST_BYTES = 3e6
HTML = {"Accept": "text/html"}
AFRESH = {"Cache-Control": "no-cache"}
built = pytest.mark.skipif(not (ROOT / "api/built_page/report").is_dir(), reason="the page is not built")


def data_of(report: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="plan">(.*?)</script>', report, flags=re.DOTALL)
    data: dict[str, Any] = orjson.loads(text)
    return data


@built
@pytest.mark.parametrize("name", ["</script><script>alert(1)</script>", "<!--<script>"])
def test_a_report_holds_the_request_the_plan_and_the_robot(service: RunningService, name: str) -> None:
    waypoints = [requests.joint(0.1, 0.2, 0.3, name=name), requests.joint(0.3, 0.1, 0.5)]
    request = requests.plan_request(waypoints=waypoints)
    plain = service.post(PATH, request).json()
    answer = service.post(PATH, request, headers=HTML)
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.text.count("</script>") == 2, "a name ends no element"
    assert "<!--" not in answer.text, "nor does it keep one from ending"
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


@built
def test_a_report_has_the_links_of_a_robot_without_shapes_to_look_at(service: RunningService) -> None:
    """The report has the same links as the service's description, if that lists links."""
    box = '<link name="l1"><collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision></link>'
    model = requests.urdf_robot('<link name="l0"/>' + box + requests.urdf_joint(0, "l0", "l1"), id="boxed")
    assert service.post("/v1/robots", model).status_code == 201
    waypoints = [requests.joint(0.0), requests.joint(0.3)]
    answer = service.post(PATH, requests.plan_request(robot="boxed", waypoints=waypoints), headers=HTML)
    links = data_of(answer.text)["links"]
    assert [link["shape"] for link in links] == [{"kind": "box", "size": [0.1, 0.2, 0.3]}]
    assert links == service.client.get("/v1/robots/boxed/geometry").json()["shapes"]


@built
def test_a_report_has_the_scene_that_was_asked_by_its_id(service: RunningService) -> None:
    """The report embeds the scene, since it makes no request, and the links that are checked against it."""
    post = {"id": "post", "shape": {"kind": "sphere", "radius": 0.05}, "pose": {"position": [1.0, 1.0, 0.0]}}
    created = service.post("/v1/scenes", {"id": "beside_a_post", "objects": [post]})
    assert created.status_code == 201, created.text
    answer = service.post(PATH, requests.plan_request(scene="beside_a_post"), headers=HTML)
    data = data_of(answer.text)
    assert [thing["id"] for thing in data["request"]["scene"]["objects"]] == ["post"]
    assert "link_1" in {link["link"] for link in data["links"]}
    assert data_of(service.post(PATH, requests.plan_request(), headers=HTML).text)["links"] == []


def test_a_report_without_its_program_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "files", lambda _: tmp_path)
    request = read_request((ROOT / "examples/welding.json").read_bytes())
    with pytest.raises(NotAcceptable, match="not built"):
        report_of(plan_request(request), request, "welding")


@pytest.mark.large_only
def test_a_picture_shows_what_is_asked(service: RunningService) -> None:
    picture = {"show": ["velocity", "tcp_position"], "joints": ["joint_2"], "axes": ["z"], "title": "Up"}
    request = requests.plan_request()
    drawn = service.post(f"{PATH}?format=svg", request | {"picture": picture})
    assert drawn.headers["content-type"].startswith("image/svg+xml")
    lines = [sorted(graph.lines) for graph in graphs_of(drawn.content)]
    assert lines == [["velocity.joint_2"], ["tcp_position.z"]]
    again = service.client.post(f"{PATH}?format=svg", json=request | {"picture": picture}, headers=AFRESH)
    assert again.content == drawn.content
    hashes = {service.post(PATH, body).json()["request_hash"] for body in (request, request | {"picture": picture})}
    assert len(hashes) == 1


@pytest.mark.parametrize(
    ("picture", "code", "pointer"),
    [
        ({"joints": ["joint_1", "joint_9"]}, "invalid_request", "/picture/joints/1"),
        ({"show": ["speed"]}, "invalid_request", "/picture/show/0"),
        ({"show": []}, "invalid_request", "/picture/show"),
        ({"show": ["torque"]}, "missing_dynamics", None),
    ],
)
def test_a_picture_of_nothing_is_refused(
    service: RunningService, picture: dict[str, Any], code: str, pointer: str | None
) -> None:
    answer = service.post(f"{PATH}?format=png", requests.plan_request(picture=picture))
    problem = answer.json()
    assert (answer.status_code, problem["code"]) == (422, code)
    assert pointer is None or [error["pointer"] for error in problem["errors"]] == [pointer]


@pytest.mark.large_only
def test_workspaces_and_robots_are_drawn(service: RunningService) -> None:
    """The arm with three joints reaches from 70 to 270 mm, and lies along x at zero."""
    body = {"robot": "three_dof_arm", "samples": 300, "view": "xz"}
    drawn = service.client.post("/v1/kinematics/workspace", json=body, headers={"Accept": "image/svg+xml"})
    (graph,) = graphs_of(drawn.content)
    assert len(graph.dots["workspace"]) == 300
    assert np.linalg.norm(graph.dots["workspace"], axis=1).max() < 271.0
    assert service.client.post("/v1/kinematics/workspace?format=glb", json=body).status_code == 406
    standing = service.client.get("/v1/robots/three_dof_arm/geometry?format=png")
    assert standing.headers["content-type"] == "image/png"
    assert standing.content.startswith(b"\x89PNG")


@pytest.mark.parametrize(("name", "begins"), [("svg", b"<?xml"), ("png", b"\x89PNG\r\n")])
def test_pictures_are_pictures(service: RunningService, name: str, begins: bytes) -> None:
    answer = service.client.post(f"{PATH}/export?format={name}", json=requests.plan_request())
    assert answer.status_code == 200
    assert answer.content.startswith(begins)
    assert answer.headers["content-disposition"] == f'attachment; filename="trajectory.{name}"'
    if name == "svg":
        assert ElementTree.fromstring(answer.text).tag.endswith("svg")  # noqa: S314 - our own
