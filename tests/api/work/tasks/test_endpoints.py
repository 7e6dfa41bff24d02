"""Valid requests to every endpoint."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
import pytest

from api.contract import answers, dynamics, kinematics, robots
from api.contract import service as service_answers
from api.pool.messages import Caps, Reply, Task
from api.work.execution import execute
from planner.robots import catalogue_ids
from planner.spatial import rotation_from_quaternion
from tests.api.answers import checked
from tests.api.requests import (
    dh_joint,
    dh_robot,
    joint,
    plan_request,
    pose_waypoint,
    relative_waypoint,
    urdf_chain,
    urdf_robot,
)
from tests.documents.published import document

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

ARM = "ngv_refuelling_arm"
START = [0.1, -0.4, 0.2, 0.1, 0.3, 0.1]


def test_a_plan_has_everything_of_the_contract(service: RunningService) -> None:
    request = plan_request(
        waypoints=[
            joint(0.1, 0.2, 0.3, name="A"),
            joint(0.3, 0.1, 0.5, name="B", duration=2.0, dwell=1.0),
            joint(0.2, 0.2, 0.2, name="C", minimum_duration=1.5),
        ],
        duration=6.0,
        sample_period=0.05,
        include=["jerk", "tcp_pose", "tcp_rpy", "tcp_velocity", "tcp_acceleration", "polynomials", "tcp_polynomials"],
    )
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    samples, waypoints = plan["samples"], plan["waypoints"]
    time, position = np.array(samples["time"]), np.array(samples["position"])
    assert plan["robot"] == "three_dof_arm"
    assert plan["backend"] == "cubic"
    assert [waypoint["name"] for waypoint in waypoints] == ["A", "B", "C"]
    assert time[0] == 0.0
    assert time[-1] == plan["duration"] == waypoints[-1]["arrival_time"] == 6.0
    assert np.all(np.diff(time) > 0.0)
    assert position.shape == (len(time), 3) == np.array(samples["jerk"]).shape
    np.testing.assert_allclose(position[0], [0.1, 0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(position[-1], [0.2, 0.2, 0.2], atol=1e-12)
    assert (waypoints[1]["arrival_time"], waypoints[1]["departure_time"]) == (2.0, 3.0)
    # The cubic of the documents, s = 3 u^2 - 2 u^3, at each sample of the segment whose duration is given.
    first = time <= 2.0
    u = time[first] / 2.0
    np.testing.assert_allclose(position[first, 0], 0.1 + 0.2 * (3.0 * u**2 - 2.0 * u**3), atol=1e-12)
    assert plan["certificate"]["satisfied"] is True
    assert plan["certificate"]["continuity"] == "C1"
    assert [polynomial["joint"] for polynomial in plan["polynomials"]] == plan["joint_names"]
    assert plan["request_hash"].startswith("sha256:")
    assert len(plan["request_hash"]) == len("sha256:") + 64


def test_the_back_end_may_be_omitted(service: RunningService) -> None:
    request = plan_request()
    del request["backend"]
    assert service.post("/v1/trajectories", request).json()["backend"] == "cubic"


@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal"])
def test_every_back_end_plans_pose_and_relative_waypoints(service: RunningService, kind: str) -> None:
    start = service.post("/v1/kinematics/forward", {"robot": ARM, "positions": [START]}).json()["poses"][0]
    goal = [start["position"][0], start["position"][1], start["position"][2] + 0.05]
    request = {
        "robot": ARM,
        "waypoints": [
            joint(*START),
            pose_waypoint(goal, start["orientation"]),
            relative_waypoint({"kind": "cartesian", "translation": [0.0, 0.0, -0.05]}, frame="base"),
        ],
        "backend": {"kind": kind},
        "ik": {"reference": START},
    }
    plan = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)
    poses = service.post(
        "/v1/kinematics/forward",
        {"robot": ARM, "positions": [waypoint["position"] for waypoint in plan["waypoints"]]},
    ).json()["poses"]
    np.testing.assert_allclose(poses[1]["position"], goal, atol=2e-6)
    np.testing.assert_allclose(poses[2]["position"], start["position"], atol=4e-6)
    given, pose, _ = plan["waypoints"]
    assert (given["solutions"], given["solution"], given["choice"]) == (None, None, "given")
    assert 0 <= pose["solution"] < pose["solutions"]
    assert pose["choice"] in {"only", "shortest_path"}
    assert plan["certificate"]["satisfied"] is True


def test_the_same_request_gives_the_same_bytes(service: RunningService) -> None:
    request = plan_request(include=["polynomials"])
    reordered = dict(reversed(request.items()))
    spelled_out = request | {"sample_period": 0.01, "seed": 0, "limits": {"velocity_scale": 1.0}}
    bodies = {service.post("/v1/trajectories", request).content for _ in range(8)}
    assert len(bodies) == 1
    assert service.post("/v1/trajectories", reordered).content in bodies
    assert service.post("/v1/trajectories", spelled_out).content in bodies
    assert service.post("/v1/trajectories", plan_request(sample_period=0.02)).content not in bodies


def test_orientations_in_three_notations_are_one(service: RunningService) -> None:
    roll, pitch, yaw = 0.3, -0.5, 1.1
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    rotation = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    cr, sr, cp, sp, cy, sy = (f(a / 2.0) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    xyzw = [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
    notations = [
        {"kind": "rpy", "rpy": [roll, pitch, yaw]},
        {"kind": "quaternion", "xyzw": xyzw},
        {"kind": "quaternion", "xyzw": [1.009 * value for value in xyzw]},
        {"kind": "matrix", "matrix": rotation},
        {"kind": "matrix", "matrix": [[1.004 * value for value in row] for row in rotation]},
    ]
    poses = [
        checked(
            service.post(
                "/v1/kinematics/forward",
                {
                    "robot": ARM,
                    "positions": [START],
                    "tool": {"position": [0.1, 0.0, 0.0], "orientation": notation},
                },
            ),
            kinematics.ForwardKinematicsAnswer,
        )["poses"][0]
        for notation in notations
    ]
    for pose in poses[1:]:
        np.testing.assert_allclose(pose["position"], poses[0]["position"], atol=1e-12)
        np.testing.assert_allclose(pose["orientation"]["xyzw"], poses[0]["orientation"]["xyzw"], atol=1e-12)


def test_inverse_kinematics_answers_each_pose(service: RunningService) -> None:
    pose = service.post("/v1/kinematics/forward", {"robot": ARM, "positions": [START]}).json()["poses"][0]
    far = {"position": [50.0, 0.0, 0.0], "orientation": None}
    request = {"robot": ARM, "poses": [pose, far, pose], "solutions": "best", "reference": START}
    answer = checked(service.post("/v1/kinematics/inverse", request), kinematics.InverseKinematicsAnswer)
    first, second, third = answer["results"]
    assert [result["status"] for result in answer["results"]] == ["solved", "unreachable_waypoint", "solved"]
    np.testing.assert_allclose(first["solutions"][0]["position"], START, atol=1e-5)
    assert third == first
    assert second["solutions"] == []
    nearest = np.array(second["nearest"]["pose"]["position"])
    assert np.linalg.norm(nearest - [50.0, 0.0, 0.0]) == pytest.approx(second["nearest"]["position_error"], abs=1e-9)


@pytest.mark.parametrize("row", document("three_dof_arm")["inverse_kinematics"]["table_2_2"]["rows"])
def test_all_solutions_come_sorted_by_their_distance_to_the_reference(
    service: RunningService, row: dict[str, Any]
) -> None:
    """Document 002, Table 2.2: four solutions for each of five targets. All joints are equally fast."""
    published = np.radians(row["published_solutions_deg"])
    reference = published[2]
    poses = [{"position": row["target_m"], "orientation": None}, {"position": [1.0, 0.0, 0.0], "orientation": None}]
    request = {"robot": "three_dof_arm", "poses": poses, "solutions": "all", "reference": reference.tolist()}
    answer = checked(service.post("/v1/kinematics/inverse", request), kinematics.InverseKinematicsAnswer)
    found, far = answer["results"]
    assert (far["status"], far["solutions"]) == ("unreachable_waypoint", [])
    positions = np.array([solution["position"] for solution in found["solutions"]])
    assert (np.diff(np.linalg.norm(positions - reference, axis=1)) >= 0.0).all()
    for printed in published:
        apart = (positions - printed + np.pi) % (2.0 * np.pi) - np.pi
        assert np.abs(apart).max(axis=1).min() < np.radians(0.14)  # rounded and misprinted as E23 says
    assert all(solution["position_error"] <= 1e-6 for solution in found["solutions"])


def test_jacobian_of_a_tool(service: RunningService) -> None:
    """Against differences of the poses that the service answers."""
    tool = {"position": [0.1, 0.2, -0.1], "orientation": None}
    asked = {"robot": ARM, "position": START, "tool": tool}
    answer = checked(service.post("/v1/kinematics/jacobian", asked), kinematics.JacobianAnswer)
    J, h = np.array(answer["jacobian"]), 1e-5
    assert J.shape == (6, 6)
    positions = np.vstack([START + h * np.eye(6), START - h * np.eye(6)]).tolist()
    poses = service.post("/v1/kinematics/forward", {"robot": ARM, "positions": positions, "tool": tool}).json()["poses"]
    p = np.array([pose["position"] for pose in poses])
    np.testing.assert_allclose(J[:3], (p[:6] - p[6:]).T / (2.0 * h), atol=1e-8)
    assert answer["manipulability"] == pytest.approx(abs(np.linalg.det(J)), rel=1e-9)
    assert answer["manipulability"] == pytest.approx(math.prod(answer["singular_values"]), rel=1e-12)
    # Fewer than six joints: as many columns and singular values.
    small = service.post("/v1/kinematics/jacobian", {"robot": "three_dof_arm", "position": [0.1, 0.2, 0.3]}).json()
    assert np.array(small["jacobian"]).shape == (6, 3)
    assert len(small["singular_values"]) == 3


def test_reachability_answers_each_waypoint(service: RunningService) -> None:
    arm = "date_sorting_arm"
    middle, beyond = [0.3, 0.1, 0.2, 0.5, 1.0, 0.4], [0.3, 0.6, 0.2, 0.5, 1.0, 0.4]  # l1 goes up to 0.5 m
    forward = service.post("/v1/kinematics/forward", {"robot": arm, "positions": [middle, beyond]})
    near, high = forward.json()["poses"]
    far = [50.0, 0.0, 0.0]
    request = {
        "robot": arm,
        "waypoints": [
            joint(*middle, name="A"),
            pose_waypoint(**near),
            pose_waypoint(**high),
            pose_waypoint(far, near["orientation"]),
            relative_waypoint({"kind": "cartesian", "translation": [-0.05, 0.0, 0.0]}, frame="base"),
            joint(*beyond),
        ],
    }
    answer = checked(service.post("/v1/kinematics/reachability", request), kinematics.ReachabilityAnswer)
    assert answer["reachable"] is False
    given, reached, limited, distant, moved, outside = answer["waypoints"]
    assert [waypoint["index"] for waypoint in answer["waypoints"]] == list(range(6))
    assert [waypoint["status"] for waypoint in answer["waypoints"]] == [
        "reachable",
        "reachable",
        *["joint_position_limit"] * 4,  # the arm slides upwards and outwards: without limits it would reach anything
    ]
    assert (given["name"], given["solutions"], given["detail"]) == ("A", None, None)
    assert given["limit_margin"] == {"joint": "l1", "value": pytest.approx(0.1)}
    at = {"robot": arm, "position": middle}
    jacobian = service.post("/v1/kinematics/jacobian", at).json()
    assert given["manipulability"] == pytest.approx(jacobian["manipulability"])
    assert reached["solutions"] == 2  # document 004: the wrist and its flip
    assert reached["limit_margin"] == {"joint": "l1", "value": pytest.approx(0.1, abs=1e-6)}
    assert "l1" in limited["detail"]
    assert (limited["solutions"], limited["limit_margin"], limited["manipulability"]) == (0, None, None)
    assert distant["nearest"]["position_error"] > 49.0
    # The move starts from the pose asked, 50 m away, not from the nearest one.
    apart = np.subtract([49.95, 0.0, 0.0], moved["nearest"]["pose"]["position"])
    assert moved["nearest"]["position_error"] == pytest.approx(np.linalg.norm(apart), abs=1e-9)
    assert "nearest" not in outside
    good = checked(
        service.post("/v1/kinematics/reachability", request | {"waypoints": request["waypoints"][:2]}),
        kinematics.ReachabilityAnswer,
    )
    assert good["reachable"] is True


@pytest.mark.large_only
def test_workspace_of_the_published_arm(service: RunningService) -> None:
    """Section 4 of document 004: 43.93, 800, 1450 and 650 mm."""
    request = {"robot": "date_sorting_arm", "samples": 50}
    first = service.post("/v1/kinematics/workspace", request)
    answer = checked(first, kinematics.WorkspaceAnswer)
    names = ("minimum_radius", "maximum_radius", "maximum_height", "radius_at_maximum_height")
    figures = [1000.0 * answer[name]["value"] for name in names]
    assert figures == pytest.approx([43.93, 800.0, 1450.0, 650.0], abs=0.01)
    assert np.array(answer["points"]).shape == (50, 3)
    assert service.post("/v1/kinematics/workspace", request | {"seed": 0}).content == first.content
    # A tool 0.1 m along the flange's y, which points outwards when the arm is stretched.
    longer = request | {"tool": {"position": [0.0, 0.1, 0.0], "orientation": None}}
    tool = service.post("/v1/kinematics/workspace", longer).json()
    assert tool["maximum_height"]["value"] == pytest.approx(1.55, abs=1e-9)


def test_a_cloud_is_no_larger_than_any_other_answer() -> None:
    """The reply of a worker of a service with small caps, without the service."""
    caps = Caps(max_deadline=60.0, max_waypoints=10, max_samples=1000, memory_mib=1024)

    def reply(samples: int) -> Reply:
        body = orjson.dumps({"robot": "three_dof_arm", "samples": samples})
        form = {"format": None, "accept": "application/json"}
        return execute(Task("workspace", "/v1/kinematics/workspace", time.monotonic(), math.inf, body, form), caps)

    assert len(orjson.loads(reply(333).body)["points"]) == 333
    refused = reply(334)
    assert refused.status == 422
    assert orjson.loads(refused.body)["errors"][0]["pointer"] == "/samples"


def test_torques_are_those_of_what_is_carried(service: RunningService) -> None:
    """1 kg is taken at the second waypoint and put down at the third: M g on the document's vertical slide (004, 6)."""
    positions = [[0.0, 0.1, 0.1, 0.3, 1.2, 0.0], [0.5, 0.3, 0.2, 0.6, 1.0, 0.2]]
    request = plan_request(
        robot="date_sorting_arm",
        waypoints=[
            joint(*positions[0]),
            joint(*positions[1], payload={"mass": 1.0}),
            joint(*positions[0], put_down=True),
            joint(*positions[1]),
        ],
        include=["torque"],
    )
    samples = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)["samples"]
    torque, segment = np.array(samples["torque"]), np.array(samples["segment"])
    assert not torque[segment != 1].any()
    slide = np.array(samples["acceleration"])[segment == 1][:, 1]
    assert np.corrcoef(torque[segment == 1][:, 1], slide)[0, 1] > 0.9
    assert torque[segment == 1][:, 1].mean() == pytest.approx(9.81, rel=0.1)


def test_torques_hold_a_payload(service: RunningService) -> None:
    """The torques equal J^T F of document 004; an omitted field is zero."""
    request = {"robot": "date_sorting_arm", "payload": {"mass": 2.0}, "positions": [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]]}
    path = "/v1/dynamics/inverse"
    answer = checked(service.post(path, request), dynamics.InverseDynamicsAnswer)
    at = {"robot": "date_sorting_arm", "position": request["positions"][0]}
    J = np.array(service.post("/v1/kinematics/jacobian", at).json()["jacobian"])
    np.testing.assert_allclose(answer["torques"], [J[2] * 2.0 * 9.81], atol=1e-12)
    still = {"velocities": [[0.0] * 6], "accelerations": [[0.0] * 6]}
    assert service.post(path, request | still).json() == answer
    # Lifting with 1 m/s^2 adds 1 N a kilogram on the vertical axis.
    lifting = service.post(path, request | {"accelerations": [[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]]}).json()
    assert lifting["torques"][0][1] == pytest.approx(2.0 * (9.81 + 1.0), abs=1e-12)


def test_a_payload_with_tolerances_is_as_slow_as_its_heaviest_body(service: RunningService) -> None:
    ends = [
        {"kind": "joint", "position": q} for q in ([0.0, -1.4, 1.5, 0.0, 0.6, 0.0], [0.6, -0.9, 1.2, 0.4, 0.9, 0.5])
    ]
    torque = [442.0, 672.0, 247.0, 54.0, 67.0, 22.0]
    request = {"robot": "kuka_kr16_2", "waypoints": ends, "limits": {"torque": torque}, "backend": {"kind": "quintic"}}
    body = {"mass": 10.0, "center_of_mass": [0.0, 0.0, 0.1]}
    found = {}
    for name, payload in {
        "given": body,
        "heaviest": body | {"mass": 13.0},
        "within": body | {"mass_tolerance": 3.0},
        "box": body | {"mass_tolerance": 3.0, "center_of_mass_tolerance": [0.05, 0.05, 0.05], "inertia_tolerance": 0.2},
    }.items():
        answer = checked(service.post("/v1/trajectories", request | {"payload": payload}), answers.PlanAnswer)
        quantities = [check["quantity"] for check in answer["certificate"]["checks"]]
        assert ("torque_with_tolerances" in quantities) == (name in ("within", "box"))
        found[name] = answer["duration"]
    assert found["within"] == pytest.approx(found["heaviest"], rel=2e-3)
    assert found["given"] < found["within"] < found["box"]
    refused = service.post("/v1/trajectories", request | {"payload": body | {"mass_tolerance": 11.0}})
    assert refused.status_code == 422
    assert "mass_tolerance" in refused.text


def test_torques_have_a_process_force(service: RunningService) -> None:
    """J^T F at the tool, in the axes of the base; the force of a tool is turned with it."""
    robot, position, force = "date_sorting_arm", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [3.0, -2.0, 7.0]
    tool = {"position": [0.0, 0.1, 0.2], "orientation": {"kind": "rpy", "rpy": [0.2, 0.0, 0.4]}}
    at = {"robot": robot, "tool": tool, "position": position}
    jacobian = np.array(service.post("/v1/kinematics/jacobian", at).json()["jacobian"])
    pose = service.post("/v1/kinematics/forward", {"robot": robot, "tool": tool, "positions": [position]}).json()[
        "poses"
    ][0]
    turned = rotation_from_quaternion(np.array(pose["orientation"]["xyzw"])) @ force
    request = {"robot": robot, "tool": tool, "positions": [position]}
    for frame, vector in (("base", force), ("world", force), ("tool", turned)):
        asked = request | {"process_force": {"force": force, "frame": frame}}
        answer = checked(service.post("/v1/dynamics/inverse", asked), dynamics.InverseDynamicsAnswer)
        np.testing.assert_allclose(answer["torques"], [jacobian[:3].T @ vector], atol=1e-9)
    unknown = request | {"process_force": {"force": force, "frame": "table"}}
    assert service.post("/v1/dynamics/inverse", unknown).json()["errors"][0]["pointer"] == "/process_force/frame"


def test_friction_and_rotors_of_an_added_robot_are_in_torques(service: RunningService) -> None:
    """They come from its table, and a derived robot has its own."""
    drives = {"friction": 2.0, "damping": 0.5, "rotor_inertia": 0.1}
    plain = [dh_joint(mass=1.0, torque=80.0), dh_joint(mass=1.0, torque=80.0)]
    bodies = [
        dh_robot(id=name, joints=joints) for name, joints in (("smooth", plain), ("rough", [plain[0] | drives] * 2))
    ]
    own = {"joint_1": {"friction": 0.0, "damping": 0.0}}
    bodies.append({"kind": "derived", "id": "oiled", "from": "rough", "limits": own})
    motion = {"positions": [[0.3, 0.4]], "velocities": [[-2.0, 1.0]], "accelerations": [[3.0, -1.0]]}
    torques, ids = {}, {}
    for body in bodies:
        added = service.post("/v1/robots", body | ({"from": ids["rough"]} if "from" in body else {}))
        assert added.status_code == 201, added.text
        ids[body["id"]] = added.json()["id"]
        answer = service.post("/v1/dynamics/inverse", motion | {"robot": added.json()["id"]})
        torques[body["id"]] = np.array(checked(answer, dynamics.InverseDynamicsAnswer)["torques"][0])
        first = added.json()["joints"][0]
        stated = {"smooth": {}, "rough": drives, "oiled": {"rotor_inertia": 0.1}}[body["id"]]
        assert {name: first[name] for name in drives if name in first} == stated
    np.testing.assert_allclose(torques["rough"] - torques["smooth"], [-2.0 - 1.0 + 0.3, 2.0 + 0.5 - 0.1], atol=1e-9)
    np.testing.assert_allclose(torques["oiled"] - torques["smooth"], [0.3, 2.4], atol=1e-9)


def test_tolerances_and_following_errors_of_an_added_robot_are_in_its_plans(
    service: RunningService,
) -> None:
    sets = {"friction": 2.0, "friction_tolerance": 1.0, "following_error": 1e-3}
    body = {"kind": "derived", "id": "loose", "from": "ur5e", "limits": {"elbow_joint": sets}}
    added = service.post("/v1/robots", body)
    assert added.status_code == 201, added.text
    joint = added.json()["joints"][2]
    assert {name: joint[name] for name in sets} == sets
    waypoints = [{"kind": "joint", "position": [x, -1.2, 1.4, -0.4, 1.0, 0.0]} for x in (0.0, 0.5)]
    waypoints.append(
        {"kind": "relative", "frame": "base", "move": {"kind": "cartesian", "translation": [0.0, 0.05, 0.0]}}
    )
    waypoints[-1] |= {"motion": {"kind": "linear"}}
    answer = service.post("/v1/trajectories", {"robot": added.json()["id"], "waypoints": waypoints}).json()
    assert "torque_with_tolerances" in [check["quantity"] for check in answer["certificate"]["checks"]]
    assert "following_error_not_covered" in [warning["code"] for warning in answer["warnings"]]
    wrong = body | {"limits": {"elbow_joint": {"friction_tolerance": 1.0}}}
    assert service.post("/v1/robots", wrong).json()["findings"][0]["code"] == "invalid_tolerance"


def test_a_payload_table_with_speeds_is_in_the_robot_and_in_its_plans(service: RunningService) -> None:
    rows = [[1.0, 0.8, 0.4], [0.9, 0.6, 0.3]]
    table = {
        "masses": [1.0, 5.0],
        "acceleration": [1.0, 0.6],
        "speeds": [0.2, 0.6, 1.0],
        "acceleration_at_speeds": rows,
    }
    body = {"kind": "derived", "id": "gentle", "from": "ur5e", "payload_table": table}
    added = service.post("/v1/robots", body)
    assert added.status_code == 201, added.text
    assert added.json()["payload_table"] == table | {"jerk": None}
    waypoints = [{"kind": "joint", "position": [x, -1.2, 1.4, -0.4, 1.0, 0.0]} for x in (0.0, 1.5)]
    answer = service.post("/v1/trajectories", {"robot": added.json()["id"], "waypoints": waypoints}).json()
    (check,) = (each for each in answer["certificate"]["checks"] if each["quantity"] == "acceleration_at_speed")
    assert check["method"] == "bounded"
    assert check["relaxed_by"] == ["robot.payload_table"]
    wrong = body | {"payload_table": table | {"acceleration_at_speeds": rows[:1] * 2 + rows[:1]}}
    assert service.post("/v1/robots", wrong).status_code == 422


def test_a_process_force_is_in_a_named_frame(service: RunningService) -> None:
    """A frame turned by a right angle about z: its x axis is the base's y axis."""
    turn = {"position": [0.0, 0.0, 0.0], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, np.pi / 2.0]}}
    ends = [
        {"kind": "joint", "position": q} for q in ([0.0, -1.4, 1.5, 0.0, 0.6, 0.0], [0.4, -1.2, 1.4, 0.0, 0.6, 0.0])
    ]
    found = []
    for force, frame in (([50.0, 0.0, 0.0], "table"), ([0.0, 50.0, 0.0], "base")):
        last = ends[1] | {"process_force": {"force": force, "frame": frame}}
        request = {"robot": "kuka_kr16_l6_2", "waypoints": [ends[0], last], "frames": {"table": turn}}
        answer = service.post("/v1/trajectories", request | {"include": ["torque"]}).json()
        found.append(answer["samples"]["torque"])
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)
    assert np.abs(found[0]).max() > 10.0


def test_backends_say_what_they_guarantee(service: RunningService) -> None:
    listed = checked(service.client.get("/v1/backends"), service_answers.BackendsAnswer)["backends"]
    kinds = {backend["kind"]: backend for backend in listed}
    assert {"cubic", "quintic", "trapezoidal"} <= set(kinds)
    assert kinds["cubic"]["guarantees"]["velocity"] == "hard"
    assert kinds["cubic"]["guarantees"]["jerk"] == "reported"
    assert kinds["quintic"]["guarantees"]["jerk"] == "hard"
    assert set(kinds["trapezoidal"]["options"]) == {"acceleration_time", "deceleration_time"}
    assert kinds["cubic"]["options"] == {}


def test_catalogue_robots(service: RunningService) -> None:
    listed = checked(service.client.get("/v1/robots"), robots.RobotsAnswer)["robots"]
    ids = [robot["id"] for robot in listed]
    assert {ARM, "three_dof_arm", "kuka_kr16_2", "welding_arm", "date_sorting_arm"} <= set(ids)
    in_order = sorted(catalogue_ids())
    assert ids[: len(in_order)] == in_order  # those that other tests have added come behind
    for robot in listed[: len(in_order)]:
        one = checked(service.client.get(f"/v1/robots/{robot['id']}"), robots.RobotDescription)
        assert {name: one[name] for name in robot} == robot
        assert len(robot["joints"]) == robot["dof"] == len(robot["joint_names"])


def test_a_dh_robot_comes_and_goes(service: RunningService) -> None:
    added = service.post("/v1/robots", dh_robot())
    robot = checked(added, robots.AddedRobot, 201)
    assert added.headers["Location"] == "/v1/robots/planar_arm"
    assert "planar_arm" in [robot["id"] for robot in service.client.get("/v1/robots").json()["robots"]]
    described = checked(service.client.get(added.headers["Location"]), robots.RobotDescription)
    assert robot == described | {"findings": robot["findings"]}

    # The plane two-link arm: x = 0.4 cos q1 + 0.3 cos (q1 + q2), y likewise.
    q1, q2 = 0.3, 0.7
    answer = service.post("/v1/kinematics/forward", {"robot": "planar_arm", "positions": [[q1, q2]]})
    x = 0.4 * math.cos(q1) + 0.3 * math.cos(q1 + q2)
    y = 0.4 * math.sin(q1) + 0.3 * math.sin(q1 + q2)
    np.testing.assert_allclose(answer.json()["poses"][0]["position"], [x, y, 0.0], atol=1e-12)
    assert "links" not in answer.json()
    request = {"robot": "planar_arm", "positions": [[q1, q2], [0.0, 0.0]], "include": ["links"]}
    with_links = checked(service.post("/v1/kinematics/forward", request), kinematics.ForwardKinematicsAnswer)
    for links, (first, second) in zip(with_links["links"], request["positions"], strict=True):
        elbow = next(link for link in links if link["link"] == "link_1")
        np.testing.assert_allclose(elbow["position"], [0.4 * math.cos(first), 0.4 * math.sin(first), 0.0], atol=1e-12)
        turned = [0.0, 0.0, math.sin((first + second) / 2), math.cos((first + second) / 2)]
        np.testing.assert_allclose(links[-1]["orientation"]["xyzw"], turned, atol=1e-12)

    assert service.post("/v1/robots", dh_robot()).status_code == 200  # the same again
    other = service.post("/v1/robots", dh_robot(joints=[dh_joint()]))
    assert (other.status_code, other.json()["code"]) == (409, "robot_exists")

    assert service.client.delete("/v1/robots/planar_arm").status_code == 204
    assert service.client.get("/v1/robots/planar_arm").status_code == 404
    gone = service.post("/v1/kinematics/forward", {"robot": "planar_arm", "positions": [[q1, q2]]})
    assert (gone.status_code, gone.json()["code"]) == (404, "unknown_robot")


def test_a_deleted_id_can_be_used_for_another_robot(service: RunningService) -> None:
    for length in (0.5, 0.8):
        service.post("/v1/robots", dh_robot(id="reused", joints=[dh_joint(a=length)]))
        answer = service.post("/v1/kinematics/forward", {"robot": "reused", "positions": [[0.0]]})
        np.testing.assert_allclose(answer.json()["poses"][0]["position"], [length, 0.0, 0.0], atol=1e-12)
        service.client.delete("/v1/robots/reused")


def test_a_dh_robot_without_an_id_is_named_after_its_content(service: RunningService) -> None:
    request = dh_robot()
    del request["id"]
    first, again = service.post("/v1/robots", request), service.post("/v1/robots", request)
    assert (first.status_code, again.status_code) == (201, 200)
    assert first.json()["id"] == again.json()["id"]
    service.client.delete(first.headers["Location"])


def test_a_urdf_robot_is_added_and_planned_with(service: RunningService) -> None:
    checked(service.post("/v1/robots", urdf_robot(urdf_chain(3), id="three_links")), robots.AddedRobot, 201)
    plan = service.post("/v1/trajectories", plan_request(robot="three_links"))
    assert checked(plan, answers.PlanAnswer)["robot"] == "three_links"
    assert service.client.delete("/v1/robots/three_links").status_code == 204


def test_health_and_limits(service: RunningService) -> None:
    assert checked(service.client.get("/livez"), service_answers.Liveness) == {"status": "alive"}
    ready = checked(service.client.get("/readyz"), service_answers.Readiness)
    assert (ready["status"], ready["workers"]) == ("ready", 2)
    limits = checked(service.client.get("/v1/limits"), service_answers.ServiceLimits)
    assert limits["workers"] == 2


def test_the_documentation_needs_no_other_host(service: RunningService) -> None:
    page = service.client.get("/docs")
    assert page.status_code == 200
    assert "//" not in page.text.replace("://www.w3.org", "").replace("// ", "")
    for name in ("swagger-ui-bundle.js", "swagger-ui.css", "favicon-32x32.png"):
        assert f"docs/{name}" in page.text
        assert len(service.client.get(f"/docs/{name}").content) > 100


def test_timings_and_request_id_are_in_the_headers(service: RunningService) -> None:
    headers = {"X-Request-ID": "trace-42", "Cache-Control": "no-cache"}
    answer = service.post("/v1/trajectories", plan_request(), headers=headers)
    assert answer.headers["X-Request-ID"] == "trace-42"
    entries = dict(entry.split(";dur=") for entry in answer.headers["Server-Timing"].split(", "))
    assert list(entries) == ["queue", "validate", "plan", "serialise", "total"]
    stages = {name: float(milliseconds) for name, milliseconds in entries.items()}
    total = stages.pop("total")
    assert 0.0 < sum(stages.values()) < total

    insane = service.client.get("/livez", headers={"X-Request-ID": "a b;c"})
    assert insane.headers["X-Request-ID"] != "a b;c"

    line = service.line_of("trace-42")
    assert (line["method"], line["path"], line["status"]) == ("POST", "/v1/trajectories", 200)
    assert line["bytes"] == int(answer.headers["Content-Length"])


@pytest.mark.parametrize(
    "path", ["/v1/robots", "/v1/robots/three_dof_arm", "/v1/backends", "/v1/limits", "/livez", "/readyz"]
)
def test_head_is_get_without_the_body(service: RunningService, path: str) -> None:
    full, head = service.client.get(path), service.client.head(path)
    assert (head.status_code, head.content) == (full.status_code, b"")
    for name in ("Content-Type", "Content-Length"):
        assert head.headers[name] == full.headers[name]


def test_a_deadline_that_passed_says_what_to_do(service: RunningService) -> None:
    answer = service.post("/v1/trajectories", plan_request(deadline=1e-9))
    assert answer.status_code == 504
    for hint in ("Raise `deadline`", "at most 60 s", "fewer waypoints", "another back end"):
        assert hint in answer.json()["detail"]


@pytest.mark.parametrize("frame", ["base", "tool"])
@pytest.mark.parametrize("orientation", [None, {"kind": "rpy", "rpy": [0.0, 0.0, 1.0]}])
def test_a_move_from_a_position_alone_leaves_the_orientation_open(
    service: RunningService, frame: str, orientation: Any
) -> None:
    """Defect 12 of issue 11. A move that turns the tool has an orientation: the one reached before, turned."""
    move = {"kind": "cartesian", "translation": [0.03, -0.02, 0.05], "orientation": orientation}
    waypoints = [
        joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1),
        pose_waypoint([1.1, -0.2, 1.2]),
        relative_waypoint(move, frame=frame),
    ]
    request = {"robot": "kuka_kr16_l6_2", "waypoints": waypoints, "backend": {"kind": "quintic"}}
    _, before, after = checked(service.post("/v1/trajectories", request), answers.PlanAnswer)["waypoints"]
    assert before["orientation_error"] is None
    if orientation is None:
        assert after["orientation_error"] is None, "no orientation was requested"
    else:
        assert after["orientation_error"] < 2e-6
    shift = np.array([0.03, -0.02, 0.05])
    if frame == "tool":
        shift = rotation_from_quaternion(np.array(before["pose"]["orientation"]["xyzw"])) @ shift
    reached = np.array(after["pose"]["position"]) - np.array(before["pose"]["position"])
    np.testing.assert_allclose(reached, shift, rtol=0.0, atol=3e-6)
