"""The node of `clients/ros2`: MoveIt-style services, called through a double of rosbridge and answered by a service."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
import pytest
import roslibpy
from planner_ros2.node import Node
from planner_ros2.service import PlannerService, RefusedError
from scipy.interpolate import CubicHermiteSpline

from planner import load_robot
from tests.ros.messages import check
from tests.ros.rosbridge_double import Robot, Rosbridge, rosbridge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

ARM = load_robot("ur5e")
JOINTS = list(ARM.joint_names)
TIP = ARM.tip_frame
START = [0.0, -1.2, 1.2, -1.5, -1.5, 0.0]
GOAL = [0.6, -1.0, 1.0, -1.4, -1.5, 0.4]


@contextmanager
def running_node(service: RunningService, current: list[float] = START) -> Iterator[Rosbridge]:
    with rosbridge(Robot(JOINTS, current)) as bridge:
        ros = roslibpy.Ros("127.0.0.1", bridge.port, transport="asyncio")
        ros.run(5.0)
        node = Node(ros, PlannerService(service.url), "ur5e")
        bridge.wait_for(lambda: node._current and len(bridge.services) == 4)
        yield bridge
        ros.close()


@pytest.fixture(scope="module")
def bridge(service: RunningService) -> Iterator[Rosbridge]:
    with running_node(service) as bridge:
        yield bridge


def call(bridge: Rosbridge, name: str, kind: str, request: dict[str, Any]) -> dict[str, Any]:
    response = bridge.call(f"/planner/{name}", request)
    assert response["result"] is True
    values: dict[str, Any] = response["values"]
    check(values, f"{kind}Response")
    return values


def tip_pose(position: list[float]) -> pin.SE3:
    """Return the pose of the tip by Pinocchio alone."""
    model = ARM.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(position))
    return data.oMf[model.getFrameId(TIP)].copy()


def pose_message(pose: pin.SE3) -> dict[str, Any]:
    xyzw = pin.Quaternion(pose.rotation).coeffs().tolist()
    return {
        "position": dict(zip("xyz", pose.translation.tolist(), strict=True)),
        "orientation": dict(zip("xyzw", xyzw, strict=True)),
    }


def state(position: list[float], joints: list[str] = JOINTS) -> dict[str, Any]:
    return {"joint_state": {"header": {}, "name": joints, "position": position}}


def joint_goal(position: list[float], joints: list[str] = JOINTS) -> dict[str, Any]:
    pairs = zip(joints, position, strict=True)
    return {"joint_constraints": [{"joint_name": name, "position": value, "weight": 1.0} for name, value in pairs]}


def pose_goal(pose: pin.SE3, frame: str = "base", link: str = TIP) -> dict[str, Any]:
    message, header = pose_message(pose), {"frame_id": frame}
    region = {"primitives": [{"type": 2, "dimensions": [0.001]}], "primitive_poses": [message]}
    return {
        "position_constraints": [{"header": header, "link_name": link, "constraint_region": region}],
        "orientation_constraints": [{"header": header, "link_name": link, "orientation": message["orientation"]}],
    }


def plan_motion(bridge: Rosbridge, **fields: Any) -> dict[str, Any]:
    answer = call(bridge, "plan_kinematic_path", "GetMotionPlan", {"motion_plan_request": fields})
    response: dict[str, Any] = answer["motion_plan_response"]
    return response


def motion_of(trajectory: dict[str, Any]) -> CubicHermiteSpline:
    points = trajectory["points"]
    times = [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in points]
    return CubicHermiteSpline(
        times, [point["positions"] for point in points], [point["velocities"] for point in points]
    )


@pytest.mark.parametrize("given", [{"start_state": state(START)}, {"start_state": state([], [])}, {}])
def test_a_joint_goal_is_reached_from_the_given_or_current_state(bridge: Rosbridge, given: dict[str, Any]) -> None:
    plan = plan_motion(bridge, goal_constraints=[joint_goal(GOAL[::-1], JOINTS[::-1])], group_name="arm", **given)
    assert plan["error_code"] == {"val": 1}
    assert plan["group_name"] == "arm"
    trajectory = plan["trajectory"]["joint_trajectory"]
    assert trajectory["joint_names"] == JOINTS
    motion = motion_of(trajectory)
    np.testing.assert_allclose(motion(0.0), START, atol=1e-9)
    np.testing.assert_allclose(motion(motion.x[-1]), GOAL, atol=1e-9)
    assert plan["planning_time"] > 0.0


def test_joints_without_a_constraint_stay(bridge: Rosbridge) -> None:
    plan = plan_motion(bridge, goal_constraints=[joint_goal(GOAL[:1], JOINTS[:1])])
    end = plan["trajectory"]["joint_trajectory"]["points"][-1]["positions"]
    np.testing.assert_allclose(end, [GOAL[0], *START[1:]], atol=1e-9)


def test_a_pose_goal_is_reached_by_the_tip(bridge: Rosbridge) -> None:
    pose = tip_pose(GOAL)
    plan = plan_motion(bridge, goal_constraints=[pose_goal(pose)])
    assert plan["error_code"] == {"val": 1}
    reached = tip_pose(plan["trajectory"]["joint_trajectory"]["points"][-1]["positions"])
    assert np.linalg.norm(pin.log6(pose.actInv(reached)).vector) < 1e-5


@pytest.mark.parametrize("backend", ["cubic", "ruckig", "trapezoidal"])
def test_the_planner_id_chooses_the_back_end_and_the_factors_slow_it(bridge: Rosbridge, backend: str) -> None:
    fast, slow = (
        plan_motion(bridge, goal_constraints=[joint_goal(GOAL)], planner_id=backend, **factors)
        for factors in ({}, {"max_velocity_scaling_factor": 0.2, "max_acceleration_scaling_factor": 0.2})
    )
    peaks = []
    for plan in (fast, slow):
        motion = motion_of(plan["trajectory"]["joint_trajectory"])
        peaks.append(np.abs(motion(np.linspace(0.0, motion.x[-1], 2001), 1)).max(axis=0))
    assert np.all(peaks[1] < 0.5 * peaks[0] + 1e-9)


def test_a_cartesian_path_is_straight(bridge: Rosbridge) -> None:
    first, last = tip_pose(START), tip_pose(START)
    last.translation = last.translation + np.array([0.05, 0.1, -0.1])
    request = {"start_state": {}, "link_name": TIP, "waypoints": [pose_message(last)], "max_step": 0.01}
    answer = call(bridge, "compute_cartesian_path", "GetCartesianPath", request)
    assert (answer["fraction"], answer["error_code"]) == (1.0, {"val": 1})
    motion = motion_of(answer["solution"]["joint_trajectory"])
    direction = last.translation - first.translation
    direction /= np.linalg.norm(direction)
    for position in motion(np.linspace(0.0, motion.x[-1], 200)):
        moved = tip_pose(position).translation - first.translation
        assert np.linalg.norm(moved - moved @ direction * direction) < 2e-4


def test_inverse_and_forward_kinematics_agree_with_pinocchio(bridge: Rosbridge) -> None:
    pose = tip_pose(GOAL)
    asked = {
        "pose_stamped": {"header": {"frame_id": "base"}, "pose": pose_message(pose)},
        "robot_state": state(GOAL),
    }
    answer = call(bridge, "compute_ik", "GetPositionIK", {"ik_request": asked})
    assert answer["error_code"] == {"val": 1}
    np.testing.assert_allclose(answer["solution"]["joint_state"]["position"], GOAL, atol=1e-5)
    request = {"fk_link_names": [TIP, "link_3"], "robot_state": state(GOAL)}
    answer = call(bridge, "compute_fk", "GetPositionFK", request)
    assert answer["fk_link_names"] == [TIP, "link_3"]
    model = ARM.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(GOAL))
    for name, answered in zip(answer["fk_link_names"], answer["pose_stamped"], strict=True):
        exact = data.oMf[model.getFrameId(name)]
        np.testing.assert_allclose([answered["pose"]["position"][axis] for axis in "xyz"], exact.translation, atol=1e-9)


FAR = pin.SE3(np.eye(3), np.array([5.0, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"goal_constraints": [pose_goal(FAR)]}, -31),
        ({"goal_constraints": []}, -16),
        ({"goal_constraints": [joint_goal(GOAL), joint_goal(START)]}, -16),
        ({"goal_constraints": [{}]}, -16),
        ({"goal_constraints": [joint_goal(GOAL) | pose_goal(FAR)]}, -16),
        ({"goal_constraints": [joint_goal([1.0], ["no_joint"])]}, -16),
        ({"goal_constraints": [joint_goal([100.0], JOINTS[:1])]}, -16),
        ({"goal_constraints": [joint_goal(GOAL)], "path_constraints": joint_goal(GOAL)}, -16),
        ({"goal_constraints": [pose_goal(FAR, frame="camera")]}, -21),
        ({"goal_constraints": [pose_goal(FAR, link="link_3")]}, -18),
        ({"goal_constraints": [joint_goal(GOAL)], "start_state": state([1.0], [])}, -17),
        ({"goal_constraints": [joint_goal(GOAL)], "planner_id": "RRTConnect"}, -16),
        ({"goal_constraints": [joint_goal(GOAL)], "max_velocity_scaling_factor": 2.0}, -16),
        ({"goal_constraints": [{"joint_constraints": [{"position": 1.0}]}]}, -16),
        ({"goal_constraints": 5}, -16),
    ],
)
def test_requests_without_a_plan_have_the_fitting_error_code(
    bridge: Rosbridge, fields: dict[str, Any], code: int
) -> None:
    assert plan_motion(bridge, **fields) == {"error_code": {"val": code}}


def test_unreachable_poses_and_unknown_links_are_refused(bridge: Rosbridge) -> None:
    asked = {"pose_stamped": {"header": {}, "pose": pose_message(FAR)}}
    assert call(bridge, "compute_ik", "GetPositionIK", {"ik_request": asked}) == {"error_code": {"val": -31}}
    answer = call(bridge, "compute_fk", "GetPositionFK", {"fk_link_names": ["no_link"]})
    assert answer == {"error_code": {"val": -18}}
    answer = call(bridge, "compute_cartesian_path", "GetCartesianPath", {"waypoints": []})
    assert answer == {"error_code": {"val": -16}}


def test_a_service_that_does_not_answer_is_named() -> None:
    start = time.monotonic()
    with pytest.raises(RefusedError, match=r"http://127\.0\.0\.1:1 does not answer") as refused:
        PlannerService("http://127.0.0.1:1").send("/v1/robots")
    assert refused.value.code == -25
    assert time.monotonic() - start < 10.0
    with pytest.raises(ValueError, match="must start with http"):
        PlannerService("file:///etc/passwd")
