"""Scenes over HTTP: collision-free plans, collisions of joint positions and trajectories, and refused bodies."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract import answers, collisions, trajectory_operations
from tests.api.answers import checked
from tests.api.requests import joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PLAN = "/v1/trajectories"
CHECK = "/v1/collisions/check"
KUKA: dict[str, Any] = {"robot": "kuka_kr16_2"}
HOME = [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]
ASIDE = [0.8, -0.6, 0.9, 0.0, 0.9, 0.0]
TOO_LOW = [0.8, -0.2, 0.9, 0.0, 0.9, 0.0]
TABLE = {"id": "table", "shape": {"kind": "box", "size": [1.0, 2.0, 0.05]}, "pose": {"position": [1.3, 0.0, 0.3]}}
CORNERS = [[x, y, z] for x in (0.8, 1.8) for y in (-1.0, 1.0) for z in (0.275, 0.325)]
SIDES = [
    *([0, 1, 2], [1, 3, 2], [4, 6, 5], [5, 6, 7], [0, 4, 1], [1, 4, 5]),
    *([2, 3, 6], [3, 7, 6], [0, 2, 4], [2, 6, 4], [1, 5, 3], [3, 5, 7]),
]
SAME_TABLES = {
    "box": TABLE,
    "in_a_frame": {"id": "table", "shape": TABLE["shape"], "frame": "cell", "pose": {"position": [0.0, 0.0, 0.0]}},
    "convex": {"id": "table", "shape": {"kind": "convex", "vertices": CORNERS}},
    "mesh": {"id": "table", "shape": {"kind": "mesh", "vertices": CORNERS, "triangles": SIDES}},
}


def in_cell(last: list[float], **scene: Any) -> dict[str, Any]:
    return KUKA | {"waypoints": [joint(*HOME), joint(*last)], "scene": {"objects": [TABLE], **scene}}


def test_a_plan_in_a_scene_says_how_clear_it_is(service: RunningService) -> None:
    answer = checked(service.post(PLAN, in_cell(ASIDE, margin=0.02)), answers.PlanAnswer)
    clearance = answer["certificate"]["clearance"]
    assert clearance["itself"]["shapes"] == clearance["scene"]["shapes"] == "estimate"
    assert clearance["scene"]["pair"] == ["link_6", "table"]
    assert 0.02 < clearance["scene"]["lower"] <= clearance["scene"]["upper"] <= clearance["scene"]["lower"] + 1e-3
    samples = {"samples": {name: answer["samples"][name] for name in ("time", "position", "velocity", "acceleration")}}
    again = service.post(CHECK, KUKA | samples | {"scene": {"objects": [TABLE]}}).json()
    assert again["results"][0]["clearance"]["scene"]["upper"] == pytest.approx(clearance["scene"]["upper"], abs=1.1e-3)


@pytest.mark.parametrize("kind", ["convex", "mesh"])
def test_a_cone_has_as_many_sides_as_may_be_sent(service: RunningService, kind: str) -> None:
    """Which at its tip are more than coal can store."""
    angles = 2.0 * np.pi * np.arange(255) / 255
    rim = np.column_stack([1.3 + 0.3 * np.cos(angles), 0.3 * np.sin(angles), np.full(255, 0.1)])
    shape: dict[str, Any] = {"kind": kind, "vertices": [*rim.tolist(), [1.3, 0.0, 0.6]]}
    if kind == "mesh":
        shape["triangles"] = [[k, (k + 1) % 255, 255] for k in range(255)]
    there = [0.0, -0.2, 0.9, 0.0, 0.9, 0.0]
    asked = KUKA | {"positions": [HOME, there], "scene": {"objects": [{"id": "cone", "shape": shape}]}}
    answer = checked(service.post(CHECK, asked), collisions.CollisionCheckAnswer)
    assert [result["free"] for result in answer["results"]] == [True, False]


def test_a_collision_is_refused_with_what_is_known(service: RunningService) -> None:
    reply = service.post(PLAN, in_cell(TOO_LOW))
    problem = reply.json()
    assert (reply.status_code, problem["code"], problem["pair"]) == (422, "collision", ["link_5", "table"])
    assert problem["segment"] == 0
    assert problem["depth"] > 0.0
    assert len(problem["point"]) == 3
    there = service.post(CHECK, KUKA | {"positions": [problem["position"]], "scene": {"objects": [TABLE]}}).json()
    assert there["results"][0]["free"] is False
    on_the_way = service.post(CHECK, KUKA | {"positions": [HOME, TOO_LOW], "scene": {"objects": [TABLE]}}).json()
    assert [result["free"] for result in on_the_way["results"]] == [True, False]


def test_a_free_motion_goes_around(service: RunningService) -> None:
    wall = {"id": "wall", "shape": {"kind": "box", "size": [0.8, 0.1, 1.6]}, "pose": {"position": [1.3, 0.0, 0.8]}}
    left, right = [0.9, -0.9, 1.2, 0.0, 0.8, 0.0], [-0.9, -0.9, 1.2, 0.0, 0.8, 0.0]
    request = KUKA | {"waypoints": [joint(*left), joint(*right, motion={"kind": "free"})], "scene": {"objects": [wall]}}
    answer = checked(service.post(PLAN, request), answers.PlanAnswer)
    assert [way["choice"] for way in answer["waypoints"]][1:-1] == ["detour"] * (len(answer["waypoints"]) - 2)
    assert [way["index"] for way in answer["waypoints"]] == [0] + [1] * (len(answer["waypoints"]) - 1)
    assert max(answer["samples"]["segment"]) == len(answer["waypoints"]) - 2 > 0
    assert answer["certificate"]["clearance"]["scene"]["lower"] > -1e-4
    assert service.post(PLAN, request).content == service.post(PLAN, request).content
    request["waypoints"][1]["motion"]["most_checks"] = 5
    lost = service.post(PLAN, request)
    assert (lost.status_code, lost.json()["code"], lost.json()["segment"]) == (422, "no_path_found", 0)
    assert lost.json()["checks"] >= 5
    assert 0.0 <= lost.json()["place"]["fraction"] < 1.0
    request["waypoints"][1] |= {"duration": 2.0}
    assert service.post(PLAN, request).json()["errors"][0]["pointer"] == "/waypoints/1/duration"


@pytest.mark.large_only
def test_a_free_motion_is_made_better(service: RunningService) -> None:
    wall = {"id": "wall", "shape": {"kind": "box", "size": [0.8, 0.1, 1.6]}, "pose": {"position": [1.3, 0.0, 0.8]}}
    motion: dict[str, Any] = {"kind": "free"}
    ends = [0.9, -0.9, 1.2, 0.0, 0.8, 0.0], [-0.9, -0.9, 1.2, 0.0, 0.8, 0.0]
    request = KUKA | {"waypoints": [joint(*ends[0]), joint(*ends[1], motion=motion)], "scene": {"objects": [wall]}}
    plain = checked(service.post(PLAN, request), answers.PlanAnswer)
    assert not any(waypoint.get("gain") for waypoint in plain["waypoints"])
    for budget in ({"optimise_checks": 400}, {"time_budget": 0.5}, {"time_budget": 500.0}):
        motion |= {"optimise": "duration"} | budget
        answer = checked(service.post(PLAN, request | {"deadline": 4.0}), answers.PlanAnswer)
        gain = answer["waypoints"][-1]["gain"]
        assert not any(waypoint.get("gain") for waypoint in answer["waypoints"][:-1])
        assert gain["objective"] == "duration"
        assert answer["duration"] == gain["last"] <= gain["first"] == plain["duration"]
        assert answer["certificate"]["clearance"]["scene"]["lower"] > -1e-4
        for name in budget:
            del motion[name]
    del motion["optimise"]
    motion["time_budget"] = 1.0
    assert service.post(PLAN, request).json()["errors"][0]["pointer"] == "/waypoints/1/motion/time_budget"


def test_a_way_over_is_offered_in_the_form_of_requests(service: RunningService) -> None:
    down = {"kind": "rpy", "rpy": [0.0, 3.141592653589793, 0.0]}
    waypoints = [{"kind": "pose", "pose": {"position": [1.2, y, 0.7], "orientation": down}} for y in (-0.6, 0.6)]
    wall = {"id": "wall", "shape": {"kind": "box", "size": [0.3, 0.05, 0.4]}, "pose": {"position": [1.2, 0.0, 0.5]}}
    request = KUKA | {"waypoints": waypoints, "scene": {"objects": [wall]}}
    remedies = service.post(PLAN, request).json()["remedies"]
    (higher,) = [remedy for remedy in remedies if remedy["change"] == "/waypoints/1/motion"][:1]
    waypoints[1]["motion"] = higher["value"]
    assert service.post(PLAN, request).status_code == 200


@pytest.mark.parametrize("name", SAME_TABLES)
def test_one_table_in_every_shape(service: RunningService, name: str) -> None:
    request = KUKA | {"scene": {"objects": [SAME_TABLES[name]]}, "positions": [ASIDE], "tolerance": 2e-4}
    request["frames"] = {"cell": {"position": [1.3, 0.0, 0.3]}}
    answer = checked(service.post(CHECK, request), collisions.CollisionCheckAnswer)
    boxed = service.post(CHECK, request | {"scene": {"objects": [TABLE]}}).json()
    (found,), (known,) = ([result["clearance"]["scene"]["upper"] for result in a["results"]] for a in (answer, boxed))
    assert found == pytest.approx(known, abs=4e-4)


def upper_of(service: RunningService, **scene: Any) -> tuple[float, list[str]]:
    reply = service.post(CHECK, KUKA | {"positions": [ASIDE], "scene": scene, "tolerance": 2e-4})
    found = checked(reply, collisions.CollisionCheckAnswer)["results"][0]["clearance"]["scene"]
    return found["upper"], found["pair"]


def test_a_point_cloud_is_as_near_as_the_table_that_was_seen(service: RunningService) -> None:
    grid = [[x, y, 0.325] for x in np.linspace(0.8, 1.8, 101).tolist() for y in np.linspace(-1.0, 1.0, 201).tolist()]
    cloud = {"id": "cloud", "shape": {"kind": "point_cloud", "points": grid, "radius": 0.005}}
    (seen, _), (known, _) = (upper_of(service, objects=[thing]) for thing in (cloud, TABLE))
    assert seen == pytest.approx(known - 0.005, abs=2e-3)


def test_what_is_carried_is_nearer_than_the_arm(service: RunningService) -> None:
    rod = {
        "id": "rod",
        "shape": {"kind": "cylinder", "radius": 0.01, "length": 0.6},
        "touch_links": ["link_4", "link_5"],
    }
    alone, _ = upper_of(service, objects=[TABLE])
    carried, pair = upper_of(service, objects=[TABLE], attached=[rod])
    assert carried < alone
    assert pair == ["rod", "table"]


def of(shape: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"id": "thing", "shape": shape, **more}


BALL = {"kind": "sphere", "radius": 0.1}
FLAT = {"kind": "half_space", "normal": [0.0, 0.0, 1.0]}
OPEN = {"kind": "mesh", "vertices": CORNERS[:3], "triangles": [[0, 1, 3]]}
WRONG = {
    "/scene/objects/0/shape/radius": {"objects": [of(BALL | {"radius": 0.0})]},
    "/scene/objects/0/shape/kind": {"objects": [of(BALL | {"kind": "ball"})]},
    "/scene/objects/0/shape/normal": {"objects": [of(FLAT | {"normal": [0.0, 0.0, 0.0]})]},
    "/scene/objects/0/shape/triangles": {"objects": [of(OPEN)]},
    "/scene/objects/0/frame": {"objects": [TABLE | {"frame": "moon"}]},
    "/scene/objects/1/id": {"objects": [TABLE, TABLE]},
    "/scene/allowed_pairs/0": {"objects": [TABLE], "allowed_pairs": [["table", "moon"]]},
    "/scene/attached/0/shape/kind": {"attached": [of(FLAT)]},
    "/scene/attached/0/link": {"attached": [of(BALL, link="moon")]},
}


@pytest.mark.parametrize("pointer", WRONG)
def test_scenes_that_make_no_sense_are_refused(service: RunningService, pointer: str) -> None:
    scene = {"scene": WRONG[pointer]}
    for path, request in ((PLAN, in_cell(ASIDE)), (CHECK, KUKA | {"positions": [HOME]})):
        reply = service.post(path, request | scene)
        assert reply.status_code == 422
        assert pointer in [error["pointer"] for error in reply.json()["errors"]]


def test_joint_positions_or_a_trajectory_are_required(service: RunningService) -> None:
    for request in (KUKA, KUKA | {"positions": [HOME], "samples": {"time": [0.0, 1.0], "position": [HOME, ASIDE]}}):
        assert service.post(CHECK, request).json()["code"] == "invalid_request"


def test_validating_in_a_scene(service: RunningService) -> None:
    slow = {"samples": {"time": [0.0, 20.0], "position": [HOME, ASIDE]}}
    for last, margin, is_free in ((ASIDE, 0.02, True), (ASIDE, 0.5, False), (TOO_LOW, 0.0, False)):
        slow["samples"]["position"] = [HOME, last]
        request = KUKA | slow | {"scene": {"objects": [TABLE], "margin": margin}}
        answer = checked(service.post(f"{PLAN}/validate", request), trajectory_operations.ValidationAnswer)
        assert answer["satisfied"] == is_free
        assert (answer["clearance"] is None, answer["collision"] is None) == (not is_free, is_free)
    assert "collision" not in service.post(f"{PLAN}/validate", KUKA | slow).json()


def test_comparing_in_a_scene(service: RunningService) -> None:
    shared = plan_request(backends=[{"kind": "cubic"}, {"kind": "ruckig"}])
    del shared["backend"]
    floor = {"id": "floor", "shape": {"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": 5.0}}
    results = service.post(f"{PLAN}/compare", shared | {"scene": {"objects": [floor]}}).json()["results"]
    assert [result["status"] for result in results] == ["start_in_collision"] * 2


@pytest.mark.large_only
def test_a_date_is_taken_and_put_on_another_tray(service: RunningService) -> None:
    """The example of document 004; without the stop, or without the date, the fault is at its field."""
    request = json.loads((ROOT / "examples" / "pick_and_place_dates.json").read_text(encoding="utf-8"))
    planned = service.post(PLAN, request)
    assert planned.status_code == 200, planned.text
    clearance = planned.json()["certificate"]["clearance"]
    assert clearance["contacts"]["pair"] == ["cup", "date"]
    assert clearance["scene"]["lower"] >= request["scene"]["margin"] - 1.1e-5 > clearance["contacts"]["lower"]
    for changes, pointer in (
        ({"transition": {"kind": "through"}}, "/waypoints/2/transition"),
        ({"attach": [{"id": "fig"}]}, "/waypoints/2/attach/0/id"),
        ({"attach": [{"id": "date", "touch_links": ["thumb"]}]}, "/waypoints/2/attach/0/touch_links/0"),
    ):
        waypoints = [*request["waypoints"][:2], request["waypoints"][2] | changes, *request["waypoints"][3:]]
        refused = service.post(PLAN, request | {"waypoints": waypoints})
        assert pointer in [fault["pointer"] for fault in refused.json()["errors"]]
    low = [waypoint | {} for waypoint in request["waypoints"]]
    for k in (3, 4):
        low[k]["position"] = [low[k]["position"][0], 0.06, *low[k]["position"][2:]]
    hit = service.post(PLAN, request | {"waypoints": low}).json()
    assert (hit["code"], hit["pair"], hit["segment"]) == ("collision", ["date", "rim"], 3)
