"""Scenes that the service keeps: added, changed, deleted, and named by requests."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import pytest

from api.contract.examples.request_examples import request_examples
from api.contract.stored_scenes import ScenesAnswer, StoredScene
from tests.api.conftest import wait_until
from tests.api.requests import dh_robot, plan_request, validate_request
from tests.locations import ROOT

CELL = request_examples()["add_scene"]["a_table_on_a_floor"]

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.api.conftest import RunningService

SCENES, PLAN = "/v1/scenes", "/v1/trajectories"
BALL = {"id": "ball", "shape": {"kind": "sphere", "radius": 0.1}, "pose": {"position": [3.0, 0.0, 0.3]}}
NO_MESH = {"kind": "mesh", "vertices": [[0.0] * 3] * 3, "triangles": [[0, 1, 9]]}
NO_HALF_SPACE = {"kind": "half_space", "normal": [0.0, 0.0, 0.0]}
IN_THE_WAY = {"position": [0.26, 0.03, 0.0]}


@pytest.fixture
def keep(service: RunningService) -> Iterator[Callable[..., httpx.Response]]:
    """A function that adds scenes, which are deleted after the test."""
    ids = set()

    def post(**scene: Any) -> httpx.Response:
        answer = service.post(SCENES, scene)
        if answer.status_code in (200, 201):
            ids.add(answer.json()["id"])
        return answer

    yield post
    for scene_id in ids:
        service.client.delete(f"{SCENES}/{scene_id}")


def change(service: RunningService, scene_id: str, **changes: Any) -> httpx.Response:
    return service.client.patch(f"{SCENES}/{scene_id}", json=changes)


def test_a_scene_is_kept_and_found_by_its_id(service: RunningService, keep: Callable[..., httpx.Response]) -> None:
    added = keep(**CELL)
    assert (added.status_code, added.headers["Location"]) == (201, "/v1/scenes/cell_4")
    found = service.client.get(f"{SCENES}/cell_4")
    kept = StoredScene.model_validate_json(found.content, strict=True)
    assert found.json() == added.json() and [thing.id for thing in kept.objects] == ["table", "floor"]
    assert kept.content.startswith("sha256:") and kept.margin == 0.02
    again = keep(**json.loads(json.dumps(CELL)))
    assert (again.status_code, again.json()) == (200, added.json())
    other = keep(**CELL | {"margin": 0.03})
    assert (other.status_code, other.json()["code"]) == (409, "scene_exists")
    known = service.client.get(f"{SCENES}/cell_4", headers={"If-None-Match": found.headers["ETag"]})
    assert (known.status_code, known.content) == (304, b"")
    assert service.client.delete(f"{SCENES}/cell_4").status_code == 204
    for method in ("GET", "DELETE"):
        assert service.client.request(method, f"{SCENES}/cell_4").json()["code"] == "unknown_scene"


def test_a_scene_without_an_id_gets_one_of_its_content(keep: Callable[..., httpx.Response]) -> None:
    first, same, other = keep(objects=[BALL]), keep(objects=[BALL], margin=0.0), keep(objects=[BALL], margin=0.1)
    ids = [answer.json()["id"] for answer in (first, same, other)]
    assert ids[0] == ids[1] != ids[2] and ids[0].removeprefix("scene_") in first.json()["content"]


def test_an_answer_is_that_of_the_scene_as_it_is_now(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    """The id stays the same, and so does the body of the request; neither a kept answer nor an ETag may be old."""
    keep(id="moving", objects=[BALL])
    request = plan_request(scene="moving")
    free = service.post(PLAN, request)
    inline = service.post(PLAN, plan_request(scene={"objects": [BALL]}))
    assert free.status_code == 200, free.text
    assert free.json() == inline.json(), "by its id or as it is: the same plan, with the same hash"
    assert change(service, "moving", objects=[{"id": "ball", "pose": IN_THE_WAY}]).status_code == 200
    hit = service.client.post(PLAN, json=request, headers={"If-None-Match": free.headers["ETag"]})
    assert (hit.status_code, hit.json()["code"]) == (422, "start_in_collision")
    change(service, "moving", objects=[{"id": "ball", "pose": BALL["pose"]}], margin=0.01)
    other = service.post(PLAN, request)
    assert other.headers["ETag"] != free.headers["ETag"]
    assert other.json()["request_hash"] != free.json()["request_hash"]
    change(service, "moving", margin=0.0)
    assert service.post(PLAN, request).headers["ETag"] == free.headers["ETag"]


def test_every_request_with_a_scene_takes_its_id(service: RunningService, keep: Callable[..., httpx.Response]) -> None:
    for scene_id, pose in (("far", BALL["pose"]), ("near", IN_THE_WAY)):
        keep(id=scene_id, objects=[BALL | {"pose": pose}])
    compared = plan_request(backends=[{"kind": "cubic"}, {"kind": "quintic"}])
    del compared["backend"]
    for path, body in (
        ("/v1/trajectories/compare", compared),
        ("/v1/trajectories/validate", validate_request()),
        ("/v1/trajectories/export?format=csv", plan_request()),
        ("/v1/collisions/check", {"robot": "three_dof_arm", "positions": [[0.1, 0.2, 0.3]]}),
    ):
        answers = [service.post(path, body | {"scene": scene_id}) for scene_id in ("far", "near", "nowhere")]
        assert answers[2].json()["code"] == "unknown_scene" and answers[2].status_code == 404
        assert "collision" not in answers[0].text.replace('"collision":null', ""), path
        assert "ball" in answers[1].text, path
    unnamed = service.post(PLAN, plan_request(scene="/etc"))
    assert unnamed.json()["errors"][0]["pointer"] == "/scene"


def test_a_batch_keeps_the_scenes_that_it_names(service: RunningService, keep: Callable[..., httpx.Response]) -> None:
    """The batch keeps its scenes even if their ids change later, as with robots."""
    keep(id="of_a_batch", objects=[BALL])
    service.post("/v1/robots", dh_robot(id="in_a_batch"))
    requests = [plan_request(scene="of_a_batch"), plan_request(scene="nowhere"), plan_request()]
    batch = service.post("/v1/batches", {"requests": requests}).headers["Location"]
    assert service.client.delete(f"{SCENES}/of_a_batch").status_code == 204
    wait_until(lambda: service.client.get(batch).json()["status"] == "completed")
    results = service.client.get(f"{batch}/results").json()["results"]
    assert [result["status"] for result in results] == ["planned", "unknown_scene", "planned"]
    by_itself = service.post(PLAN, plan_request(scene={"objects": [BALL]})).json()
    assert results[0]["trajectory"]["certificate"] == by_itself["certificate"]
    assert results[0]["trajectory"]["certificate"]["clearance"]["scene"]["pair"][1] == "ball"
    service.client.delete("/v1/robots/in_a_batch")


def test_single_objects_are_moved_added_and_removed(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    before = keep(**CELL | {"id": "changing"}).json()
    crate = {"id": "crate", "shape": {"kind": "box", "size": [0.1, 0.1, 0.1]}, "margin": 0.05}
    gripper = {"id": "gripper", "shape": {"kind": "cylinder", "radius": 0.03, "length": 0.1}, "touch_links": ["crate"]}
    moved = {"id": "table", "pose": {"position": [1.0, 0.0, 0.0]}}
    after = change(service, "changing", objects=[moved, crate], attached=[gripper], remove=["floor"]).json()
    table, added = after["objects"]
    assert table == before["objects"][0] | {"pose": {"position": [1.0, 0.0, 0.0], "orientation": None}}
    assert (added["id"], added["frame"], added["margin"]) == ("crate", "world", 0.05)
    assert [held["touch_links"] for held in after["attached"]] == [["crate"]]
    assert after["content"] != before["content"] and after["margin"] == before["margin"]
    assert service.client.get(f"{SCENES}/changing").json() == after
    changes = {"objects": [{"id": "crate", "margin": None}], "attached": [{"id": "gripper", "touch_links": None}]}
    reset = change(service, "changing", **changes).json()
    assert reset["objects"][1]["margin"] is None and reset["attached"][0]["touch_links"] == []
    emptied = change(service, "changing", remove=["table", "crate", "gripper"]).json()
    assert emptied["objects"] == emptied["attached"] == emptied["allowed_pairs"] == []  # the pair was the table's
    back = change(service, "changing", objects=CELL["objects"], allowed_pairs=CELL["allowed_pairs"]).json()
    assert back["content"] == before["content"]


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"remove": ["table", "nobody"]}, "/remove/1"),
        ({"objects": [{"id": "new"}]}, "/objects/0/shape"),
        ({"objects": [{"id": "table", "shape": {"kind": "box", "size": [1.0, 2.0]}}]}, "/objects/0/shape/size"),
        ({"objects": [{"id": "table", "colour": "red"}]}, "/objects/0/colour"),
        ({"attached": [{"id": "table", "shape": {"kind": "sphere", "radius": 0.1}}]}, "/attached/0/id"),
        ({"objects": [{"id": "f", "shape": NO_HALF_SPACE}]}, "/objects/0/shape/normal"),
        ({"attached": [{"id": "f", "shape": NO_MESH}], "remove": ["table"]}, "/attached/0/shape/triangles"),
        ({"objects": [{"id": "held", "shape": {"kind": "sphere", "radius": 0.1}}]}, "/objects/0/id"),
        ({"margin": -0.1}, "/margin"),
        ({"id": "renamed"}, "/id"),
    ],
)
def test_what_is_wrong_with_a_change_is_said_and_nothing_changes(
    service: RunningService, keep: Callable[..., httpx.Response], changes: dict[str, Any], pointer: str
) -> None:
    """The pointers lead into the change, not into the scene that would come of it."""
    held = {"id": "held", "shape": {"kind": "sphere", "radius": 0.1}}
    kept = keep(**CELL | {"id": "stays", "attached": [held]}).json()
    answer = change(service, "stays", **changes)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")
    assert answer.json()["errors"][0]["pointer"] == pointer
    assert service.client.get(f"{SCENES}/stays").json() == kept


@pytest.mark.parametrize(
    ("scene", "pointer"),
    [
        ({"objects": [BALL, BALL]}, "/objects/1/id"),
        ({"objects": [BALL], "attached": [{"id": "ball", "shape": BALL["shape"]}]}, "/attached/0/id"),
        ({"objects": [BALL | {"shape": {"kind": "cone"}}]}, "/objects/0/shape/kind"),
        ({"objects": [BALL | {"shape": NO_MESH}]}, "/objects/0/shape/triangles"),
        ({"id": "a/b"}, "/id"),
    ],
)
def test_what_is_wrong_with_a_scene_is_said(service: RunningService, scene: dict[str, Any], pointer: str) -> None:
    answer = service.post(SCENES, scene)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")
    assert answer.json()["errors"][0]["pointer"] == pointer


def test_a_mesh_and_a_point_cloud_are_kept(service: RunningService, keep: Callable[..., httpx.Response]) -> None:
    """A tetrahedron and points, both beside the arm: the distance to them is as if they were in the request."""
    corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    mesh = {"id": "mesh", "shape": {"kind": "mesh", "vertices": corners, "triangles": faces}}
    points = {"kind": "point_cloud", "points": [[0.02 * k, 0.0, 0.0] for k in range(20)], "radius": 0.02}
    cloud = {"id": "cloud", "shape": points, "pose": {"position": [0.3, 0.4, 0.0]}}
    scene = {"objects": [mesh | {"pose": {"position": [0.5, 0.0, 0.0]}}, cloud]}
    keep(id="scanned", **scene)
    check = {"robot": "three_dof_arm", "positions": [[0.1, 0.2, 0.3], [0.3, 0.1, 0.5]]}
    by_id, inline = (service.post("/v1/collisions/check", check | {"scene": given}) for given in ("scanned", scene))
    assert by_id.status_code == 200 and by_id.json() == inline.json()


def test_frames_of_a_scene_are_those_of_the_request(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    keep(id="on_a_pallet", objects=[BALL | {"frame": "pallet", "pose": None}])
    frames = {"pallet": {"position": [3.0, 0.0, 0.3], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 1.0]}}}
    placed = service.post(PLAN, plan_request(scene="on_a_pallet", frames=frames)).json()
    inline = service.post(PLAN, plan_request(scene={"objects": [BALL]})).json()
    found, expected = (answer["certificate"]["clearance"]["scene"] for answer in (placed, inline))
    assert found["upper"] == pytest.approx(expected["upper"], abs=1e-3)
    lacking = service.post(PLAN, plan_request(scene="on_a_pallet"))
    assert lacking.json()["errors"][0]["pointer"] == "/scene/objects/0/frame"


def test_scenes_are_listed_in_pages(service: RunningService, keep: Callable[..., httpx.Response]) -> None:
    for k in range(3):
        keep(id=f"page_{k}", objects=[BALL])
    listed, cursor = [], ""
    while cursor is not None:
        answer = service.client.get(SCENES, params={"limit": 2, **({"cursor": cursor} if cursor else {})})
        page = ScenesAnswer.model_validate_json(answer.content, strict=True)
        assert len(page.scenes) <= 2
        listed += page.scenes
        cursor = page.next_cursor
    pages = [scene for scene in listed if scene.id.startswith("page_")]
    assert [scene.id for scene in pages] == ["page_0", "page_1", "page_2"]
    assert {scene.number_of_objects for scene in pages} == {1}


def test_scenes_of_other_clients_can_be_used_but_not_changed(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    keep(id="mine", objects=[BALL])
    transport = httpx.HTTPTransport(local_address="127.0.0.2")
    with httpx.Client(base_url=service.url, transport=transport, trust_env=False) as other:
        assert other.post(PLAN, json=plan_request(scene="mine")).status_code == 200
        refusals = [other.patch(f"{SCENES}/mine", json={"margin": 1.0}), other.delete(f"{SCENES}/mine")]
    assert [(answer.status_code, answer.json()["code"]) for answer in refusals] == [(403, "scene_of_another")] * 2
    assert change(service, "nobodys", margin=1.0).json()["code"] == "unknown_scene"


def test_changes_at_the_same_time_are_all_made_or_refused(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    """No change is lost silently: the final scene contains exactly the changes answered with 200."""
    keep(id="busy")

    def add(k: int) -> int:
        return change(service, "busy", objects=[BALL | {"id": f"ball_{k}"}]).status_code

    with ThreadPoolExecutor(8) as threads:
        statuses = list(threads.map(add, range(16)))
    assert set(statuses) <= {200, 409} and 200 in statuses
    there = {thing["id"] for thing in service.client.get(f"{SCENES}/busy").json()["objects"]}
    assert there == {f"ball_{k}" for k, status in enumerate(statuses) if status == 200}


@pytest.mark.large_only
def test_the_example_is_a_scene_that_requests_may_name(
    service: RunningService, keep: Callable[..., httpx.Response]
) -> None:
    """examples/scenes/date_trays.json, in which a request of examples/ has its trays."""
    scene = json.loads((ROOT / "examples" / "scenes" / "date_trays.json").read_text(encoding="utf-8"))
    request = json.loads((ROOT / "examples" / "date_sorting_over_trays.json").read_text(encoding="utf-8"))
    keep(**scene)
    inline = service.post(PLAN, request)
    assert inline.status_code == 200, inline.text
    assert service.post(PLAN, request | {"scene": scene["id"]}).json()["certificate"] == inline.json()["certificate"]


def largest_scenes() -> dict[str, dict[str, Any]]:
    """Return scenes with the most points and the most objects of the schema, out of the robot's reach."""
    rng = np.random.default_rng(0)
    points = (rng.uniform(-2.0, 2.0, (200_000, 3)) + np.array([6.0, 0.0, 0.0])).round(4).tolist()
    positions = (rng.uniform(-2.0, 2.0, (5000, 3)) + np.array([6.0, 0.0, 0.0])).round(4).tolist()
    turned = {"kind": "rpy", "rpy": [0.1, 0.2, 0.3]}
    boxes = [
        {
            "id": f"object number {k}",
            "shape": {"kind": "box", "size": [0.1, 0.1, 0.1]},
            "pose": {"position": position, "orientation": turned},
            "frame": "world",
            "margin": 0.01,
        }
        for k, position in enumerate(positions)
    ]
    cloud = {"kind": "point_cloud", "points": points, "radius": 0.02}
    return {"points": {"objects": [{"id": "cloud", "shape": cloud}]}, "objects": {"objects": boxes}}


@pytest.mark.large_only
@pytest.mark.parametrize("name", ["points", "objects"])
def test_the_largest_promised_scene_is_planned_at_the_default_limits(service: RunningService, name: str) -> None:
    request = plan_request(scene=largest_scenes()[name], deadline=60.0)
    answer = service.post(PLAN, request)
    assert answer.status_code == 200, answer.text[:300]
    assert answer.json()["certificate"]["satisfied"]
