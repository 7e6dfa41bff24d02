"""Visual meshes of robots over HTTP: kept beside the model, drawn as glTF, and never a reason to refuse a robot."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import pytest
import trimesh

from api.contract.robots import RobotDescription
from api.store.contents import mesh_archive
from tests.api.made_up_service import made_up_service
from tests.api.mesh_archives import CUBE, DUMBBELL, archive

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

ROBOTS = "/v1/robots"
COLOUR = '<material name="m"><color rgba="0 0 1 1"/></material>'
VISUAL = f'<visual><geometry><mesh filename="package://r/hand_look.stl"/></geometry>{COLOUR}</visual>'
URDF = f"""<robot name="r"><link name="base"/>
  <link name="arm"><visual><geometry><box size="0.1 0.1 0.4"/></geometry>{COLOUR}</visual></link>
  <link name="hand">{VISUAL}<collision><geometry><mesh filename="package://r/hand.stl"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service() as client:
        yield client


def add(client: httpx.Client, name: str, files: dict[str, bytes]) -> dict[str, Any]:
    added = client.post(ROBOTS, json={"kind": "urdf", "id": name, "urdf": URDF, "meshes": archive(files)})
    assert added.status_code == 201, added.text
    answer: dict[str, Any] = added.json()
    return answer


def triangles(answer: httpx.Response) -> dict[str, int]:
    """Count the triangles of each link, as a second reader of glTF finds them."""
    scene = trimesh.load(io.BytesIO(answer.content), file_type="glb")
    parents = scene.graph.transforms.parents
    counted: dict[str, int] = {}
    for node in scene.graph.nodes_geometry:
        mesh = scene.geometry[scene.graph[node][1]]
        counted[parents[node]] = counted.get(parents[node], 0) + len(mesh.faces)
    return counted


def test_visual_meshes_are_kept_and_the_collision_shapes_are_those_of_proofs(client: httpx.Client) -> None:
    added = add(client, "looks", {"r/hand.stl": CUBE, "r/hand_look.stl": DUMBBELL})
    assert added["has_visual_meshes"] and added["geometry"][0]["colour"] == [0.0, 0.0, 1.0, 1.0]
    assert not {"visual_mesh_not_found", "visual_mesh_unread"} & {finding["code"] for finding in added["findings"]}
    RobotDescription.model_validate(client.get(f"{ROBOTS}/looks").json())
    answer = client.get(f"{ROBOTS}/looks/visuals")
    assert answer.headers["Content-Type"] == "model/gltf-binary"
    assert "looks.glb" in answer.headers["Content-Disposition"]
    assert triangles(answer) == {"hand": (len(DUMBBELL) - 84) // 50}
    known = client.get(f"{ROBOTS}/looks/visuals", headers={"If-None-Match": answer.headers["ETag"]})
    assert (known.status_code, known.content) == (304, b"")
    shapes = client.get(f"{ROBOTS}/looks/geometry").json()["shapes"]
    assert [len(shape["shape"]["vertices"]) for shape in shapes if shape["link"] == "hand"] == [8]  # the cube
    derived = {"kind": "derived", "id": "looks_held", "from": "looks", "locked": {"b": 0.5}}
    assert client.post(ROBOTS, json=derived).status_code == 201
    assert triangles(client.get(f"{ROBOTS}/looks_held/visuals")) == triangles(answer)


def test_other_visual_meshes_make_another_robot(client: httpx.Client) -> None:
    add(client, "twice", {"r/hand.stl": CUBE, "r/hand_look.stl": DUMBBELL})
    body = {"kind": "urdf", "id": "twice", "urdf": URDF}
    for look, status in ((DUMBBELL, 200), (CUBE, 409)):
        files = archive({"r/hand.stl": CUBE, "r/hand_look.stl": look})
        assert client.post(ROBOTS, json=body | {"meshes": files}).status_code == status


@pytest.mark.parametrize(
    ("look", "code"), [(None, "visual_mesh_not_found"), (b"no mesh", "visual_mesh_unread"), (b"", "visual_mesh_unread")]
)
def test_a_visual_mesh_that_is_not_there_or_broken_is_a_finding(
    client: httpx.Client, look: bytes | None, code: str
) -> None:
    added = add(
        client,
        f"lacks_{code}_{look is None}_{len(look or b'')}",
        {"r/hand.stl": CUBE} | ({} if look is None else {"r/hand_look.stl": look}),
    )
    assert code in {finding["code"] for finding in added["findings"]}
    assert triangles(client.get(f"{ROBOTS}/{added['id']}/visuals")) == {}


def test_visual_meshes_beyond_the_bound_on_bytes_are_a_finding(
    client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_archive, "MOST_BYTES", len(CUBE) + len(DUMBBELL) - 1)
    added = add(client, "heavy", {"r/hand.stl": CUBE, "r/hand_look.stl": DUMBBELL})
    assert "visual_mesh_unread" in {finding["code"] for finding in added["findings"]}


def test_robots_without_visual_meshes_have_an_empty_file(client: httpx.Client) -> None:
    assert "has_visual_meshes" not in client.get(f"{ROBOTS}/ur5e").json()
    assert triangles(client.get(f"{ROBOTS}/ur5e/visuals")) == {}
    unknown = client.get(f"{ROBOTS}/nobody/visuals")
    assert (unknown.status_code, unknown.json()["code"]) == (404, "unknown_robot")
    assert "Content-Disposition" not in unknown.headers
