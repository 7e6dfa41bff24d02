"""Tolerance regions of requested goals, and the chosen goals in the answer."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import httpx
import numpy as np
import pytest

from api.contract import answers
from planner.spatial import rotation_from_quaternion, rotation_from_rpy, rotation_x, rotation_y, rotation_z
from tests.api.answers import checked
from tests.locations import ROOT
from tests.robots_extra import need_robot

if TYPE_CHECKING:
    from tests.api.conftest import RunningService


def test_the_answer_tells_where_in_its_region_a_waypoint_is(service: RunningService) -> None:
    """And the pose of the answer is the one written, shifted and turned by that."""
    request = json.loads((ROOT / "examples" / "anywhere_along_a_bar.json").read_text(encoding="utf-8"))
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    assert ["free" in waypoint for waypoint in plan["waypoints"]] == [False, True, False, True]
    for asked, waypoint in zip(request["waypoints"], plan["waypoints"], strict=True):
        if "free" not in asked:
            continue
        found = waypoint["free"]
        assert found.keys() == asked["free"].keys()
        for name, (lower, upper) in asked["free"].items():
            assert lower - 2e-6 <= found[name] <= upper + 2e-6
        written = rotation_from_rpy(*asked["pose"]["orientation"]["rpy"])
        shift = written @ [found.get(name, 0.0) for name in "xyz"]
        reached = rotation_from_quaternion(np.array(waypoint["pose"]["orientation"]["xyzw"]))
        assert waypoint["pose"]["position"] == pytest.approx(np.array(asked["pose"]["position"]) + shift, abs=2e-6)
        turn = [rotation_x(found.get("rotation_x", 0.0)), rotation_y(found.get("rotation_y", 0.0))]
        assert reached == pytest.approx(written @ turn[0] @ turn[1] @ rotation_z(found["rotation_z"]), abs=2e-6)
    request["waypoints"][1]["free"] = {"y": [0.25, -0.25]}
    refused = service.post("/v1/trajectories", request)
    assert refused.json()["errors"][0]["pointer"] == "/waypoints/1/free/y"


def test_the_preferred_joint_position_is_chosen(service: RunningService) -> None:
    """By the robot's own limits: no joint of the arm is nearer to one of its limits than without the preference."""
    request = json.loads((ROOT / "examples" / "elbow_room.json").read_text(encoding="utf-8"))
    need_robot(request["robot"])
    robot = httpx.get(f"{service.url}/v1/robots/{request['robot']}")
    lower, upper = (np.array([one[name] for one in robot.json()["joints"]]) for name in ("lower", "upper"))
    worst = []
    for prefer in ("far_from_limits", "continuous"):
        plan = checked(service.post("/v1/trajectories", {**request, "ik": {"prefer": prefer}}), answers.PlanAnswer)
        positions = np.array([waypoint["position"] for waypoint in plan["waypoints"][1:]])
        worst.append(np.abs((2.0 * positions - lower - upper) / (upper - lower)).max(axis=1))
    assert (worst[0] < worst[1]).all()
    assert [waypoint["choice"] for waypoint in plan["waypoints"]] == ["given", "shortest_path", "shortest_path"]
    refused = service.post("/v1/trajectories", {**request, "ik": {"prefer": "near_reference"}})
    assert refused.json()["errors"][0]["pointer"] == "/ik/reference"


def test_an_arm_with_five_joints_drives_a_line_whose_turn_is_free(service: RunningService) -> None:
    """The axis of the tool by the poses of the answer; with a fixed orientation there is no plan."""
    derived = {"kind": "derived", "id": "five_axes", "from": "kuka_kr16_2", "locked": {"joint_a6": 0.0}}
    assert service.post("/v1/robots", derived).status_code == 201
    start = [0.0, -1.5, 1.5, 0.3, 0.5]
    (pose,) = service.post("/v1/kinematics/forward", {"robot": "five_axes", "positions": [start]}).json()["poses"]
    pose["position"] = [pose["position"][0], pose["position"][1] - 0.2, pose["position"][2] + 0.1]
    line = {"kind": "pose", "pose": pose, "free": "rotation_z", "motion": {"kind": "linear"}}
    request = {"robot": "five_axes", "waypoints": [{"kind": "joint", "position": start}, line], "include": ["tcp_pose"]}
    assert service.post("/v1/trajectories", request).status_code == 422
    line["motion"]["free"] = "rotation_z"
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    written = rotation_from_quaternion(np.array(pose["orientation"]["xyzw"]))[:, 2]
    for xyzw in plan["samples"]["tcp_pose"]["quaternion_xyzw"]:
        assert rotation_from_quaternion(np.array(xyzw))[:, 2] @ written > 1.0 - 1e-6
    line["motion"]["free"] = {"rotation_z": [0.1, 0.2]}
    refused = service.post("/v1/trajectories", request)
    assert refused.json()["errors"][0]["pointer"] == "/waypoints/1/motion/free/rotation_z"
