"""Speed zones over HTTP: plans are slowed, other trajectories are checked against the zones."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers, collisions, trajectory_operations
from api.contract.trajectory_operations import JoinAnswer, OperationAnswer, RetimeAnswer
from tests.api.answers import checked
from tests.api.conftest import wait_until
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

WALKWAY: dict[str, Any] = json.loads((ROOT / "examples" / "slow_beside_a_walkway.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def slow(service: RunningService) -> dict[str, Any]:
    answer = service.post("/v1/trajectories", WALKWAY | {"include": ["polynomials"]})
    return checked(answer, answers.PlanAnswer)


def test_a_plan_says_how_fast_it_is_in_each_zone(slow: dict[str, Any]) -> None:
    wide, narrow = slow["certificate"]["speed_zones"]
    for check, zone in zip((wide, narrow), WALKWAY["speed_zones"], strict=True):
        assert check["clearance"] == zone["clearance"]
        assert check["objects"] == ["walkway"]
        assert check["method"] == "certified"
        assert 0.95 * zone["speed"] < check["peak"] <= check["limit"] == zone["speed"]
    (outer,), (inner,) = wide["intervals"], narrow["intervals"]
    assert outer[0] <= inner[0] < inner[1] <= outer[1]
    assert inner[0] <= narrow["time"] <= inner[1]


@pytest.fixture(scope="module")
def quick(service: RunningService) -> dict[str, Any]:
    """The same without zones."""
    plain = {name: value for name, value in WALKWAY.items() if name != "speed_zones"} | {"include": ["polynomials"]}
    return checked(service.post("/v1/trajectories", plain), answers.PlanAnswer)


ASKED: dict[str, Any] = {name: WALKWAY[name] for name in ("robot", "scene", "speed_zones")}
LIMITS = [zone["speed"] for zone in WALKWAY["speed_zones"]]


def test_a_trajectory_of_another_origin_is_held_against_zones(
    service: RunningService, slow: dict[str, Any], quick: dict[str, Any]
) -> None:
    assert quick["duration"] < slow["duration"]
    assert "speed_zones" not in quick["certificate"]
    for planned, satisfied in ((slow, True), (quick, False)):
        body = ASKED | {"polynomials": planned["polynomials"]}
        answer = checked(service.post("/v1/trajectories/validate", body), trajectory_operations.ValidationAnswer)
        assert answer["satisfied"] is satisfied
        assert all(check["satisfied"] for check in answer["speed_zones"]) is satisfied
        assert answer["collision"] is None
        found = checked(service.post("/v1/collisions/check", body), collisions.CollisionCheckAnswer)
        assert found["free"], "that it is too fast is another matter"
        (result,) = found["results"]
        assert result["speed_zones"] == answer["speed_zones"]


def test_a_check_says_when_and_by_how_much_a_zone_is_broken(service: RunningService, quick: dict[str, Any]) -> None:
    rows = {name: quick["samples"][name] for name in ("time", "position", "velocity", "acceleration")}
    body = ASKED | {"samples": rows, "speed_zones": [{"clearance": 5.0, "speed": 1.0}]}
    found = checked(service.post("/v1/collisions/check", body), collisions.CollisionCheckAnswer)
    ((check,),) = [result["speed_zones"] for result in found["results"]]
    ((first, last),) = check["exceeded"]
    assert not check["satisfied"]
    assert check["intervals"] == [[0.0, pytest.approx(quick["duration"])]]
    assert 0.0 < first < check["time"] < last < quick["duration"], "it starts and ends at rest"
    assert 1.0 < check["lower"] <= check["peak"] <= 1.2 * check["lower"]
    assert check["link"].startswith("link_")
    nearer = {"objects": [{**WALKWAY["scene"]["objects"][0], "pose": {"position": [1.1, 0.0, 1.0]}}]}
    (hit,) = checked(service.post("/v1/collisions/check", body | {"scene": nearer}), collisions.CollisionCheckAnswer)[
        "results"
    ]
    assert hit["collision"]["pair"][1] == "walkway"
    assert not hit["speed_zones"][0]["satisfied"], "that is told of what collides, too"


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["reverse", "slice", "join", "resample", "stop"])
def test_operations_keep_zones_or_are_refused(
    service: RunningService, slow: dict[str, Any], quick: dict[str, Any], name: str
) -> None:
    for planned in (slow, quick):
        given = {"polynomials": planned["polynomials"]}
        body = ASKED | ({"trajectories": [given]} if name == "join" else {"trajectory": given})
        body |= {"time": 0.5 * planned["duration"]} if name == "stop" else {}
        reply = service.post(f"/v1/trajectories/{name}", body)
        if planned is slow:
            answer = checked(reply, JoinAnswer if name == "join" else OperationAnswer)
            assert [check["limit"] for check in answer["certificate"]["speed_zones"]] == LIMITS
            assert all(check["satisfied"] for check in answer["certificate"]["speed_zones"])
            continue
        problem = reply.json()
        assert (reply.status_code, problem["code"]) == (422, "limits_unsatisfiable")
        assert "walkway" in problem["detail"]
        assert problem["value"] > problem["limit"] in LIMITS
        del body["speed_zones"]
        assert service.post(f"/v1/trajectories/{name}", body).status_code == 200


def test_what_is_timed_anew_is_slowed(service: RunningService, slow: dict[str, Any], quick: dict[str, Any]) -> None:
    body = ASKED | {"trajectory": {"polynomials": quick["polynomials"]}, "backend": {"kind": "quintic"}}
    answer = checked(service.post("/v1/trajectories/retime", body), RetimeAnswer)
    assert all(0.95 < check["ratio"] <= 1.0 for check in answer["certificate"]["speed_zones"])
    assert answer["certificate"]["clearance"]["scene"]["lower"] > 0.0
    assert answer["duration"] == pytest.approx(slow["duration"], rel=0.05), "it is the same path"


@pytest.mark.large_only
def test_batches_and_comparisons_and_kept_scenes_have_zones(service: RunningService, slow: dict[str, Any]) -> None:
    assert service.post("/v1/scenes", WALKWAY["scene"] | {"id": "beside_the_walkway"}).status_code == 201
    by_id = WALKWAY | {"scene": "beside_the_walkway"}
    made = service.post("/v1/batches", {"requests": [WALKWAY, by_id, by_id | {"backend": {"kind": "ruckig"}}]})
    assert made.status_code == 202, made.text
    batch = made.headers["Location"]
    wait_until(lambda: bool(service.client.get(batch).json()["ended"]))
    results = service.client.get(f"{batch}/results", params={"format": "json"}).json()["results"]
    assert [result["status"] for result in results] == ["planned"] * 3
    for index, result in enumerate(results):
        found = result["trajectory"]["certificate"]
        assert [check["limit"] for check in found["speed_zones"]] == LIMITS
        assert all(check["satisfied"] for check in found["speed_zones"])
        assert (found == slow["certificate"]) == (index < 2)
    compared = {name: value for name, value in by_id.items() if name != "backend"}
    reply = service.post("/v1/trajectories/compare", compared | {"backends": [{"kind": "quintic"}, {"kind": "toppra"}]})
    first, second = (entry["trajectory"]["certificate"] for entry in reply.json()["results"])
    assert first == slow["certificate"]
    assert [check["satisfied"] for check in second["speed_zones"]] == [True, True]
    service.client.delete("/v1/scenes/beside_the_walkway")


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"scene": None}, "/speed_zones"),
        ({"speed_zones": [{"clearance": 0.3, "speed": 0.25, "objects": ["nobody"]}]}, "/speed_zones/0/objects/0"),
        ({"speed_zones": [{"clearance": 0.3, "speed": 0.0}]}, "/speed_zones/0/speed"),
    ],
)
def test_zones_that_cannot_be_are_refused(service: RunningService, change: dict[str, Any], pointer: str) -> None:
    answer = service.post("/v1/trajectories", WALKWAY | change)
    assert answer.status_code == 422
    assert [error["pointer"] for error in answer.json()["errors"]] == [pointer]


def test_joint_positions_have_no_speed(service: RunningService) -> None:
    answer = service.post("/v1/collisions/check", ASKED | {"positions": [[0.0, -1.5, 1.5, 0.0, 0.5, 0.0]]})
    assert answer.status_code == 422
    assert [error["pointer"] for error in answer.json()["errors"]] == ["/speed_zones"]
