"""Rides on moving objects over HTTP: plans, comparisons, saved plans, and faults of requests."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract import answers, requests
from api.work.answers.plans import AnswerOptions, as_dict
from api.work.answers.saved_plans import load_plan, save_plan
from api.work.conversion.problems import to_backend, to_planning_problem
from planner import Budget, load_robot, plan
from tests.api.answers import checked
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PLAN = "/v1/trajectories"
PICK: dict[str, Any] = json.loads((ROOT / "examples" / "pick_from_a_running_belt.json").read_text(encoding="utf-8"))


def pick(
    *, part: dict[str, Any] | None = None, waypoint: dict[str, Any] | None = None, **changes: Any
) -> dict[str, Any]:
    """Return the request with one waypoint on the part, and changes of the part and the waypoint."""
    request = deepcopy(PICK)
    del request["waypoints"][2:4]
    request["scene"]["objects"][1] |= part or {}
    request["waypoints"][1] |= {"earliest_arrival": 2.5, "latest_arrival": 2.52} | (waypoint or {})
    return request | changes


def test_a_part_is_picked_from_a_running_belt(service: RunningService) -> None:
    answer = checked(service.post(PLAN, PICK | {"include": ["tcp_pose"]}), answers.PlanAnswer)
    (ride,) = answer["rides"]
    assert (ride["waypoint"], ride["object"]) == (1, "part")
    assert ride["begin"] < ride["arrival"] < ride["end"] < answer["duration"]
    assert ride["latest_start"] > 4.0
    assert [waypoint["index"] for waypoint in answer["waypoints"]] == [0, 1, 1, 2, 3, 4, 4]
    assert [waypoint["choice"] for waypoint in answer["waypoints"]][1::4] == ["detour", "detour"]
    for waypoint in answer["waypoints"][2:5]:
        height = 0.185 if waypoint["name"] == "grip" else 0.3
        there = [-0.5, -0.9 + 0.2 * waypoint["arrival_time"], height]
        assert waypoint["pose"]["position"] == pytest.approx(there, abs=1e-6)
    # While the gripper closes, the tool moves with the part.
    grip = answer["waypoints"][3]
    time = np.array(answer["samples"]["time"])
    closing = (time >= grip["arrival_time"]) & (time <= grip["departure_time"])
    assert closing.sum() > 15
    tool = np.array(answer["samples"]["tcp_pose"]["position"])[closing]
    assert tool == pytest.approx(np.array([-0.5, -0.9, 0.185]) + np.outer(time[closing], [0.0, 0.2, 0.0]), abs=1e-4)
    off = {check["quantity"]: check for check in answer["certificate"]["checks"]}["object_position_deviation"]
    assert off["peak"] < off["limit"] == 1e-4


def test_objects_and_poses_are_in_their_frames(service: RunningService) -> None:
    turned = {"position": [0.1, 0.0, 0.0], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 3.141592653589793]}}
    part = {
        "frame": "belt",
        "pose": {"position": [0.6, 0.9, 0.15], "orientation": turned["orientation"]},
        "motion": {"kind": "linear", "velocity": [0.0, -0.2, 0.0]},
    }
    first, second = (
        checked(service.post(PLAN, request), answers.PlanAnswer)
        for request in (pick(), pick(part=part, frames={"belt": turned}))
    )
    assert second["rides"][0]["arrival"] == pytest.approx(first["rides"][0]["arrival"]) == 2.5
    assert second["waypoints"][2]["pose"]["position"] == pytest.approx(first["waypoints"][2]["pose"]["position"])


def test_back_ends_are_compared_on_a_ride(service: RunningService) -> None:
    request = pick(backends=[{"kind": "trapezoidal"}, {"kind": "ruckig"}])
    del request["backend"]
    rows = service.post(f"{PLAN}/compare", request).json()["results"]
    assert [row["status"] for row in rows] == ["planned", "planned"]
    assert max(row["path_deviation"] for row in rows) < 1e-3


def test_saved_plans_keep_their_ride() -> None:
    request = requests.PlanRequest.model_validate(pick(waypoint={"dwell": 0.3}))
    robot, backend = load_robot("ur5e"), to_backend(request.backend)
    problem = to_planning_problem(request, robot)
    made = plan(problem, backend, Budget(attempts=1))
    loaded = load_plan(save_plan(made), problem, backend)
    assert loaded.rides == made.rides
    assert loaded.requested_indices == made.requested_indices
    options = AnswerOptions()
    first, second = (json.dumps(as_dict(each, options), default=np.ndarray.tolist) for each in (made, loaded))
    assert first == second


DOOR = {"kind": "timed_poses", "poses": [{"time": 1.0, "pose": {"position": [0.0, 0.0, 0.0]}}]}
OPEN = {"position": [0.0, 0.0, 0.1]}


@pytest.mark.parametrize(
    ("request_", "pointer"),
    [
        (pick(waypoint={"on": "nothing"}), "/waypoints/1/on"),
        (pick(waypoint={"on": "belt"}), "/waypoints/1/on"),
        (pick(part={"motion": DOOR}), "/waypoints/1/on"),
        (pick(waypoint={"on": ""}), "/waypoints/1/on"),
        (pick(waypoint={"on": 3}), "/waypoints/1/on"),
        (pick(waypoint={"frame": "world"}), "/waypoints/1/frame"),
        (pick(waypoint={"free": "rotation_z"}), "/waypoints/1/free"),
        (pick(waypoint={"pose": OPEN}), "/waypoints/1/pose"),
        (pick(waypoint={"motion": {"kind": "linear"}}), "/waypoints/1/motion"),
        (pick(duration=9.0), "/duration"),
        (pick(optimise="duration"), "/optimise"),
    ],
)
def test_waypoints_on_objects_that_mean_nothing_are_refused(
    service: RunningService, request_: dict[str, Any], pointer: str
) -> None:
    refused = service.post(PLAN, request_)
    assert refused.status_code == 422
    assert pointer in {fault["pointer"] for fault in refused.json()["errors"]}, refused.json()


def test_other_operations_refuse_waypoints_on_objects(service: RunningService) -> None:
    request = {name: pick()[name] for name in ("robot", "waypoints", "scene")}
    refused = service.post("/v1/kinematics/reachability", request)
    assert refused.status_code == 422
    assert "/waypoints/1/on" in {fault["pointer"] for fault in refused.json()["errors"]}, refused.json()


def test_a_window_that_is_missed_is_refused_with_the_arrival(service: RunningService) -> None:
    problem = service.post(PLAN, pick(waypoint={"earliest_arrival": 0.0, "latest_arrival": 1.0})).json()
    assert (problem["code"], problem["waypoint"]) == ("infeasible_duration", 1)
    assert problem["remedies"][0]["change"] == "/waypoints/1/latest_arrival"
    gone = service.post(PLAN, pick(part={"pose": {"position": [-0.5, 1.5, 0.15]}})).json()
    assert (gone["code"], gone["waypoint"]) == ("unreachable_waypoint", 1)


def test_programs_of_robots_cannot_ride(service: RunningService) -> None:
    answer = service.client.post(PLAN, json=pick(), headers={"Accept": "text/x-urscript-moves"})
    assert answer.status_code in {406, 422}
