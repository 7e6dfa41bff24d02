"""Moving objects and time windows over HTTP: plans, validation, collision checks and stored scenes."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers, collisions, stored_scenes, trajectory_operations
from tests.api.answers import checked
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PLAN = "/v1/trajectories"
BELT: dict[str, Any] = json.loads((ROOT / "examples" / "behind_a_crate_on_a_belt.json").read_text(encoding="utf-8"))


def at_once(**changes: Any) -> dict[str, Any]:
    """Return the request without the wait, with changes of the crate."""
    request = deepcopy(BELT) | {"include": ["polynomials"]}
    del request["waypoints"][0]["dwell"]
    request["scene"]["objects"][1] |= changes
    return request


def test_a_plan_waits_for_a_crate_and_is_refused_without_the_wait(service: RunningService) -> None:
    plan = checked(service.post(PLAN, BELT), answers.PlanAnswer)
    assert plan["certificate"]["clearance"]["scene"]["lower"] > 0.02 - 1.1e-3
    refused = service.post(PLAN, at_once())
    assert refused.status_code == 422
    problem = refused.json()
    assert (problem["code"], problem["pair"][1]) == ("collision", "crate")
    assert 0.0 < problem["time"] < 0.9
    wait = problem["remedies"][0]
    assert wait["change"] == "/waypoints/0/dwell"
    assert 1.0 < wait["value"] <= 1.16


def test_a_free_motion_goes_around_the_crate_or_waits_by_itself(service: RunningService) -> None:
    request = at_once()
    request["waypoints"][1]["motion"] = {"kind": "free"}
    around = checked(service.post(PLAN, request), answers.PlanAnswer)
    assert len(around["waypoints"]) > 2
    request["scene"]["objects"][1]["shape"]["size"] = [0.3, 0.1, 1.2]
    waited = checked(service.post(PLAN, request), answers.PlanAnswer)
    assert "waits_for_object" in {warning["code"] for warning in waited["warnings"]}
    assert waited["waypoints"][0]["departure_time"] > 1.0
    assert around["duration"] < waited["duration"]


def test_motions_are_in_the_frame_of_the_object(service: RunningService) -> None:
    turned = {"position": [0.0, 0.0, 0.0], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 3.141592653589793]}}
    motions = (
        {"kind": "linear", "velocity": [0.0, -0.4, 0.0]},
        {"kind": "timed_poses", "poses": [{"time": 2.5, "pose": {"position": [0.64, -0.67, 0.35]}}]},
    )
    expected = service.post(PLAN, at_once()).json()
    for motion in motions:
        crate = {"frame": "belt", "pose": {"position": [0.64, 0.33, 0.35]}, "motion": motion}
        problem = service.post(PLAN, at_once(**crate) | {"frames": {"belt": turned}}).json()
        assert problem["time"] == pytest.approx(expected["time"], abs=1e-6)
        assert problem["remedies"][0]["value"] == pytest.approx(expected["remedies"][0]["value"], abs=2e-3)


def test_trajectories_of_other_origin_are_checked_in_time(service: RunningService) -> None:
    free = checked(service.post(PLAN, at_once(motion=None, pose={"position": [9.0, 0.0, 0.0]})), answers.PlanAnswer)
    late = at_once(pose={"position": [-0.64, -3.0, 0.35]})["scene"]
    for scene, satisfied in ((at_once()["scene"], False), (late, True)):
        body = {"robot": "ur5e", "scene": scene, "polynomials": free["polynomials"]}
        answer = checked(service.post(f"{PLAN}/validate", body), trajectory_operations.ValidationAnswer)
        assert answer["satisfied"] is satisfied
        found = checked(service.post("/v1/collisions/check", body), collisions.CollisionCheckAnswer)
        assert found["free"] is satisfied
        if not satisfied:
            assert answer["collision"]["pair"][1] == found["results"][0]["collision"]["pair"][1] == "crate"


def test_stored_scenes_keep_motions(service: RunningService) -> None:
    scene = at_once()["scene"]
    checked(service.post("/v1/scenes", scene | {"id": "with_a_belt"}), stored_scenes.StoredScene, 201)
    request = at_once() | {"scene": "with_a_belt"}
    assert service.post(PLAN, request).json()["code"] == "collision"
    change = {"objects": [{"id": "crate", "motion": {"kind": "linear", "velocity": [0.0, 0.0, 3.0]}}]}
    service.client.patch("/v1/scenes/with_a_belt", json=change)
    checked(service.post(PLAN, request), answers.PlanAnswer)
    change["objects"][0]["motion"] = None  # type: ignore[assignment]
    changed = service.client.patch("/v1/scenes/with_a_belt", json=change).json()
    assert changed["objects"][1]["motion"] is None


POSE = {"position": [0.0, 0.0, 0.0]}
TWICE = [{"time": 1.0, "pose": POSE}] * 2


@pytest.mark.parametrize(
    ("crate", "pointer"),
    [
        ({"motion": {"kind": "circular"}}, "/scene/objects/1/motion/kind"),
        ({"motion": {"kind": "linear", "velocity": [0.0, 1.0]}}, "/scene/objects/1/motion/velocity"),
        ({"motion": {"kind": "linear", "velocity": [0.0, 0.0, 1e9]}}, "/scene/objects/1/motion/velocity/2"),
        ({"motion": {"kind": "linear", "velocity": [0, 0, 1], "end": 0.0}}, "/scene/objects/1/motion/end"),
        ({"motion": {"kind": "timed_poses", "poses": []}}, "/scene/objects/1/motion/poses"),
        ({"motion": {"kind": "timed_poses", "poses": TWICE}}, "/scene/objects/1/motion/poses/1/time"),
        ({"shape": {"kind": "half_space", "normal": [0, 0, 1]}}, "/scene/objects/1/shape/kind"),
    ],
)
def test_bad_motions_have_their_own_faults(service: RunningService, crate: dict[str, Any], pointer: str) -> None:
    answer = service.post(PLAN, at_once(**crate))
    assert answer.status_code in {400, 422}
    assert pointer in [fault["pointer"] for fault in answer.json()["errors"]]


def test_checks_that_need_static_objects_refuse_moving_ones(service: RunningService) -> None:
    scene = at_once()["scene"]
    positions = {"robot": "ur5e", "scene": scene, "positions": [BELT["waypoints"][0]["position"]]}
    assert "/scene/objects/1/motion" in str(service.post("/v1/collisions/check", positions).json()["errors"])
    zones = at_once() | {"speed_zones": [{"clearance": 0.3, "speed": 0.2}]}
    assert "/speed_zones/0/objects" in str(service.post(PLAN, zones).json()["errors"])
    take = at_once()
    take["waypoints"][0]["attach"] = [{"id": "crate"}]
    assert "/waypoints/0/attach/0/id" in str(service.post(PLAN, take).json()["errors"])


def with_window(**window: float) -> dict[str, Any]:
    """Return the request without the scene, with a time window at the second waypoint."""
    return {"robot": BELT["robot"], "waypoints": [at_once()["waypoints"][0], BELT["waypoints"][1] | window]}


def test_waypoints_have_time_windows(service: RunningService) -> None:
    plan = checked(service.post(PLAN, with_window(earliest_arrival=2.0, latest_arrival=2.5)), answers.PlanAnswer)
    assert plan["waypoints"][1]["arrival_time"] == pytest.approx(2.0)
    assert plan["waypoints"][0]["departure_time"] > 1.0
    late = service.post(PLAN, with_window(latest_arrival=0.5)).json()
    assert (late["code"], late["waypoint"]) == ("infeasible_duration", 1)
    (remedy,) = late["remedies"]
    assert remedy["change"] == "/waypoints/1/latest_arrival"
    assert remedy["value"] == pytest.approx(late["limit"])
    checked(service.post(PLAN, with_window(latest_arrival=remedy["value"])), answers.PlanAnswer)
    bad = service.post(PLAN, with_window(earliest_arrival=2.0, latest_arrival=1.0))
    assert "/waypoints/1/latest_arrival" in str(bad.json()["errors"])
