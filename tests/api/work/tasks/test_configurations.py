"""Named configurations over HTTP: requested at a pose, returned with every solution."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest

from api.contract import answers, kinematics
from tests.api.answers import checked
from tests.api.requests import joint, plan_request, pose_waypoint
from tests.documents.published import document

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

ROW = document("three_dof_arm")["inverse_kinematics"]["table_2_2"]["rows"][0]
"""Document 002: a target with four solutions, by the cases of Table 2.1."""

CASES = {("right", "up"): 0, ("right", "down"): 1, ("left", "up"): 2, ("left", "down"): 3}


def request_for(configuration: dict[str, Any] | None, **more: Any) -> dict[str, Any]:
    goal = pose_waypoint(ROW["target_m"], configuration=configuration, **more)
    return plan_request(waypoints=[joint(0.5, 1.0, 0.5), goal])


@pytest.mark.parametrize(("shoulder", "elbow"), CASES)
def test_a_plan_ends_in_the_case_of_the_document(service: RunningService, shoulder: str, elbow: str) -> None:
    request = request_for({"shoulder": shoulder, "elbow": elbow})
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    reached = plan["waypoints"][1]
    published = ROW["computed_solutions_deg"][CASES[shoulder, elbow]]
    for value, printed in zip(reached["position"], published, strict=True):
        assert (value * 57.29577951308232 - printed + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-3)
    assert reached["configuration"] == {"shoulder": shoulder, "elbow": elbow, "wrist": None}
    assert (reached["solutions"], reached["choice"]) == (1, "only")


def test_null_and_omitted_are_any(service: RunningService) -> None:
    plans = [
        service.post("/v1/trajectories", request_for(configuration)).json()
        for configuration in (None, {}, {"elbow": None})
    ]
    assert [plan["waypoints"][1]["solutions"] for plan in plans] == [4, 4, 4]
    assert all(plan["waypoints"] == plans[0]["waypoints"] for plan in plans)


def test_all_solutions_say_their_configurations(service: RunningService) -> None:
    robot = "ngv_refuelling_arm"
    position = [0.3, 0.4, -1.0, 0.5, 0.8, -0.4]
    poses = service.post("/v1/kinematics/forward", {"robot": robot, "positions": [position]}).json()["poses"]
    request = {"robot": robot, "poses": poses, "solutions": "all", "reference": position}
    answer = checked(service.post("/v1/kinematics/inverse", request), kinematics.InverseKinematicsAnswer)
    found = [solution["configuration"] for solution in answer["results"][0]["solutions"]]
    sides = itertools.product(("left", "right"), ("up", "down"), ("flip", "no_flip"))
    assert {tuple(one.values()) for one in found} == set(sides)
    best = service.post("/v1/kinematics/inverse", {**request, "solutions": "best"}).json()["results"][0]["solutions"]
    assert best[0]["configuration"] == found[0]


def test_a_configuration_that_is_not_there_is_refused_with_one_that_is(service: RunningService) -> None:
    robot, home = "kuka_kr16_l6_2", [0.3, -1.2, 1.4, 0.2, 0.6, -0.1]
    (pose,) = service.post("/v1/kinematics/forward", {"robot": robot, "positions": [home]}).json()["poses"]
    goal = {"kind": "pose", "pose": pose, "configuration": {"shoulder": "left", "wrist": "flip"}}
    request = plan_request(robot=robot, waypoints=[joint(*home), goal])
    refused = service.post("/v1/trajectories", request)
    assert refused.status_code == 422
    problem = refused.json()
    assert problem["code"] in {"unreachable_waypoint", "joint_position_limit"}
    assert "shoulder right, elbow up, wrist flip" in problem["detail"]
    (first, *_) = problem["remedies"]
    assert first["change"] == "/waypoints/1/configuration"
    assert first["value"] == {"shoulder": "right", "wrist": "flip"}
    goal["configuration"] = first["value"]
    plan = service.post("/v1/trajectories", request)
    assert plan.status_code == 200
    assert plan.json()["waypoints"][1]["configuration"]["wrist"] == "flip"
    request = {"robot": robot, "waypoints": [{**goal, "configuration": {"shoulder": "left"}}]}
    answer = service.post("/v1/kinematics/reachability", request).json()
    assert not answer["reachable"]
    assert answer["waypoints"][0]["solutions"] == 0
