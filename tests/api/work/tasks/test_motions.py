"""Motions over HTTP: lines near a singularity, paths of continuous joints and of least effort."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.contract import answers
from planner.spatial import rotation_from_quaternion
from tests.api.answers import checked
from tests.api.requests import dh_joint, dh_robot, joint, plan_request, pose_waypoint
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService


def request_for(**motion: Any) -> dict[str, Any]:
    """Return a line past a straight wrist."""
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


@pytest.mark.large_only
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


def test_poses_in_the_frame_of_a_pallet_and_a_hanging_robot(service: RunningService) -> None:
    """The pallet's pose in the base frame by hand: hanging from 2 m, the base has y and z of the world turned round."""
    hanging = {"position": [0.0, 0.0, 2.0], "orientation": {"kind": "rpy", "rpy": [math.pi, 0.0, 0.0]}}
    pallet = {"position": [1.2, 0.2, 0.5], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, math.pi / 2.0]}}
    corner = pose_waypoint([0.1, 0.05, 0.2], {"kind": "rpy", "rpy": [0.0, math.pi, 0.0]}, frame="pallet")
    home = joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0)
    request = plan_request(
        robot="kuka_kr16_2",
        waypoints=[home, corner],
        frames={"pallet": pallet},
        mounting=hanging,
        include=["torque"],
    )
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    # In the world at (1.2 - 0.05, 0.2 + 0.1, 0.5 + 0.2), the tool's z axis down: in the base upwards.
    reached = plan["waypoints"][1]["pose"]
    assert reached["position"] == pytest.approx([1.15, -0.3, 1.3], abs=2e-6)
    down = rotation_from_quaternion(np.array(reached["orientation"]["xyzw"]))[:, 2]
    assert down == pytest.approx([0.0, 0.0, 1.0], abs=2e-6)
    standing = plan_request(robot="kuka_kr16_2", waypoints=[home, home], include=["torque"])
    held = service.post("/v1/trajectories", standing).json()["samples"]["torque"][0]
    hangs = service.post("/v1/trajectories", {**standing, "mounting": hanging}).json()["samples"]["torque"][0]
    assert hangs == pytest.approx([-torque for torque in held], abs=1e-6)
    reach = {"robot": "kuka_kr16_2", "waypoints": [corner], "frames": {"pallet": pallet}, "mounting": hanging}
    (found,) = service.post("/v1/kinematics/reachability", reach).json()["waypoints"]
    assert found["status"] == "reachable" or found["solutions"]


def test_the_axes_of_the_world_and_of_a_shifted_frame_under_a_turned_base(service: RunningService) -> None:
    """Hanging from 2 m, the base has y and z of the world turned round, and of all that is parallel to the world."""
    hanging = {"position": [0.0, 0.0, 2.0], "orientation": {"kind": "rpy", "rpy": [math.pi, 0.0, 0.0]}}
    shifted = {"position": [0.1, 0.0, 0.2], "orientation": None}
    down = {"kind": "rpy", "rpy": [0.0, math.pi, 0.0]}
    for position, frame in (([1.15, 0.3, 0.7], "world"), ([1.05, 0.3, 0.5], "shelf")):
        request = plan_request(
            robot="kuka_kr16_2",
            waypoints=[joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), pose_waypoint(position, down, frame=frame)],
            frames={"shelf": shifted},
            mounting=hanging,
        )
        plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
        reached = plan["waypoints"][1]["pose"]
        assert reached["position"] == pytest.approx([1.15, -0.3, 1.3], abs=2e-6)
        axis = rotation_from_quaternion(np.array(reached["orientation"]["xyzw"]))[:, 2]
        assert axis == pytest.approx([0.0, 0.0, 1.0], abs=2e-6)


def test_a_circle_goes_through_a_pose_in_the_frame_of_its_waypoint(service: RunningService) -> None:
    """The same circle with its poses in the base frame."""
    table = {"position": [0.1, -0.2, 0.3], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 0.5]}}
    home, down = joint(0.0, -1.5, 1.5, 0.0, 1.5, 0.0), {"kind": "rpy", "rpy": [0.0, math.pi, 0.0]}
    turned = {"kind": "rpy", "rpy": [0.0, math.pi, 0.5]}
    c, s = math.cos(0.5), math.sin(0.5)

    def at(x: float, y: float, z: float, named: bool) -> list[float]:
        return [x, y, z] if named else [0.1 + c * x - s * y, -0.2 + s * x + c * y, 0.3 + z]

    plans = []
    for named in (True, False):
        more = {"frame": "table"} if named else {}
        axes = down if named else turned
        via = {"position": at(0.95, 0.05, 0.4, named), "orientation": None}
        waypoints = [
            home,
            pose_waypoint(at(0.9, 0.0, 0.4, named), axes, **more),
            pose_waypoint(at(1.0, 0.0, 0.4, named), axes, motion={"kind": "circular", "via": via}, **more),
        ]
        request = plan_request(robot="kuka_kr16_2", waypoints=waypoints, frames={"table": table}, sample_period=0.1)
        plans.append(checked(service.post("/v1/trajectories", request), answers.PlanAnswer))
    assert plans[0]["duration"] == pytest.approx(plans[1]["duration"], rel=1e-6)
    np.testing.assert_allclose(plans[0]["waypoints"][2]["position"], plans[1]["waypoints"][2]["position"], atol=1e-6)


@pytest.mark.parametrize("kind", ["polyline", "spline"])
def test_contours_are_in_the_frame_of_their_waypoint(service: RunningService, kind: str) -> None:
    """The poses of the example are passed, or their corners within the blend, as seen in the frame of the table."""
    request = json.loads((ROOT / "examples" / "contours.json").read_text(encoding="utf-8"))
    index = {"polyline": 1, "spline": 2}[kind]
    request["include"].append("tcp_pose")
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    report = plan["tcp_speed_report"][index - 1]
    assert (report["segment"], report["limit"]) == (index - 1, 0.1)
    assert report["held"] > 0.97
    assert {part["quantity"] for part in report["slow"]} == {"acceleration"}  # of gaining and losing speed
    tools = np.array(plan["samples"]["tcp_pose"]["position"])
    c, s = math.cos(0.3), math.sin(0.3)
    near = 0.02 if kind == "polyline" else 1.5e-3
    for pose in request["waypoints"][index]["motion"]["poses"]:
        x, y, z = pose["position"]
        wanted = np.array([0.9 + c * x - s * y, -0.1 + s * x + c * y, 0.5 + z])
        assert np.linalg.norm(tools - wanted, axis=1).min() < near


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"poses": []}, "/waypoints/1/motion/poses"),
        ({"blend": 0.0}, "/waypoints/1/motion/blend"),
        ({"poses": [{"position": [0.0, 0.0, 0.0], "orientation": None}]}, "/waypoints/1/motion/poses"),
    ],
)
def test_a_polyline_without_corners_or_without_a_blend_is_refused(
    service: RunningService, change: dict[str, Any], pointer: str
) -> None:
    request = json.loads((ROOT / "examples" / "contours.json").read_text(encoding="utf-8"))
    request["waypoints"][1]["motion"].update(change)
    refused = service.post("/v1/trajectories", request)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"].startswith(pointer)


def test_the_turn_of_a_drill_is_chosen_and_answered(service: RunningService) -> None:
    """The drill has the requested axis; the pose as written would turn the wrist by two radians or more."""
    request = json.loads((ROOT / "examples" / "free_turn.json").read_text(encoding="utf-8"))
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    for waypoint in plan["waypoints"][1:3]:
        axis = rotation_from_quaternion(np.array(waypoint["pose"]["orientation"]["xyzw"]))[:, 2]
        assert axis == pytest.approx([0.0, 0.0, -1.0], abs=2e-6)
        assert waypoint["orientation_error"] < 1e-6
    assert np.abs(np.diff([waypoint["position"][5] for waypoint in plan["waypoints"]])).max() < 1.0
    reach = {name: request[name] for name in ("robot", "waypoints")}
    found = service.post("/v1/kinematics/reachability", reach).json()["waypoints"]
    assert {one["status"] for one in found} == {"reachable"}
    request["waypoints"][1]["pose"]["orientation"] = None
    refused = service.post("/v1/trajectories", request)
    assert refused.json()["errors"][0]["pointer"] == "/waypoints/1/free"


def test_a_waypoint_is_passed_at_the_velocity_asked(service: RunningService) -> None:
    request = json.loads((ROOT / "examples" / "past_a_switch.json").read_text(encoding="utf-8"))
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    at, samples = plan["waypoints"][1]["arrival_time"], plan["samples"]
    for column, asked in enumerate(request["waypoints"][1]["transition"]["velocity"]):
        speeds = [row[column] for row in samples["velocity"]]
        assert np.interp(at, samples["time"], speeds) == pytest.approx(asked, abs=5e-3)
    (check,) = [check for check in plan["certificate"]["checks"] if check["quantity"] == "passing_velocity_error"]
    assert check["enforced"]
    compared = request | {"backends": [{"kind": kind} for kind in ("auto", "cubic", "quintic", "toppra")]}
    del compared["backend"]
    results = service.post("/v1/trajectories/compare", compared).json()["results"]
    assert [result["status"] for result in results] == ["planned"] * 3 + ["invalid_request"]


def test_each_waypoint_has_its_tool(service: RunningService) -> None:
    """Poses of the answer equal the forward kinematics with that tool; camera and gripper have different frames."""
    request = json.loads((ROOT / "examples" / "two_tools.json").read_text(encoding="utf-8"))
    answer = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    tools = [None, request["waypoints"][1]["tool"], request["waypoints"][2]["tool"], request["waypoints"][2]["tool"]]
    for waypoint, tool in zip(answer["waypoints"], tools, strict=True):
        body = {"robot": request["robot"], "positions": [waypoint["position"]], "tool": tool}
        (there,) = service.post("/v1/kinematics/forward", body).json()["poses"]
        assert waypoint["pose"]["position"] == pytest.approx(there["position"], abs=1e-9)
        assert waypoint["pose"]["orientation"]["xyzw"] == pytest.approx(there["orientation"]["xyzw"], abs=1e-9)
    assert [one["kind"] for one in answer["actions"]] == ["set_output", "wait"] * 2
    request["waypoints"][1]["transition"] = {"kind": "through"}
    del request["waypoints"][1]["actions"]
    refused = service.post("/v1/trajectories", request)
    assert refused.json()["errors"][0]["pointer"] == "/waypoints/1/transition"


@pytest.mark.parametrize(("whole", "own"), [(0.05, 0.2), (0.2, 0.05)])
def test_the_narrower_limit_of_the_list_and_of_a_waypoint_holds(
    service: RunningService, whole: float, own: float
) -> None:
    end = joint(0.3, 0.1, 0.5, limits={"tcp_linear_velocity": own})
    request = plan_request(waypoints=[joint(0.1, 0.2, 0.3), end], limits={"tcp_linear_velocity": whole})
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    (check,) = [check for check in plan["certificate"]["checks"] if check["quantity"] == "tcp_linear_velocity"]
    assert check["limit"] == 0.05
    assert 0.99 < check["ratio"] <= 1.0
