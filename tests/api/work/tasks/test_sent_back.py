"""Parts of answers sent back in requests, as they came: scenes, poses of robots, trajectories, joint positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.api.requests import IDENTITY, joint, plan_request, pose_waypoint, validate_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

SCENES, PLAN, ROBOTS = "/v1/scenes", "/v1/trajectories", "/v1/robots"
FAR = {"id": "far", "shape": {"kind": "sphere", "radius": 0.1}, "pose": {"position": [3.0, 0.0, 0.3]}}
TURNED = {"position": [0.1, 0.0, 0.2], "orientation": {"kind": "rpy", "rpy": [0.3, -0.4, 1.0]}}
HANGING = {"position": [0.0, 0.0, 2.0], "orientation": {"kind": "rpy", "rpy": [3.141592653589793, 0.0, 0.0]}}
ARM = "kuka_kr16_l6_2"
START = [0.3, -1.2, 1.4, 0.2, 0.6, 0.1]
END = [0.1, -1.1, 1.3, 0.2, 0.7, 0.1]
COLUMNS = ["jerk", "torque", "tcp_pose", "tcp_rpy", "tcp_velocity", "tcp_acceleration", "polynomials"]


@pytest.fixture
def scene(service: RunningService) -> Iterator[dict[str, Any]]:
    """A stored scene, as GET returns it."""
    assert service.post(SCENES, {"id": "sent_back", "objects": [FAR], "margin": 0.01}).status_code == 201
    yield service.client.get(f"{SCENES}/sent_back").json()
    service.client.delete(f"{SCENES}/sent_back")


@pytest.fixture
def robot(service: RunningService) -> Iterator[dict[str, Any]]:
    """A robot with a tool, a mounting and a named position, as GET returns it."""
    derived = {"kind": "derived", "id": "sent_back_robot", "from": ARM, "tool": TURNED, "mounting": HANGING}
    assert service.post(ROBOTS, derived | {"named_positions": {"start": START}}).status_code == 201
    yield service.client.get(f"{ROBOTS}/sent_back_robot").json()
    service.client.delete(f"{ROBOTS}/sent_back_robot")


def test_every_request_with_a_scene_takes_the_one_from_get(service: RunningService, scene: dict[str, Any]) -> None:
    q = [0.1, 0.2, 0.3]
    plan = plan_request(scene=scene)
    comparison = {key: value for key, value in plan.items() if key != "backend"} | {"backends": [{"kind": "cubic"}]}
    kinematics = {"robot": "three_dof_arm", "scene": scene}
    samples = validate_request()["samples"]
    requests: dict[str, dict[str, Any]] = {
        PLAN: plan,
        f"{PLAN}/compare": comparison,
        f"{PLAN}/validate": validate_request(scene=scene),
        f"{PLAN}/resample": {"robot": "three_dof_arm", "trajectory": {"samples": samples}, "scene": scene},
        "/v1/collisions/check": kinematics | {"positions": [q]},
        "/v1/kinematics/inverse": kinematics | {"poses": [{"position": [0.5, 0.1, 0.0]}]},
        "/v1/kinematics/reachability": kinematics | {"waypoints": [joint(*q)]},
    }
    for path, body in requests.items():
        answer = service.post(path, body)
        assert answer.status_code == 200, (path, answer.text)


def test_a_scene_from_get_gives_the_same_plan_as_its_objects(service: RunningService, scene: dict[str, Any]) -> None:
    written = {key: value for key, value in scene.items() if key not in {"id", "content"}}
    answers = [service.post(PLAN, plan_request(scene=each)) for each in (scene, written, "sent_back")]
    assert [answer.status_code for answer in answers] == [200] * 3
    assert answers[0].json()["request_hash"] == answers[1].json()["request_hash"]
    assert answers[0].json()["samples"] == answers[2].json()["samples"]


def test_a_scene_from_get_is_the_same_scene_when_it_is_added(service: RunningService, scene: dict[str, Any]) -> None:
    again = service.post(SCENES, scene)
    assert (again.status_code, again.json()) == (200, scene)


def test_the_tool_and_the_mounting_of_a_robot_are_poses_of_requests(
    service: RunningService, robot: dict[str, Any]
) -> None:
    plan = {"waypoints": [joint(*robot["named_positions"]["start"]), joint(*END)], "include": ["tcp_pose", "torque"]}
    own = service.post(PLAN, plan | {"robot": "sent_back_robot"})
    given = service.post(PLAN, plan | {"robot": ARM, "tool": robot["tool"], "mounting": robot["mounting"]})
    assert own.status_code == given.status_code == 200, given.text
    mine, other = (answer.json()["samples"] for answer in (own, given))
    np.testing.assert_allclose(other["torque"], mine["torque"], atol=1e-6)
    for column in ("position", "quaternion_xyzw"):
        np.testing.assert_allclose(other["tcp_pose"][column], mine["tcp_pose"][column], atol=1e-9)


def test_a_pose_has_one_orientation(service: RunningService, robot: dict[str, Any]) -> None:
    both = robot["tool"] | {"orientation": IDENTITY}
    none = robot["tool"] | {"quaternion_xyzw": [0.0, 0.0, 0.0, 2.0]}
    for tool in (both, none):
        refused = service.post(PLAN, {"robot": ARM, "waypoints": [joint(*START), joint(*END)], "tool": tool})
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["pointer"].startswith("/tool")


def test_a_robot_is_derived_with_what_get_says_of_another(service: RunningService, robot: dict[str, Any]) -> None:
    kept = {name: robot[name] for name in ("tool", "mounting", "named_positions")}
    added = service.post(ROBOTS, {"kind": "derived", "id": "sent_back_again", "from": ARM} | kept)
    assert added.status_code == 201, added.text
    assert added.json()["named_positions"] == robot["named_positions"]
    for name in ("tool", "mounting"):
        for column in ("position", "quaternion_xyzw"):
            assert added.json()[name][column] == pytest.approx(robot[name][column], abs=1e-12)
    service.client.delete(f"{ROBOTS}/sent_back_again")


def test_a_planned_trajectory_goes_into_every_operation(service: RunningService) -> None:
    """All columns of its samples come along."""
    waypoints = [joint(*START), joint(*END)]
    answer = service.post(
        PLAN, {"robot": ARM, "waypoints": waypoints, "backend": {"kind": "quintic"}, "include": COLUMNS}
    )
    planned = answer.json()
    trajectory = {"samples": planned["samples"], "polynomials": planned["polynomials"]}
    for part in (trajectory, {"samples": planned["samples"]}):
        assert service.post(f"{PLAN}/validate", {"robot": ARM} | part).json()["satisfied"]
    operations = {"reverse": {}, "slice": {}, "resample": {}, "retime": {}, "stop": {"time": 0.1}}
    for operation, more in operations.items():
        answer = service.post(f"{PLAN}/{operation}", {"robot": ARM, "trajectory": trajectory} | more)
        assert answer.status_code == 200, (operation, answer.text)
    joined = service.post(f"{PLAN}/join", {"robot": ARM, "trajectories": [trajectory]})
    assert joined.status_code == 200, joined.text


def test_poses_of_answers_are_goals_of_requests(service: RunningService) -> None:
    (pose,) = service.post("/v1/kinematics/forward", {"robot": ARM, "positions": [START]}).json()["poses"]
    found = service.post("/v1/kinematics/inverse", {"robot": ARM, "poses": [pose], "reference": START}).json()
    q = found["results"][0]["solutions"][0]["position"]
    assert q == pytest.approx(START, abs=1e-5)
    planned = service.post(PLAN, {"robot": ARM, "waypoints": [joint(*q), joint(*END)]}).json()
    there = planned["waypoints"][1]["pose"]
    goal = pose_waypoint(there["position"], there["orientation"])
    again = service.post(PLAN, {"robot": ARM, "waypoints": [joint(*q), goal]})
    assert again.status_code == 200, again.text
    assert again.json()["waypoints"][1]["position"] == pytest.approx(END, abs=1e-5)
