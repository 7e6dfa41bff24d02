"""Roadmaps of stored scenes: built, used by the plans that they fit, proved again after a change, bounded."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import planner
from api.contract.stored_scenes import MOST_POSITIONS, MOST_SAMPLES, RoadmapDescription, RoadmapRequest, RoadmapsAnswer
from api.work.conversion.scenes import kept_roadmap
from api.work.tasks.trajectories import with_roadmap
from planner.free_motion.roadmaps.building import DEFAULT_SAMPLES
from planner.roadmap import MOST_ROADMAP_POSITIONS, MOST_ROADMAP_SAMPLES
from tests.api.conftest import wait_until
from tests.api.requests import joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

    from tests.api.conftest import RunningService

PLAN, CELL = "/v1/trajectories", "/v1/scenes/around_a_wall"
ROADMAP = f"{CELL}/roadmap"
SCENE, EXAMPLE = (
    json.loads((ROOT / f"examples/scenes/around_a_wall{suffix}.json").read_text(encoding="utf-8"))
    for suffix in ("", "_roadmap")
)
BUILD = EXAMPLE | {"samples": 15, "deadline": 60.0}
ROBOT, (LEFT, RIGHT) = EXAMPLE["robot"], EXAMPLE["positions"]
POST = {"id": "post", "shape": {"kind": "cylinder", "radius": 0.08, "length": 1.2}}
MOVED = {"objects": [POST | {"pose": {"position": [0.2, 1.1, 0.6]}}]}


@pytest.fixture
def cell(service: RunningService) -> Iterator[RunningService]:
    """The service, with a wall in a stored scene."""
    assert service.post("/v1/scenes", SCENE).status_code == 201
    yield service
    service.client.delete(CELL)


def around(**changes: Any) -> dict[str, Any]:
    waypoints = [joint(*LEFT), joint(*RIGHT, motion={"kind": "free"})]
    return plan_request(robot=ROBOT, scene="around_a_wall", waypoints=waypoints, deadline=60.0, **changes)


def planned(service: RunningService, request: dict[str, Any]) -> httpx.Response:
    answer = service.post(PLAN, request)
    assert answer.status_code == 200 and answer.json()["certificate"]["satisfied"], answer.text[:500]
    return answer


def quoted(service: RunningService, request: dict[str, Any]) -> tuple[str, str]:
    """Return what an answer quotes its request by: its hash and its tag."""
    answer = planned(service, request)
    return answer.json()["request_hash"], answer.headers["ETag"]


def in_batch(service: RunningService, *requests: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the plans of the requests as a batch gives them."""
    location = service.post("/v1/batches", {"requests": requests}).headers["Location"]
    wait_until(lambda: service.client.get(location).json()["status"] == "completed", 60.0)
    lines = service.client.get(f"{location}/results.ndjson").content.splitlines()
    return [json.loads(line)["trajectory"] for line in lines]


def roadmaps(service: RunningService) -> list[RoadmapDescription]:
    return RoadmapsAnswer.model_validate_json(service.client.get(ROADMAP).content, strict=True).roadmaps


@pytest.mark.large_only
def test_plans_that_fit_a_roadmap_use_it_until_it_is_deleted(cell: RunningService) -> None:
    """The hash and the tag of the answer quote the roadmap; they do so for no other request."""
    straight = plan_request(robot=ROBOT, scene="around_a_wall", waypoints=[joint(*LEFT), joint(0.8, *LEFT[1:])])
    lifted = around(mounting={"position": [0.0, 0.0, 0.01], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 0.0]}})
    before = [quoted(cell, request) for request in (around(), straight, lifted)]
    built = cell.post(ROADMAP, BUILD)
    assert (built.status_code, built.headers["Location"]) == (201, ROADMAP), built.text
    first = RoadmapDescription.model_validate_json(built.content, strict=True)
    assert first.robot == ROBOT and first.is_current and first.number_of_paths == 1 and first.number_of_checks > 0
    assert roadmaps(cell) == [first]
    after = [quoted(cell, request) for request in (around(), straight, lifted)]
    assert after[1] == before[1] and after[2][0] == before[2][0]
    assert after[0][0] != before[0][0] and after[0][1] != before[0][1]
    assert in_batch(cell, around(), straight) == [planned(cell, request).json() for request in (around(), straight)]
    anew = cell.post(PLAN, around(), headers={"Cache-Control": "no-cache"}).json()
    assert anew == planned(cell, around()).json()
    again = cell.post(ROADMAP, BUILD)
    assert again.status_code == 200 and again.json()["digest"] == first.digest
    assert again.json()["number_of_checks"] == 0
    assert quoted(cell, around()) == after[0]
    assert cell.client.delete(ROADMAP, params={"robot": ROBOT}).status_code == 204
    assert quoted(cell, around()) == before[0] and roadmaps(cell) == []


def test_a_changed_scene_has_roadmaps_that_are_proved_again(cell: RunningService) -> None:
    """A roadmap is proved against the changed objects alone. Equal histories have equal roadmaps and plans."""

    def history() -> tuple[RoadmapDescription, RoadmapDescription, str]:
        first = RoadmapDescription.model_validate_json(cell.post(ROADMAP, BUILD).content)
        assert cell.client.patch(CELL, json=MOVED).status_code == 200
        [second] = roadmaps(cell)
        return first, second, quoted(cell, around())[0]

    first, second, by_first = history()
    assert second.is_current and second.digest != first.digest
    assert 0 < second.number_of_checks < first.number_of_checks
    assert cell.client.patch(CELL, json={"margin": 0.02}).status_code == 200  # as it was: nothing to prove
    assert roadmaps(cell) == [second]
    assert cell.client.delete(CELL).status_code == 204
    assert cell.post("/v1/scenes", SCENE).status_code == 201
    assert roadmaps(cell) == []
    _, again, by_again = history()
    assert (again.digest, by_again) == (second.digest, by_first)


@pytest.mark.parametrize(
    ("changes", "code", "pointer"),
    [
        ({"robot": "nobody"}, "unknown_robot", None),
        ({"samples": MOST_SAMPLES + 1}, "invalid_request", "/samples"),
        ({"samples": 1.5}, "invalid_request", "/samples"),
        ({"positions": [[0.1] * 5]}, "invalid_request", "/positions/0"),
        ({"positions": [LEFT, [9.0, *LEFT[1:]]]}, "invalid_request", "/positions/1/0"),
        ({"positions": [LEFT] * (MOST_POSITIONS + 1)}, "invalid_request", "/positions"),
        ({"scene": "around_a_wall"}, "invalid_request", "/scene"),
        ({"deadline": 1e-6}, "deadline_exceeded", None),
    ],
)
def test_what_is_wrong_with_a_roadmap_is_said(
    cell: RunningService, changes: dict[str, Any], code: str, pointer: str | None
) -> None:
    answer = cell.post(ROADMAP, BUILD | changes).json()
    assert answer["code"] == code, answer
    assert pointer is None or answer["errors"][0]["pointer"] == pointer
    assert roadmaps(cell) == []


def test_an_object_in_a_frame_needs_the_frame(cell: RunningService) -> None:
    on_a_pallet = {"objects": [{"id": "wall", "frame": "pallet"}]}
    assert cell.client.patch(CELL, json=on_a_pallet).status_code == 200
    lacking = cell.post(ROADMAP, BUILD | {"samples": 0, "positions": []})
    assert lacking.json()["errors"][0]["pointer"] == "/frames"
    framed = BUILD | {"samples": 0, "positions": [], "frames": {"pallet": {"position": [0.1, 0.0, 0.0]}}}
    assert cell.post(ROADMAP, framed).status_code == 201


def test_scenes_and_roadmaps_that_are_not_there_are_refused(cell: RunningService) -> None:
    for method, body in (("POST", BUILD), ("GET", None), ("DELETE", None)):
        answer = cell.client.request(method, "/v1/scenes/nobodys/roadmap", json=body, params={"robot": ROBOT})
        assert (answer.status_code, answer.json()["code"]) == (404, "unknown_scene")
    gone = cell.client.delete(ROADMAP, params={"robot": ROBOT})
    assert (gone.status_code, gone.json()["code"]) == (404, "unknown_roadmap")
    assert cell.client.delete(ROADMAP).json()["code"] == "invalid_request"


def test_the_bounds_of_requests_are_those_of_the_library() -> None:
    assert (MOST_SAMPLES, MOST_POSITIONS) == (MOST_ROADMAP_SAMPLES, MOST_ROADMAP_POSITIONS)
    assert RoadmapRequest(robot=ROBOT).samples == DEFAULT_SAMPLES


def test_a_roadmap_of_another_version_is_not_used() -> None:
    """After an update of the service, it refused all plans in the scene."""
    robot, pair = planner.load_robot("three_dof_arm"), [np.zeros(3), np.full(3, 0.2)]
    content = planner.build_roadmap(robot, planner.Scene(), samples=4).to_bytes()
    problem = planner.PlanningProblem(robot, [planner.JointWaypoint(row) for row in pair])
    assert kept_roadmap(content) is not None
    for other in (b"", content[:-1], content.replace(b"edges", b"links", 1)):
        assert with_roadmap(problem, other) is problem
