"""Collision geometry of robots over HTTP: uploaded meshes, and harmful archives."""

from __future__ import annotations

import base64
import io
import stat
import struct
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from api.base.errors import InvalidRequest
from api.contract.robot_geometry import RobotGeometry
from api.contract.robots import AddedRobot
from api.store.contents.mesh_archive import MOST_FILES, MeshArchive
from planner import load_robot
from tests.api.mesh_archives import CUBE, DUMBBELL, archive
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

ROBOTS = "/v1/robots"

URDF = """<robot name="r"><link name="base"/>
  <link name="arm"><collision><origin xyz="0 0 0.5"/><geometry><mesh filename="package://r/meshes/arm.stl"/></geometry>
  </collision></link>
  <link name="hand"><collision><geometry><mesh filename="package://r/meshes/hand.stl"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


def robot(id: str, meshes: str | None) -> dict[str, Any]:
    return {"kind": "urdf", "id": id, "urdf": URDF} | ({} if meshes is None else {"meshes": meshes})


def test_meshes_of_an_upload_are_cut_and_kept(service: RunningService) -> None:
    meshes = archive({"meshes/arm.stl": DUMBBELL, "meshes/hand.stl": CUBE, "README.md": b"hello"})
    added = service.post(ROBOTS, robot("with_meshes", meshes))
    assert added.status_code == 201, added.text
    assert {"mesh_not_found"}.isdisjoint(f.code for f in AddedRobot(**added.json()).findings)
    assert service.post(ROBOTS, robot("with_meshes", meshes)).status_code == 200, "the same robot"
    assert service.post(ROBOTS, robot("with_meshes", None)).status_code == 409, "another one"

    answer = service.client.get(f"{ROBOTS}/with_meshes/geometry")
    geometry = RobotGeometry.model_validate_json(answer.content, strict=True)
    *arm, last = [(shape.link, shape.after, shape.source) for shape in geometry.shapes]
    assert (set(arm), last) == ({("arm", 1, "model")}, ("hand", 2, "model"))
    assert len(arm) >= 3, "both thick ends and the thin middle"
    hand = geometry.shapes[-1].shape
    assert hand.kind == "convex"
    assert np.ptp(hand.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.3], abs=1e-7)
    assert geometry.shapes[0].position == [0.0, 0.0, 0.5]
    ((pair),) = geometry.pairs
    assert (pair.link_1, pair.link_2, pair.reason, pair.contact_share) == ("arm", "hand", None, 0.0)
    assert not geometry.findings
    again = service.client.get(f"{ROBOTS}/with_meshes/geometry", headers={"If-None-Match": answer.headers["ETag"]})
    assert again.status_code == 304


def test_a_robot_derived_from_it_has_its_shapes(service: RunningService) -> None:
    meshes = archive({"arm.stl": DUMBBELL, "hand.stl": CUBE})
    assert service.post(ROBOTS, robot("mesh_base", meshes)).status_code == 201
    derived = {"kind": "derived", "id": "mesh_derived", "from": "mesh_base", "locked": {"b": 0.5}}
    assert service.post(ROBOTS, derived).status_code == 201
    own, other = (service.client.get(f"{ROBOTS}/{name}/geometry").json() for name in ("mesh_base", "mesh_derived"))
    assert [shape["shape"] for shape in own["shapes"]] == [shape["shape"] for shape in other["shapes"]]
    assert {shape["after"] for shape in other["shapes"]} == {1}


def test_what_is_missing_is_estimated_and_remarked_on(service: RunningService) -> None:
    added = service.post(ROBOTS, robot("half_meshes", archive({"arm.stl": DUMBBELL})))
    assert added.status_code == 201
    findings = {finding["code"]: finding for finding in added.json()["findings"]}
    assert findings["mesh_not_found"]["subject"] == "hand"
    assert "hand" in findings["estimated_shapes"]["message"]
    geometry = service.client.get(f"{ROBOTS}/half_meshes/geometry").json()
    assert [shape["source"] for shape in geometry["shapes"] if shape["link"] == "hand"] == ["estimate"]
    assert {finding["code"] for finding in geometry["findings"]} >= {"mesh_not_found", "estimated_shapes"}


def test_a_mesh_that_cannot_be_used_is_refused(service: RunningService) -> None:
    refused = service.post(ROBOTS, robot("bad_mesh", archive({"arm.stl": DUMBBELL[:-5], "hand.stl": CUBE})))
    assert refused.status_code == 422
    assert refused.json()["code"] == "invalid_robot_model"
    assert "arm.stl" in refused.json()["detail"]


def test_robots_of_the_catalogue_have_geometry(service: RunningService) -> None:
    answer = service.client.get(f"{ROBOTS}/three_dof_arm/geometry")
    geometry = RobotGeometry.model_validate_json(answer.content, strict=True)
    shapes = load_robot("three_dof_arm").collision_shapes
    assert [shape.link for shape in geometry.shapes] == [shape.link for shape in shapes]
    assert {shape.source for shape in geometry.shapes} == {"estimate"}
    assert service.client.get(f"{ROBOTS}/no_such_robot/geometry").status_code == 404


def zip_with(change: Any) -> str:
    """Return an archive of one file whose bytes are changed."""
    data = bytearray(base64.b64decode(archive({"arm.stl": CUBE})))
    change(data)
    return base64.b64encode(bytes(data)).decode()


def says_it_is_small(data: bytearray) -> None:
    """Write an unpacked size of 10 bytes into the archive's directory and the file's header."""
    at = data.index(b"PK\x01\x02")
    struct.pack_into("<I", data, at + 24, 10)
    struct.pack_into("<I", data, 22, 10)


def linked() -> str:
    entry = zipfile.ZipInfo("arm.stl")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as writer:
        writer.writestr(entry, "/etc/passwd")
    return base64.b64encode(packed.getvalue()).decode()


def twice() -> str:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as writer, pytest.warns(UserWarning, match="Duplicate"):
        writer.writestr("arm.stl", CUBE)
        writer.writestr("arm.stl", DUMBBELL)
    return base64.b64encode(packed.getvalue()).decode()


BOMB = archive({"arm.stl": bytes(40 * 1024 * 1024)})
HOSTILE = {
    "no base64": ("???", "base64"),
    "no archive": (base64.b64encode(b"PK nonsense" * 10).decode(), "must be a zip archive"),
    "empty": ("", "must be a zip archive"),
    "cut": (archive({"arm.stl": CUBE})[:100], "must be a zip archive"),
    "above": (archive({"../arm.stl": CUBE}), "outside the archive"),
    "above inside": (archive({"meshes/../../arm.stl": CUBE}), "outside the archive"),
    "absolute": (archive({"/etc/passwd": CUBE}), "outside the archive"),
    "drive": (archive({"C:/arm.stl": CUBE}), "outside the archive"),
    "backslashes": (archive({"..\\arm.stl": CUBE}), "outside the archive"),
    "link": (linked(), "link"),
    "two of a name": (twice(), "got two"),
    "bomb": (BOMB, "bytes once"),
    "many": (archive({f"{k}.stl": b"" for k in range(MOST_FILES + 1)}), "must have at most .* files"),
    "lies": (zip_with(says_it_is_small), "broken"),
    "spoiled": (zip_with(lambda data: data.__setitem__(slice(60, 90), bytes(30))), "broken"),
    "encrypted": (zip_with(lambda data: data.__setitem__(data.index(b"PK\x01\x02") + 8, 1)), "encrypted|broken"),
    "method": (zip_with(lambda data: data.__setitem__(data.index(b"PK\x01\x02") + 10, 99)), "deflated"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_archives_are_refused(name: str) -> None:
    meshes, says = HOSTILE[name]
    with pytest.raises(InvalidRequest, match=says):
        dict(MeshArchive(meshes))


def test_visual_meshes_that_come_along_do_not_count(service: RunningService) -> None:
    """An archive of the usual size was refused for meshes that nobody reads."""
    whole = archive({"arm.stl": CUBE, "hand.stl": DUMBBELL, "visual/arm.dae": bytes(40 * 1024 * 1024)})
    added = service.post(ROBOTS, robot("with_visuals", whole))
    assert added.status_code == 201
    assert not [finding for finding in added.json()["findings"] if finding["code"] == "mesh_not_found"]


def test_a_bomb_over_http_does_no_harm(service: RunningService) -> None:
    before = {worker.pid for worker in service.workers()}
    refused = service.post(ROBOTS, robot("bomb", BOMB))
    assert (refused.status_code, refused.json()["code"]) == (422, "invalid_request")
    assert refused.json()["errors"][0]["pointer"] == "/meshes"
    assert {worker.pid for worker in service.workers()} == before


@pytest.mark.sized
def test_spoiled_archives_are_read_or_refused() -> None:
    rng = np.random.default_rng(5)
    whole = base64.b64decode(archive({"arm.stl": CUBE, "b/hand.stl": DUMBBELL[:500]}))
    for _ in range(300):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), rng.integers(1, 6)).tolist():
            data[at] = int(rng.integers(256))
        try:
            files = dict(MeshArchive(base64.b64encode(bytes(data)).decode()))
        except InvalidRequest:
            continue
        assert all(".." not in name and not name.startswith("/") for name in files)


@pytest.mark.parametrize(
    ("asked", "media_type"),
    [
        ({"headers": {"Accept": "model/gltf-binary"}}, "model/gltf-binary"),
        ({"headers": {"Accept": "model/gltf+json, application/json;q=0.5"}}, "model/gltf+json"),
        ({"params": {"format": "glb"}}, "model/gltf-binary"),
        ({"params": {"format": "gltf"}}, "model/gltf+json"),
        ({"headers": {"Accept": "*/*"}}, "application/json"),
    ],
)
def test_geometry_comes_in_the_form_that_is_asked_for(
    service: RunningService, asked: dict[str, Any], media_type: str
) -> None:
    answer = service.client.get(f"{ROBOTS}/kuka_kr16_2/geometry", **asked)
    assert answer.status_code == 200
    assert answer.headers["Content-Type"] == media_type
    if media_type != "application/json":
        kind = {"model/gltf-binary": "glb", "model/gltf+json": "gltf"}[media_type]
        drawn = trimesh.load(io.BytesIO(answer.content), file_type=kind)
        assert set(drawn.graph.nodes_geometry) >= {"base_link", "link_1", "link_6"}


def test_no_other_form_of_geometry_is_there(service: RunningService) -> None:
    refused = service.client.get(f"{ROBOTS}/kuka_kr16_2/geometry", params={"format": "stl"})
    assert (refused.status_code, refused.json()["code"]) == (406, "not_acceptable")


def test_shapes_of_an_answer_are_accepted_in_a_scene(service: RunningService) -> None:
    """Every kind of shape that the geometry of a robot has can be sent back as it is."""
    elements = ["<sphere radius='0.1'/>", "<box size='0.1 0.2 0.3'/>", "<cylinder radius='0.1' length='0.3'/>"]
    collisions = "".join(f"<collision><geometry>{element}</geometry></collision>" for element in elements)
    urdf = URDF.replace('<link name="base"/>', f'<link name="base">{collisions}</link>')
    meshes = archive({"meshes/arm.stl": DUMBBELL, "meshes/hand.stl": CUBE})
    assert service.post(ROBOTS, robot("of_all_kinds", meshes) | {"urdf": urdf}).status_code == 201
    shapes = [
        each["shape"]
        for name in ("of_all_kinds", "welding_arm")
        for each in service.client.get(f"{ROBOTS}/{name}/geometry").json()["shapes"]
    ]
    assert {shape["kind"] for shape in shapes} == {"sphere", "box", "cylinder", "convex", "capsule"}
    objects = [
        {"id": f"shape {k}", "shape": shape, "pose": {"position": [5.0, 0.0, 2.0 * k]}}
        for k, shape in enumerate(shapes)
    ]
    answer = service.post("/v1/trajectories", plan_request(scene={"objects": objects}))
    assert answer.status_code == 200, answer.text[:500]
    kept = service.post("/v1/scenes", {"objects": objects})
    assert kept.status_code == 201
    back = service.client.get(f"/v1/scenes/{kept.json()['id']}").json()["objects"]
    again = service.post("/v1/trajectories", plan_request(scene={"objects": back}))
    assert again.status_code == 200, again.text[:500]
    assert service.client.delete(f"/v1/scenes/{kept.json()['id']}").status_code == 204
