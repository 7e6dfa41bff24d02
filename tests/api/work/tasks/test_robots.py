"""Added robots: kept by content, named by id, and harmless however strange."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import pytest

from api.base.pages import PAGE_BYTES, first_page
from api.contract.robots import AddedRobot, RobotDescription, RobotsAnswer, RobotSummary
from api.store.contents.robots import RobotContent
from planner.proofs import check_proof
from planner.robots import load_robot
from tests.api.refusals.odd_robots import ODD_ROBOTS, Odd
from tests.api.requests import dh_joint, dh_robot, joint, plan_request, urdf_chain, urdf_robot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

FORWARD, INVERSE, PLAN, ROBOTS = "/v1/kinematics/forward", "/v1/kinematics/inverse", "/v1/trajectories", "/v1/robots"


def test_the_names_of_odd_robots_are_unique() -> None:
    assert len({odd.name for odd in ODD_ROBOTS}) == len(ODD_ROBOTS)


@pytest.mark.long_table
@pytest.mark.parametrize("odd", ODD_ROBOTS, ids=lambda odd: odd.name)
def test_an_odd_robot_is_accepted_with_a_remark_and_does_no_harm(service: RunningService, odd: Odd) -> None:
    before = {worker.pid for worker in service.workers()}
    added = service.post(ROBOTS, odd.body)
    assert added.status_code == 201, added.text
    robot = AddedRobot.model_validate_json(added.content, strict=True)
    assert odd.finding in {finding.code for finding in robot.findings}
    described = service.client.get(f"{ROBOTS}/{robot.id}").json()
    assert added.json() == described | {"findings": added.json()["findings"]}

    bounds = [(0.0, 1.0) if j.lower is None or j.upper is None else (j.lower, j.upper) for j in robot.joints]
    here, there = ([lower + share * (upper - lower) for lower, upper in bounds] for share in (0.5, 0.25))
    used = service.post(FORWARD, {"robot": robot.id, "positions": [here]})
    assert used.status_code == 200
    pose = used.json()["poses"][0]
    steps = [
        (INVERSE, {"robot": robot.id, "poses": [pose], "solutions": "best"}),
        (PLAN, plan_request(robot=robot.id, waypoints=[joint(*here), joint(*there)], sample_period=1.0)),
        ("/v1/dynamics/inverse", {"robot": robot.id, "positions": [here]}),
    ]
    for path, body in steps:
        answer = service.post(path, body)
        assert answer.status_code in (200, 422), answer.text
    assert service.client.delete(f"{ROBOTS}/{robot.id}").status_code == 204
    assert {worker.pid for worker in service.workers()} == before
    assert service.logged(), "each line of the log is JSON: no worker has warned of its arithmetic"


def test_the_hash_of_a_request_covers_the_robot_that_has_the_id(service: RunningService) -> None:
    """Two robots under one id at different times; the second again with its table written in another notation."""
    backends = [{"kind": "cubic"}]
    hashes = []
    for table in ([dh_joint(a=0.5)], [dh_joint(a=0.8)], [dh_joint(a=8e-1, theta=0)]):
        assert service.post(ROBOTS, dh_robot(id="hashed", joints=table)).status_code == 201
        request = plan_request(robot="hashed", waypoints=[joint(0.0), joint(0.4)])
        planned = service.post(PLAN, request).json()["request_hash"]
        del request["backend"]
        compared = service.post(f"{PLAN}/compare", {**request, "backends": backends})
        assert compared.json()["results"][0]["trajectory"]["request_hash"] == planned
        hashes.append(planned)
        assert service.client.delete(f"{ROBOTS}/hashed").status_code == 204
    assert hashes[0] != hashes[1] == hashes[2]


def test_the_hash_of_a_request_for_a_catalogue_robot_covers_its_id(service: RunningService) -> None:
    points = [joint(0.1, -0.4, 0.2, 0.1, 0.3, 0.1), joint(0.2, -0.4, 0.2, 0.1, 0.3, 0.1)]
    robots = ("ngv_refuelling_arm", "welding_arm", "ngv_refuelling_arm")
    answers = [service.post(PLAN, plan_request(robot=robot, waypoints=points)) for robot in robots]
    first, other, again = (answer.json()["request_hash"] for answer in answers)
    assert first == again != other


def test_one_content_under_two_ids(service: RunningService) -> None:
    """Each answers under its own id, and one outlives the other."""
    for robot_id in ("first", "second"):
        assert service.post(ROBOTS, dh_robot(id=robot_id)).status_code == 201
    contents = {service.client.get(f"{ROBOTS}/{robot_id}").json()["content"] for robot_id in ("first", "second")}
    assert len(contents) == 1
    answers = {}
    for robot_id in ("first", "second"):
        answers[robot_id] = service.post(
            PLAN, plan_request(robot=robot_id, waypoints=[joint(0, 0), joint(1, 1)])
        ).json()
        assert answers[robot_id]["robot"] == robot_id
        refused = service.post(PLAN, plan_request(robot=robot_id))
        assert f"the 2 joints of {robot_id}" in refused.text
    assert answers["first"]["samples"] == answers["second"]["samples"]
    service.client.delete(f"{ROBOTS}/first")
    assert service.client.get(f"{ROBOTS}/first").status_code == 404
    assert service.client.get(f"{ROBOTS}/second").json()["id"] == "second"
    service.client.delete(f"{ROBOTS}/second")


def test_the_digest_is_of_the_content_alone(service: RunningService) -> None:
    def digest(body: dict[str, Any]) -> str:
        answer = service.post(ROBOTS, body)
        service.client.delete(answer.headers["Location"])
        content: str = AddedRobot.model_validate_json(answer.content).content or ""
        assert re.fullmatch("sha256:[0-9a-f]{64}", content)
        return content

    same = [
        dh_robot(),
        dh_robot(id="other"),
        dict(reversed(dh_robot().items())),
        dh_robot(base=None),
        dh_robot(joints=[dh_joint(theta=0), dh_joint(a=3e-1)]),
    ]
    assert len({digest(body) for body in same}) == 1
    others = [
        dh_robot(convention="modified"),
        dh_robot(joints=[dh_joint(), dh_joint(a=0.30000000000000004)]),
        dh_robot(joints=[dh_joint(name="turn"), dh_joint(a=0.3)]),
        urdf_robot(urdf_chain(2)),
        urdf_robot(urdf_chain(2), tip_frame="l1"),
        urdf_robot(urdf_chain(2), srdf="<robot/>"),
    ]
    assert len({digest(body) for body in (same[0], *others)}) == 1 + len(others)


def test_a_catalogue_robot_has_no_digest(service: RunningService) -> None:
    assert service.client.get(f"{ROBOTS}/three_dof_arm").json()["content"] is None


def test_groups_and_disabled_pairs_of_an_srdf_are_shown(service: RunningService) -> None:
    srdf = (
        '<robot name="r"><group name="arm"><chain base_link="l0" tip_link="l2"/></group>'
        '<group name="last"><joint name="j2"/></group>'
        '<disable_collisions link1="l0" link2="l1" reason="Adjacent"/></robot>'
    )
    added = service.post(ROBOTS, urdf_robot(urdf_chain(3), id="grouped", srdf=srdf))
    described = service.client.get(added.headers["Location"])
    robot = RobotDescription.model_validate_json(described.content, strict=True).model_dump()
    assert robot["groups"] == [
        {"name": "arm", "joints": ["j0", "j1"], "tip_frame": "l2"},
        {"name": "last", "joints": ["j2"], "tip_frame": None},
    ]
    assert robot["disabled_collisions"] == [{"link_1": "l0", "link_2": "l1", "reason": "Adjacent"}]
    assert (robot["tip_frame"], robot["joint_names"]) == ("l2", ["j0", "j1"])
    position = service.post(FORWARD, {"robot": "grouped", "positions": [[0.0, 0.0]]}).json()["poses"][0]["position"]
    np.testing.assert_allclose(position, [0.0, 0.0, 0.2], atol=1e-12)
    service.client.delete(f"{ROBOTS}/grouped")


def test_limits_of_urdf_1_2_and_soft_limits_hold(service: RunningService) -> None:
    """By 1 rad at 0.5 rad/s^2, never as fast as 1 rad/s: the fastest is 2 sqrt(1 / 0.5) s."""
    soft = '<safety_controller soft_lower_limit="-0.5" soft_upper_limit="0.75"/>'
    chain = urdf_chain(1).replace('effort="10"', 'effort="10" acceleration="0.5" deceleration="0.6" jerk="7"')
    urdf = chain.replace("</joint>", soft + "</joint>")
    added = AddedRobot.model_validate_json(service.post(ROBOTS, urdf_robot(urdf, id="extended")).content, strict=True)
    (turn,) = added.joints
    assert (turn.lower, turn.upper, turn.acceleration, turn.jerk) == (-0.5, 0.75, 0.5, 7.0)
    assert set(turn.provenance.values()) == {"published"}
    assert "soft_limits" in {finding.code for finding in added.findings}
    request = plan_request(robot="extended", waypoints=[joint(-0.5), joint(0.5)], backend={"kind": "trapezoidal"})
    assert service.post(PLAN, request).json()["duration"] == pytest.approx(2.0 * math.sqrt(1.0 / 0.5), rel=1e-4)
    outside = plan_request(robot="extended", waypoints=[joint(-0.5), joint(0.8)])
    assert service.post(PLAN, outside).json()["code"] == "joint_position_limit"
    service.client.delete(f"{ROBOTS}/extended")


def test_a_group_moves_and_its_state_is_a_waypoint(service: RunningService) -> None:
    """Three joints in a row, of which the last two are the group; the first is locked."""
    srdf = (
        '<robot name="r"><group name="arm"><joint name="j1"/><joint name="j2"/></group><group_state name="home" '
        'group="arm"><joint name="j1" value="0.5"/><joint name="j2" value="-0.5"/></group_state></robot>'
    )
    body = urdf_robot(urdf_chain(3), id="arm_of_two", srdf=srdf, group="arm", locked={"j0": math.pi / 4.0})
    robot = AddedRobot.model_validate_json(service.post(ROBOTS, body).content, strict=True)
    assert (robot.joint_names, robot.tip_frame) == (["j1", "j2"], "l3")
    assert robot.named_positions == {"home": [0.5, -0.5]}
    forward = service.post(FORWARD, {"robot": robot.id, "positions": [[0.0, 0.0]]}).json()["poses"][0]["position"]
    np.testing.assert_allclose(forward, [0.2 * math.sqrt(0.5), 0.0, 0.1 + 0.2 * math.sqrt(0.5)], atol=1e-12)
    home = {"kind": "named", "name": "home", "dwell": 0.5}
    plan = service.post(PLAN, plan_request(robot=robot.id, waypoints=[joint(0.0, 0.0), home, joint(0.0, 0.0)])).json()
    assert plan["waypoints"][1]["position"] == pytest.approx([0.5, -0.5], abs=1e-12)
    assert (plan["waypoints"][1]["name"], plan["waypoints"][1]["choice"]) == ("home", "given")
    reach = {"robot": robot.id, "waypoints": [home]}
    assert service.post("/v1/kinematics/reachability", reach).status_code == 200
    unknown = [joint(0.0, 0.0), {"kind": "named", "name": "rest"}]
    refused = service.post(PLAN, plan_request(robot=robot.id, waypoints=unknown)).json()
    assert [fault["pointer"] for fault in refused["errors"]] == ["/waypoints/1/name"]
    assert "it has home" in refused["detail"]
    service.client.delete(f"{ROBOTS}/{robot.id}")


def derived_robot(**changes: Any) -> dict[str, Any]:
    """Return the planar arm in a cell of its own."""
    return {"kind": "derived", "id": "in_cell", "from": "planar_arm", **changes}


def test_a_derived_robot_has_its_owners_limits_tool_and_mounting(service: RunningService) -> None:
    """Two links of 0.4 m and 0.3 m; the second joint is locked at a right angle, the base stands on a wall."""
    service.post(ROBOTS, dh_robot(joints=[dh_joint(mass=2.0), dh_joint(a=0.3)]))
    body = derived_robot(
        limits={
            "joint_1": {
                "lower": -1.0,
                "upper": 1.0,
                "velocity": 0.5,
                "acceleration": 20.0,
                "acceleration_range": [-10.0, 20.0],
            }
        },
        locked={"joint_2": math.pi / 2.0},
        tool={"position": [0.0, 0.0, 0.1], "orientation": None},
        mounting={"position": [0.0, 0.0, 1.0], "orientation": {"kind": "rpy", "rpy": [math.pi / 2.0, 0.0, 0.0]}},
        named_positions={"home": [0.25]},
    )
    added = service.post(ROBOTS, body)
    assert added.status_code == 201, added.text
    robot = AddedRobot.model_validate_json(added.content, strict=True)
    assert service.client.delete(f"{ROBOTS}/planar_arm").status_code == 204  # which changes nothing here
    assert {finding.code for finding in robot.findings} == {"limit_widened"}
    (only,) = robot.joints
    assert (only.lower, only.upper, only.velocity, only.acceleration) == (-1.0, 1.0, 0.5, 20.0)
    assert (only.acceleration_range, only.velocity_range) == ([-10.0, 20.0], None)
    assert only.provenance == {
        "position": "owner",
        "velocity": "owner",
        "acceleration": "owner",
        "jerk": "default",
    }
    assert robot.named_positions == {"home": [0.25]}
    assert robot.tool.position == pytest.approx([0.0, 0.0, 0.1])
    assert robot.mounting is not None
    assert robot.mounting.quaternion_xyzw == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
    forward = service.post(FORWARD, {"robot": "in_cell", "positions": [[0.0]]}).json()["poses"][0]["position"]
    np.testing.assert_allclose(forward, [0.4, 0.3, 0.1], atol=1e-12)
    hold = service.post("/v1/dynamics/inverse", {"robot": "in_cell", "positions": [[0.0]]}).json()["torques"]
    assert hold[0][0] == pytest.approx(2.0 * 9.81 * 0.4)  # its z axis is level: the mass of link 1 hangs at its end
    plan = plan_request(robot="in_cell", waypoints=[joint(-1.0), joint(1.0)], backend={"kind": "trapezoidal"})
    ramps = (0.5 / 20.0 + 0.5 / 10.0) / 2.0  # it gains speed faster than it brakes
    assert service.post(PLAN, plan).json()["duration"] == pytest.approx(2.0 / 0.5 + ramps, rel=1e-4)
    service.client.delete(f"{ROBOTS}/in_cell")


CURVES = {
    "upper": [{"kind": "parabola", "rate": 8.0, "end": 2.5, "offset": 0.2}],
    "lower": [{"kind": "table", "positions": [-1.0, 1.0], "velocities": [0.5, 1.0]}],
}


def test_velocity_curves_of_all_kinds_of_robots_are_kept_and_certified(service: RunningService) -> None:
    limits = {"lower": -3.0, "upper": 3.0, "velocity": 3.0}
    table = dh_robot(id="curved", joints=[dh_joint(**limits, velocity_curves=CURVES), dh_joint(a=0.3, **limits)])
    derived = derived_robot(id="curved_too", limits={"joint_2": {"velocity_curves": CURVES}}) | {"from": "curved"}
    nearer = CURVES | {"upper": [CURVES["upper"][0] | {"end": 0.9}]}
    urdf = urdf_robot(urdf_chain(1), id="curved_urdf", velocity_curves={"j0": nearer})
    shown = []
    for body in (table, derived, urdf):
        added = service.post(ROBOTS, body)
        assert added.status_code == 201, added.text
        assert "position_limits_narrowed" in {finding["code"] for finding in added.json()["findings"]}
        shown.append(service.client.get(f"{ROBOTS}/{body['id']}").json()["joints"])
    assert [[each.get("velocity_curves") for each in joints] for joints in shown[:2]] == [[CURVES, None], [CURVES] * 2]
    assert shown[2][0]["velocity_curves"] == nearer
    assert shown[0][0]["upper"] == pytest.approx(2.5 - 0.26**2 / 8.0)
    planned = service.post(PLAN, plan_request(robot="curved_too", waypoints=[joint(-1.0, 0.0), joint(2.4, 0.5)]))
    assert planned.status_code == 200, planned.text
    for body in (urdf, derived, table):
        service.client.delete(f"{ROBOTS}/{body['id']}")
    (check,) = (c for c in planned.json()["certificate"]["checks"] if c["quantity"] == "velocity_at_position")
    assert check["joint"] == "joint_1" and check["method"] == "exact" and 0.9 < check["ratio"] <= 1.000001


def test_torque_curves_of_all_kinds_of_robots_are_kept_and_certified(service: RunningService) -> None:
    curve = {"speeds": [0.2, 1.0, 2.0], "torques": [30.0, 12.0, 9.0]}
    lower = {"speeds": [0.0, 3.0], "torques": [12.0, 8.0]}
    limits = {"lower": -3.0, "upper": 3.0, "velocity": 3.0, "mass": 2.0, "center_of_mass": [-0.2, 0.0, 0.0]}
    table = dh_robot(id="weak", joints=[dh_joint(**limits, torque_curve=curve), dh_joint(a=0.3, **limits)])
    derived = derived_robot(id="weak_too", limits={"joint_2": {"torque_curve": lower}}) | {"from": "weak"}
    urdf = urdf_robot(urdf_chain(1), id="weak_urdf", torque_curves={"j0": curve})
    shown = []
    for body in (table, derived, urdf):
        added = service.post(ROBOTS, body)
        assert added.status_code == 201, added.text
        shown.append(service.client.get(f"{ROBOTS}/{body['id']}").json()["joints"])
    assert [[each.get("torque_curve") for each in joints] for joints in shown[:2]] == [[curve, None], [curve, lower]]
    assert shown[2][0]["torque_curve"] == curve and shown[0][0]["torque"] == 30.0
    planned = service.post(PLAN, plan_request(robot="weak_too", waypoints=[joint(-1.0, 0.0), joint(2.4, 0.5)]))
    assert planned.status_code == 200, planned.text
    for body in (urdf, derived, table):
        service.client.delete(f"{ROBOTS}/{body['id']}")
    (check,) = (c for c in planned.json()["certificate"]["checks"] if c["quantity"] == "torque_at_speed")
    assert check["method"] == "bounded" and check["ratio"] <= 1.000001


def test_payload_tables_of_all_kinds_of_robots_slow_what_is_heavy(service: RunningService) -> None:
    table = {"masses": [1.0, 2.0], "acceleration": [1.0, 0.5], "jerk": [1.0, 0.25]}
    lower = {"masses": [0.0, 2.0], "acceleration": [0.5, 0.25], "jerk": [0.25, 0.1]}
    limits = {"lower": -3.0, "upper": 3.0, "velocity": 3.0}
    rows = dh_robot(id="heavy", joints=[dh_joint(**limits), dh_joint(a=0.3, **limits)], payload_table=table)
    derived = derived_robot(id="heavy_too", payload_table=lower) | {"from": "heavy"}
    urdf = urdf_robot(urdf_chain(2), id="heavy_urdf", payload_table=table)
    for body, expected in ((rows, table), (derived, lower), (urdf, table)):
        added = service.post(ROBOTS, body)
        assert added.status_code == 201, added.text
        assert service.client.get(f"{ROBOTS}/{body['id']}").json()["payload_table"] == expected
    durations = []
    for robot in ("heavy", "heavy_too"):
        request = plan_request(robot=robot, waypoints=[joint(-1.0, 0.0), joint(2.4, 0.5)], payload={"mass": 2.0})
        planned = service.post(PLAN, request | {"backend": {"kind": "ruckig"}})
        assert planned.status_code == 200, planned.text
        durations.append(planned.json()["duration"])
    for body in (urdf, derived, rows):
        service.client.delete(f"{ROBOTS}/{body['id']}")
    assert durations[1] > 1.1 * durations[0]


def test_an_arm_on_a_rail_is_a_robot_like_any_other(service: RunningService) -> None:
    """Two links of 0.4 m and 0.3 m on a rail of 3 m: a line of 2 m, which the arm cannot do alone."""
    service.post(ROBOTS, dh_robot(joints=[dh_joint(mass=2.0), dh_joint(a=0.3)]))
    rail = {"name": "rail", "kind": "prismatic", "axis": [2.0, 0.0, 0.0], "lower": 0.0, "upper": 3.0, "mass": 5.0}
    body = derived_robot(external_axes=[rail], arm_origin={"position": [0.0, 0.0, 0.5]})
    added = service.post(ROBOTS, body)
    assert added.status_code == 201, added.text
    robot = AddedRobot.model_validate_json(added.content, strict=True)
    assert robot.external_axes == ["rail"]
    assert (robot.joints[0].name, robot.joints[0].kind, robot.joints[0].upper) == ("rail", "prismatic", 3.0)
    forward = service.post(FORWARD, {"robot": "in_cell", "positions": [[1.0, 0.0, 0.0]]}).json()["poses"][0]["position"]
    np.testing.assert_allclose(forward, [1.7, 0.0, 0.5], atol=1e-12)
    pushed = {"robot": "in_cell", "positions": [[1.0, 0.0, 0.0]], "accelerations": [[2.0, 0.0, 0.0]]}
    torques = service.post("/v1/dynamics/inverse", pushed).json()["torques"]
    assert torques[0][0] == pytest.approx((2.0 + 5.0) * 2.0)
    line = {"kind": "relative", "frame": "base", "move": {"kind": "cartesian", "translation": [2.0, 0.0, 0.0]}}
    asked = [joint(0.2, 0.5, -1.0), {**line, "motion": {"kind": "linear"}}]
    planned = service.post(PLAN, plan_request(robot="in_cell", waypoints=asked, include=["tcp_pose"]))
    assert planned.status_code == 200, planned.text
    assert planned.json()["certificate"]["satisfied"]
    reached = planned.json()["waypoints"][1]
    assert reached["position_error"] < 1e-6
    assert reached["position"][0] > 1.0
    pinned = {"kind": "pose", "pose": {"position": [1.2, 0.3, 0.5]}, "external": {"rail": 0.9}}
    to_pin = plan_request(robot="in_cell", waypoints=[joint(0.2, 0.5, -1.0), pinned], ik={"prefer": "arm"})
    assert service.post(PLAN, to_pin).json()["waypoints"][1]["position"][0] == pytest.approx(0.9, abs=1e-9)
    to_pin["waypoints"][1]["external"] = {"lift": 0.1}
    refused = service.post(PLAN, to_pin)
    assert [fault["pointer"] for fault in refused.json()["errors"]] == ["/waypoints/1/external/lift"]
    to_pin["waypoints"][1]["external"] = {"rail": 2.5}
    remedies = service.post(PLAN, to_pin).json()["remedies"]
    assert {"change": "/waypoints/1/external", "value": None}.items() <= remedies[-1].items()
    shapes = service.client.get(f"{ROBOTS}/in_cell/geometry").json()["shapes"]
    assert min(shape["after"] for shape in shapes) >= 1
    refused = service.post(ROBOTS, derived_robot(id="other", external_axes=[{**rail, "axis": [0.0, 0.0, 0.0]}]))
    assert (refused.status_code, refused.json()["code"]) == (422, "invalid_robot_model")
    service.client.delete(f"{ROBOTS}/in_cell")
    service.client.delete(f"{ROBOTS}/planar_arm")


def test_a_workpiece_under_a_fixed_tool_is_the_base_frame(service: RunningService) -> None:
    """Two links of 0.4 m and 0.3 m hold a part whose frame is the tip's, 0.2 m from a nozzle when they are straight."""
    service.post(ROBOTS, dh_robot(joints=[dh_joint(mass=2.0), dh_joint(a=0.3)]))
    body = derived_robot(id="under_a_nozzle", fixed_tool={"position": [0.9, 0.0, 0.0]})
    added = service.post(ROBOTS, body)
    assert added.status_code == 201, added.text
    robot = AddedRobot.model_validate_json(added.content, strict=True)
    assert (robot.positioner, robot.external_axes, robot.tip_frame) == (robot.joint_names, [], "positioner_base")
    assert robot.joint_names == ["joint_2", "joint_1"]
    forward = service.post(FORWARD, {"robot": "under_a_nozzle", "positions": [[0.0, 0.0], [np.pi / 2.0, 0.0]]})
    found = [pose["position"] for pose in forward.json()["poses"]]
    np.testing.assert_allclose(found, [[0.2, 0.0, 0.0], [-0.3, -0.5, 0.0]], atol=1e-12)
    line = {"kind": "relative", "frame": "base", "move": {"kind": "cartesian", "translation": [0.0, 0.1, 0.0]}}
    asked = [joint(-1.0, 0.5), {**line, "motion": {"kind": "linear"}}]
    planned = service.post(PLAN, plan_request(robot="under_a_nozzle", waypoints=asked, include=["tcp_pose"]))
    assert planned.status_code == 200, planned.text
    poses = np.array(planned.json()["samples"]["tcp_pose"]["position"])
    np.testing.assert_allclose(poses[:, 0], poses[0, 0], atol=1e-4)
    refused = service.post(ROBOTS, body | {"tool": {"position": [0.1, 0.0, 0.0]}})
    assert "tool_with_fixed_tool" in refused.text
    assert refused.status_code == 422


def test_a_workpiece_on_a_positioner_is_the_base_frame(service: RunningService) -> None:
    """Two links of 0.4 m and 0.3 m beside a turntable: poses are in its moving frame, and others are refused."""
    service.post(ROBOTS, dh_robot(joints=[dh_joint(mass=2.0), dh_joint(a=0.3)]))
    table = {"name": "table", "kind": "revolute", "axis": [0.0, 0.0, 2.0], "lower": -3.0, "upper": 3.0}
    table |= {"origin": {"position": [0.5, 0.0, 0.0]}, "mass": 5.0, "inertia": [0.1, 0.0, 0.0, 0.1, 0.0, 0.4]}
    body = derived_robot(positioner=[table], workpiece={"position": [0.0, 0.0, 0.1]})
    added = service.post(ROBOTS, body)
    assert added.status_code == 201, added.text
    robot = AddedRobot.model_validate_json(added.content, strict=True)
    assert robot.positioner == robot.external_axes == ["table"]
    forward = service.post(FORWARD, {"robot": "in_cell", "positions": [[0.0, 0.0, 0.0], [np.pi / 2.0, 0.0, 0.0]]})
    found = [pose["position"] for pose in forward.json()["poses"]]
    np.testing.assert_allclose(found, [[0.2, 0.0, -0.1], [0.0, -0.2, -0.1]], atol=1e-12)
    turned = {"robot": "in_cell", "positions": [[1.0, 0.0, 0.0]], "accelerations": [[2.0, 0.0, 0.0]]}
    assert service.post("/v1/dynamics/inverse", turned).json()["torques"][0][0] == pytest.approx(0.8)
    line = {"kind": "relative", "frame": "base", "move": {"kind": "cartesian", "translation": [0.0, 0.2, 0.0]}}
    asked = [joint(0.0, 0.5, -1.0), {**line, "motion": {"kind": "linear"}}]
    planned = service.post(PLAN, plan_request(robot="in_cell", waypoints=asked, include=["tcp_pose"]))
    assert planned.status_code == 200, planned.text
    assert planned.json()["certificate"]["satisfied"]
    poses = np.array(planned.json()["samples"]["tcp_pose"]["position"])
    np.testing.assert_allclose(poses[:, [0, 2]], poses[:1, [0, 2]].repeat(len(poses), axis=0), atol=1e-4)
    in_world = {"kind": "pose", "frame": "world", "pose": {"position": [0.4, 0.3, 0.0]}}
    ball = {"id": "ball", "shape": {"kind": "sphere", "radius": 0.1}, "frame": "base"}
    for changes, pointer in (
        ({"waypoints": [joint(0.0, 0.5, -1.0), in_world]}, "/waypoints/1/frame"),
        ({"scene": {"objects": [ball]}}, "/scene/objects/0/frame"),
    ):
        refused = service.post(PLAN, plan_request(robot="in_cell", waypoints=asked) | changes)
        assert refused.status_code == 422, refused.text
        assert [fault["pointer"] for fault in refused.json()["errors"]] == [pointer]
    proved = service.post(PLAN, plan_request(robot="in_cell", waypoints=asked, include=["proof"]))
    assert {"continuity", "waypoints", "velocity"} <= set(check_proof(proved.json()["proof"]))
    for robot_id in ("in_cell", "planar_arm"):
        service.client.delete(f"{ROBOTS}/{robot_id}")


def test_the_digest_of_a_derived_robot_is_of_all_that_it_is_made_of(service: RunningService) -> None:
    """Not of the name of an added robot, but of its content; of a catalogue robot, of its id."""

    def digest(**changes: Any) -> str:
        answer = service.post(ROBOTS, derived_robot(**changes))
        assert answer.status_code == 201, answer.text
        service.client.delete(answer.headers["Location"])
        found: str = answer.json()["content"]
        return found

    for robot_id, length in (("planar_arm", 0.3), ("same", 0.3), ("other", 0.5)):
        service.post(ROBOTS, dh_robot(id=robot_id, joints=[dh_joint(), dh_joint(a=length)]))
    assert digest() == digest(**{"from": "same"}) == digest(id="b", limits={}, mounting=None)
    different = [digest(), digest(**{"from": "other"}), digest(locked={"joint_1": 0.0})]
    different += [digest(**{"from": robot_id}) for robot_id in ("kuka_kr16_2", "kuka_kr16_l6_2")]
    assert len(set(different)) == len(different)
    for robot_id in ("planar_arm", "same", "other"):
        service.client.delete(f"{ROBOTS}/{robot_id}")


def test_a_robot_is_derived_only_so_many_times_over(service: RunningService) -> None:
    names = ["three_dof_arm", *(f"derived_{k}" for k in range(9))]
    for base, robot_id in itertools.pairwise(names):
        answer = service.post(ROBOTS, derived_robot(**{"from": base, "id": robot_id}))
        if robot_id == names[-1]:
            assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, "/from")
        else:
            assert answer.status_code == 201, answer.text
    for robot_id in names[1:-1]:
        service.client.delete(f"{ROBOTS}/{robot_id}")


@pytest.fixture(scope="module")
def other_client(service: RunningService) -> Iterator[httpx.Client]:
    transport = httpx.HTTPTransport(local_address="127.0.0.2")
    with httpx.Client(base_url=service.url, transport=transport, trust_env=False) as client:
        yield client


def test_robots_of_other_clients_can_be_used_but_not_deleted(
    service: RunningService, other_client: httpx.Client
) -> None:
    service.post(ROBOTS, dh_robot(id="mine"))
    assert other_client.post(FORWARD, json={"robot": "mine", "positions": [[0.0, 0.0]]}).status_code == 200
    refused = other_client.delete(f"{ROBOTS}/mine")
    assert (refused.status_code, refused.json()["code"]) == (403, "robot_of_another")
    assert service.client.delete(f"{ROBOTS}/mine").status_code == 204


def test_robots_are_listed_in_pages(service: RunningService) -> None:
    for robot_id in ("page_1", "page_2"):
        service.post(ROBOTS, dh_robot(id=robot_id))
    everything = service.client.get(ROBOTS).json()
    assert everything["next_cursor"] is None
    listed, cursor = [], ""
    while cursor is not None:
        answer = service.client.get(ROBOTS, params={"limit": 4, **({"cursor": cursor} if cursor else {})})
        page = RobotsAnswer.model_validate_json(answer.content, strict=True)
        assert 0 < len(page.robots) <= 4
        listed += [robot.id for robot in page.robots]
        cursor = page.next_cursor
        service.client.delete(f"{ROBOTS}/page_1")  # a robot that goes away between two pages
    ids = [robot["id"] for robot in everything["robots"]]
    assert listed == [robot_id for robot_id in ids if robot_id != "page_1"]
    service.client.delete(f"{ROBOTS}/page_2")


@pytest.mark.parametrize("limit", ["0", "-1", "1001", "x", "", "9" * 5000, "\u0661"])
def test_pages_of_no_sensible_size_are_refused(service: RunningService, limit: str) -> None:
    answer = service.client.get(ROBOTS, params={"limit": limit})
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")


def test_a_page_ends_before_it_has_too_many_bytes() -> None:
    """300 robots with an SRDF of 1 MB each made a list that killed a worker."""
    half = b"x" * (PAGE_BYTES // 2)
    entries = [(str(i), half) for i in range(5)]
    assert first_page(entries, 10) == (entries[:2], True)
    assert first_page(entries[:2], 10) == (entries[:2], False)
    assert first_page(entries, 1) == (entries[:1], True)
    assert first_page([("0", 5 * half)], 10) == ([("0", 5 * half)], False)
    assert first_page([], 10) == ([], False)


def test_the_list_does_not_have_the_pairs_of_an_srdf(service: RunningService) -> None:
    pairs = "".join(f'<disable_collisions link1="l{i % 30}" link2="l{i // 30}"/>' for i in range(900))
    request = urdf_robot(urdf_chain(30), id="many_pairs", srdf=f'<robot name="r">{pairs}</robot>')
    added = service.post(ROBOTS, request)
    assert len(added.json()["disabled_collisions"]) > 400
    listed = service.client.get(ROBOTS)
    [summary] = [robot for robot in listed.json()["robots"] if robot["id"] == "many_pairs"]
    assert summary == {name: added.json()[name] for name in RobotSummary.model_fields}
    service.client.delete(f"{ROBOTS}/many_pairs")


def test_an_id_is_written_into_the_description_as_json() -> None:
    assert RobotContent("x", b"", b'{"dof":1}', b"").described_as('quo"te') == b'{"id":"quo\\"te","dof":1}'


def test_notes_of_the_catalogue_are_in_the_list_and_in_the_robot(service: RunningService) -> None:
    listed = {robot["id"]: robot for robot in service.client.get("/v1/robots").json()["robots"]}
    one = service.client.get("/v1/robots/three_dof_arm").json()
    assert listed["three_dof_arm"]["notes"] == one["notes"] == list(load_robot("three_dof_arm").notes)
    assert any("points downwards" in note for note in one["notes"])


def test_the_rated_payload_of_a_robot_is_told(service: RunningService) -> None:
    robots = {robot: service.client.get(f"/v1/robots/{robot}").json() for robot in ("kuka_kr16_l6_2", "welding_arm")}
    assert robots["kuka_kr16_l6_2"]["rated_payload"] == 6.0
    assert "KUKA" in robots["kuka_kr16_l6_2"]["rated_payload_source"]
    assert robots["welding_arm"]["rated_payload"] is robots["welding_arm"]["rated_payload_source"] is None


def test_a_derived_robot_has_the_rated_payload_of_its_base(service: RunningService) -> None:
    added = service.post(ROBOTS, {"kind": "derived", "id": "my_kuka", "from": "kuka_kr16_l6_2"}).json()
    assert added["rated_payload"] == service.client.get(f"{ROBOTS}/my_kuka").json()["rated_payload"] == 6.0
    waypoints = [joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1), joint(0.4, -1.1, 1.3, 0.2, 0.6, 0.1)]
    asked = {"robot": "my_kuka", "waypoints": waypoints, "payload": {"mass": 50.0}}
    (compared,) = service.post(f"{PLAN}/compare", asked | {"backends": [{"kind": "quintic"}]}).json()["results"]
    for problem in service.post(PLAN, plan_request(**asked)).json(), compared["problem"]:
        assert problem["code"] == "payload_exceeded"
        assert problem["detail"].startswith("the payload of 50 kg exceeds the rated 6 kg of my_kuka")
        (remedy,) = problem["remedies"]
        assert (remedy["change"], remedy["value"]) == ("/payload/mass", 6.0)
    service.client.delete(f"{ROBOTS}/my_kuka")


def test_a_positioner_welds_flat_on_request(service: RunningService) -> None:
    """The workpiece turns by Ry(tilt) Rz(turn) in the world, where the torch comes from above."""
    axes = [
        {"name": "tilt", "axis": [0.0, 1.0, 0.0], "origin": {"position": [1.1, 0.0, 0.4]}, "lower": -1.6, "upper": 1.6},
        {"name": "turn", "axis": [0.0, 0.0, 1.0], "origin": {"position": [0.0, 0.0, 0.15]}, "lower": -9, "upper": 9},
    ]
    body = {"kind": "derived", "id": "flat_cell", "from": "kuka_kr16_2", "tool": {"position": [0.1, 0.0, 0.3]}}
    body |= {"positioner": [{"kind": "revolute", "velocity": 1.0, "mass": 50.0, **axis} for axis in axes]}
    assert service.post(ROBOTS, body).status_code == 201
    leaning = [
        {"position": [0.0, y, 0.1], "orientation": {"kind": "rpy", "rpy": [math.pi - 0.5, 0.0, 0.0]}}
        for y in (0.0, 0.1)
    ]
    asked = [joint(0.0, 0.0, 0.0, -1.5, 1.5, 0.0, 0.5, 0.0), {"kind": "pose", "pose": leaning[0]}]
    asked.append({"kind": "pose", "pose": leaning[1], "motion": {"kind": "linear"}})
    request = plan_request(robot="flat_cell", waypoints=asked, ik={"prefer": "weld_flat"})
    planned = service.post(PLAN, request)
    assert planned.status_code == 200, planned.text
    samples = planned.json()["samples"]
    on_line = np.array(samples["position"])[np.array(samples["segment"]) == 1]
    normal = np.array([0.0, math.sin(0.5), math.cos(0.5)])
    for turn, tilt in on_line[:, :2]:
        x = math.cos(turn) * normal[0] - math.sin(turn) * normal[1]
        assert -math.sin(tilt) * x + math.cos(tilt) * normal[2] >= math.cos(0.01)
    refused = service.post(PLAN, plan_request(ik={"prefer": "weld_flat"}))
    assert refused.status_code == 422
    assert [fault["pointer"] for fault in refused.json()["errors"]] == ["/ik/prefer"]
    assert "positioner" in refused.json()["errors"][0]["message"]
    service.client.delete(f"{ROBOTS}/flat_cell")
