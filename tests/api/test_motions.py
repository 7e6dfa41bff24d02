"""Motions over HTTP: lines near a singularity, the ways of continuous joints and of least effort."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.schemas import answers
from tests.api.answers import checked
from tests.api.requests import dh_joint, dh_robot, joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService


def request_for(**motion: Any) -> dict[str, Any]:
    """A line past a straight wrist."""
    request: dict[str, Any] = json.loads((ROOT / "examples" / "past_a_singularity.json").read_text(encoding="utf-8"))
    request["waypoints"][1]["motion"] = {"kind": "linear", **motion}
    return request


def test_a_line_is_refused_by_default_with_remedies_that_are_planned(service: RunningService) -> None:
    refused = service.post("/v1/trajectories", request_for())
    assert refused.status_code == 422
    problem = refused.json()
    assert problem["code"] == "singular_path"
    offered = {
        remedy["value"] for remedy in problem["remedies"] if remedy["change"] == "/waypoints/1/motion/singularity"
    }
    assert offered == {"slow", "deviate"}


@pytest.mark.parametrize(("choice", "code"), [("slow", "near_singularity"), ("deviate", "orientation_deviates")])
def test_a_line_past_a_singular_wrist_is_planned_as_asked(service: RunningService, choice: str, code: str) -> None:
    plan = checked(service.post("/v1/trajectories", request_for(singularity=choice)), answers.PlanAnswer)
    assert [warning["code"] for warning in plan["warnings"]] == [code]
    turns = [position[5] for position in plan["samples"]["position"]]
    assert (max(turns) - min(turns) > 3.0) == (choice == "slow")
    assert plan["certificate"]["satisfied"]


def test_tool_and_joints_leave_straight_motions_by_no_more_than_is_asked(service: RunningService) -> None:
    request = json.loads((ROOT / "examples" / "least_effort.json").read_text(encoding="utf-8"))
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    checks = {check["quantity"]: check for check in plan["certificate"]["checks"]}
    for quantity, most in (("tool_deviation", 0.25), ("joint_deviation", 0.2)):
        assert checks[quantity]["limit"] == most
        assert checks[quantity]["enforced"]
        assert checks[quantity]["peak"] <= most
    assert checks["joint_deviation"]["peak"] > 0.15
    request["backend"]["max_joint_deviation"] = 0.0
    refused = service.post("/v1/trajectories", request)
    assert refused.json()["errors"][0]["pointer"] == "/backend/max_joint_deviation"


@pytest.mark.parametrize(
    ("turns", "end"), [(None, 3.183185307179586), ("nearest", 3.183185307179586), ("as_given", -3.1)]
)
def test_a_continuous_joint_takes_the_short_way_or_the_long_one(
    service: RunningService, turns: str | None, end: float
) -> None:
    robot = dh_robot(joints=[dh_joint(kind="continuous"), dh_joint(kind="continuous", a=0.3)], id="turning_arm")
    service.post("/v1/robots", robot)
    motion = {"kind": "joint"} if turns is None else {"kind": "joint", "turns": turns}
    request = plan_request(robot="turning_arm", waypoints=[joint(3.1, 0.5), joint(-3.1, 0.6, motion=motion)])
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    assert plan["waypoints"][1]["position"] == pytest.approx([end, 0.6])
