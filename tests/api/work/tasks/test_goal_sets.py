"""Goal sets over HTTP: the chosen option, the reasons for the others, and faults at their fields."""

from __future__ import annotations

import json
import time
from typing import Any

import pytest

import planner
from api.contract.requests import PlanRequest
from api.http.cost_keys import by_plan
from api.work.answers.saved_plans import load_plan, save_plan
from api.work.conversion.problems import to_backend, to_planning_problem
from api.work.conversion.time_budgets import within_deadline
from tests.api.conftest import RunningService
from tests.locations import ROOT

DOWN = {"kind": "rpy", "rpy": [3.14159265, 0.0, 0.0]}


def _request() -> dict[str, Any]:
    request: dict[str, Any] = json.loads((ROOT / "examples/any_of_grasps.json").read_text())
    return request


def _with_option(option: dict[str, Any]) -> dict[str, Any]:
    request = _request()
    request["waypoints"][1]["options"].append(option)
    return request


def _pose(x: float) -> dict[str, Any]:
    return {"kind": "pose", "pose": {"position": [x, 0.0, 0.2], "orientation": DOWN}}


def test_the_answer_has_the_chosen_option_and_the_reasons_for_the_others(service: RunningService) -> None:
    request = _request()
    answer = service.post("/v1/trajectories", request).raise_for_status().json()
    (choice,) = answer["choices"]
    assert choice["waypoint"] == 1
    assert [outcome["status"] for outcome in choice["options"]].count("chosen") == 1
    assert choice["options"][choice["option"]]["status"] == "chosen"
    assert choice["options"][3]["code"] == "unreachable_waypoint"
    assert [waypoint["index"] for waypoint in answer["waypoints"] if waypoint["choice"] != "detour"] == [0, 1, 1, 2, 3]
    goal = request["waypoints"][1]["options"][choice["option"]]["waypoints"][1]
    (there,) = [waypoint for waypoint in answer["waypoints"] if waypoint["name"] == goal["name"]]
    assert there["pose"]["position"] == pytest.approx(goal["pose"]["position"], abs=1e-6)
    assert [action["time"] for action in answer["actions"]] == [there["arrival_time"]] * 2
    assert there["departure_time"] - there["arrival_time"] == pytest.approx(0.2)
    assert answer["certificate"]["satisfied"]


def test_a_request_without_goal_sets_has_no_choices(service: RunningService) -> None:
    request = _request()
    request["waypoints"][1:3] = [_pose(0.5)]
    answer = service.post("/v1/trajectories", request).raise_for_status().json()
    assert "choices" not in answer


@pytest.mark.large_only
def test_every_compared_back_end_chooses(service: RunningService) -> None:
    request = _request()
    del request["backend"]
    answer = service.post("/v1/trajectories/compare", request | {"backends": [{"kind": "toppra"}, {"kind": "cubic"}]})
    for result in answer.raise_for_status().json()["results"]:
        assert result["trajectory"]["choices"][0]["option"] is not None


def test_a_refusal_has_the_outcomes_and_remedies_in_an_option(service: RunningService) -> None:
    request = _request()
    request["waypoints"][1]["options"] = [_pose(1.5), _pose(2.5)]
    refused = service.post("/v1/trajectories", request)
    assert refused.status_code == 422
    problem = refused.json()
    assert problem["code"] == "unreachable_waypoint"
    assert problem["waypoint"] == 1
    assert [outcome["code"] for outcome in problem["choices"][0]["options"]] == ["unreachable_waypoint"] * 2
    assert problem["choices"][0]["option"] is None
    changes = [remedy["change"] for remedy in (*problem.get("remedies", ()), *problem.get("hints", ()))]
    assert "/waypoints/1/options/0/pose" in changes


@pytest.mark.parametrize(
    ("option", "pointer"),
    [
        ({"kind": "relative", "frame": "tool"}, "/kind"),
        ({"kind": "sequence", "waypoints": []}, "/waypoints"),
        ({"kind": "joint", "position": [0.0]}, "/position"),
        ({"kind": "named", "name": "nowhere"}, "/name"),
        (_pose(0.5) | {"frame": "nowhere"}, "/frame"),
        (_pose(0.5) | {"actions": [{"kind": "wait", "duration": 1.0}]}, "/actions"),
        (_pose(0.5) | {"tool": {"position": [0.0, 0.0, 0.1]}}, "/tool"),
        ({"kind": "sequence", "waypoints": [_pose(0.5), _pose(0.5) | {"frame": "nowhere"}]}, "/waypoints/1/frame"),
    ],
)
def test_faults_point_to_the_field_of_the_option(service: RunningService, option: dict[str, Any], pointer: str) -> None:
    refused = service.post("/v1/trajectories", _with_option(option))
    assert refused.status_code == 422, refused.text
    (fault,) = refused.json()["errors"]
    assert fault["pointer"] == f"/waypoints/1/options/4{pointer}"


def test_a_saved_plan_keeps_its_choices() -> None:
    request = PlanRequest.model_validate(_request())
    problem, backend = to_planning_problem(request, planner.load_robot("ur5e")), to_backend(request.backend)
    plan = planner.plan(problem, backend)
    loaded = load_plan(save_plan(plan), problem, backend, with_groups=True)
    assert loaded.choices == plan.choices
    assert loaded.requested_indices == plan.requested_indices
    assert len(loaded.problem.waypoints) == len(plan.problem.waypoints)


def test_budgets_and_costs_of_options_count() -> None:
    request = _with_option(_pose(0.4) | {"motion": {"kind": "free", "optimise": "duration", "time_budget": 60.0}})
    assert by_plan(request)[1:3] == (True, True)
    asked = PlanRequest.model_validate(request)
    problem = to_planning_problem(asked, planner.load_robot("ur5e"))
    shorter = within_deadline(problem, time.monotonic() + 1.0).waypoints[1]
    assert isinstance(shorter, planner.AnyOf)
    option = shorter.options[4]
    assert isinstance(option, planner.PoseWaypoint)
    assert isinstance(option.motion, planner.FreeMotion)
    assert option.motion.time_budget is not None
    assert option.motion.time_budget < 1.0
