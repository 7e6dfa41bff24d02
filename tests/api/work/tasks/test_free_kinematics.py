"""Solutions in a scene over HTTP: free solutions, obstacles of the others, and invalid requests."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract import kinematics
from tests.api.answers import checked
from tests.api.requests import joint
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

INVERSE, REACHABILITY, CHECK = "/v1/kinematics/inverse", "/v1/kinematics/reachability", "/v1/collisions/check"
EXAMPLES = ROOT / "examples" / "kinematics"


def example(name: str) -> dict[str, Any]:
    request: dict[str, Any] = json.loads((EXAMPLES / f"{name}.json").read_text(encoding="utf-8"))
    return request


def solutions_of(service: RunningService, request: dict[str, Any]) -> list[list[dict[str, Any]]]:
    answer = checked(service.post(INVERSE, request), kinematics.InverseKinematicsAnswer)
    return [result["solutions"] for result in answer["results"]]


def test_each_solution_says_what_is_in_its_way_as_the_check_of_collisions_does(service: RunningService) -> None:
    request = example("inverse")
    for found in solutions_of(service, request):
        positions = {"positions": [one["position"] for one in found]}
        asked = {name: request[name] for name in ("robot", "scene")} | positions
        checks = service.post(CHECK, asked).json()["results"]
        assert [one["collision"] is None for one in found] == [True, True, False, False]
        for one, check in zip(found, checks, strict=True):
            assert (one["collision"] is None) == check["free"]
            if not check["free"]:
                assert one["collision"]["pair"] == check["collision"]["pair"]
                assert one["collision"]["depth"] == pytest.approx(check["collision"]["depth"], abs=1e-6)


def test_the_best_is_free_and_nothing_is_said_where_nothing_is_asked(service: RunningService) -> None:
    request = example("inverse") | {"solutions": "best"}
    down = [found[-1]["position"] for found in solutions_of(service, example("inverse"))]
    for first in down:
        for found in solutions_of(service, request | {"reference": first}):
            assert found[0]["collision"] is None
    blind = {name: value for name, value in request.items() if name != "scene"}
    (found, _) = solutions_of(service, blind | {"reference": down[0]})
    assert found[0]["position"] == pytest.approx(down[0], abs=1e-6) and "collision" not in found[0]


def test_a_scene_is_named_by_its_id_and_stands_in_the_world(service: RunningService) -> None:
    """The base 2 m higher leaves the table far below; in a frame of its own that is as high it is where it was."""
    request = example("inverse")
    name = "cell_of_solutions"
    assert service.post("/v1/scenes", request["scene"] | {"id": name}).status_code == 201
    try:
        here = solutions_of(service, request)
        assert solutions_of(service, request | {"scene": name}) == here
        high = {"position": [0.0, 0.0, 2.0], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 0.0]}}
        raised = solutions_of(service, request | {"scene": name, "mounting": high})
        assert all(one["collision"] is None for found in raised for one in found)
        (table,) = request["scene"]["objects"]
        lifted = {"objects": [table | {"frame": "cell"}], "margin": 0.01}
        moved = solutions_of(service, request | {"scene": lifted, "mounting": high, "frames": {"cell": high}})
        assert [[one["collision"] is None for one in found] for found in moved] == [
            [one["collision"] is None for one in found] for found in here
        ]
    finally:
        service.client.delete(f"/v1/scenes/{name}")
    reply = service.post(INVERSE, request | {"scene": "cell_9"})
    assert (reply.status_code, reply.json()["code"]) == (404, "unknown_scene")
    amiss = service.post(INVERSE, request | {"scene": {"objects": [{**table, "frame": "nowhere"}]}}).json()
    assert amiss["errors"][0]["pointer"] == "/scene/objects/0/frame"


def test_reachability_says_where_the_robot_can_keep_clear(service: RunningService) -> None:
    request = example("reachability")
    answer = checked(service.post(REACHABILITY, request), kinematics.ReachabilityAnswer)
    above, inside = answer["waypoints"]
    assert (answer["reachable"], answer["free"]) == (True, False)
    assert (above["solutions"], above["free"], above["free_solutions"], above["hindered_by"]) == (4, True, 2, [])
    assert (inside["solutions"], inside["free"], inside["free_solutions"]) == (4, False, 0)
    assert all(collision["pair"][1] == "table" and collision["depth"] > 0.0 for collision in inside["hindered_by"])
    blind = {name: value for name, value in request.items() if name not in ("scene", "self_collision")}
    answer = checked(service.post(REACHABILITY, blind), kinematics.ReachabilityAnswer)
    assert "free" not in answer and all("free" not in found for found in answer["waypoints"])


def test_self_collision_alone_is_looked_at_where_it_is_asked(service: RunningService) -> None:
    """A robot whose shapes are estimates: folded, its wrist is in its first link."""
    folded, open_ = [0.0, -0.2, 2.6, 0.0, 1.0, 0.0], [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]
    robot = {"robot": "kuka_kr16_2", "self_collision": True}
    found = service.post(REACHABILITY, robot | {"waypoints": [joint(*folded), joint(*open_)]}).json()["waypoints"]
    checks = service.post(CHECK, robot | {"positions": [folded, open_]}).json()["results"]
    assert [one["free"] for one in found] == [check["free"] for check in checks] == [False, True]
    assert found[0]["hindered_by"][0]["pair"] == checks[0]["collision"]["pair"]
    poses = service.post("/v1/kinematics/forward", {"robot": "kuka_kr16_2", "positions": [folded]}).json()["poses"]
    (all_,) = solutions_of(service, robot | {"poses": poses, "solutions": "all", "reference": folded})
    near = [np.abs(np.subtract(one["position"], folded)).max() < 1e-5 for one in all_]
    assert sum(near) == 1 and all_[near.index(True)]["collision"] is not None
