"""The part of the table of bad requests that is about Jacobians, workspaces and torques."""

from __future__ import annotations

from typing import Any

from tests.api.refusals.bad_robots import INVALID, Bad
from tests.api.requests import joint, pose_waypoint, relative_waypoint

JACOBIAN = "/v1/kinematics/jacobian"
WORKSPACE = "/v1/kinematics/workspace"
REACHABILITY = "/v1/kinematics/reachability"
TORQUES = "/v1/dynamics/inverse"


def jacobian(**changes: Any) -> dict[str, Any]:
    return {"robot": "three_dof_arm", "position": [0.1, 0.2, 0.3], **changes}


def workspace(**changes: Any) -> dict[str, Any]:
    return {"robot": "three_dof_arm", "samples": 10, **changes}


def reachability(*waypoints: Any, **changes: Any) -> dict[str, Any]:
    return {"robot": "three_dof_arm", "waypoints": [joint(0.1, 0.2, 0.3), *waypoints], **changes}


def torques(**changes: Any) -> dict[str, Any]:
    return {"robot": "three_dof_arm", "payload": {"mass": 1.0}, "positions": [[0.1, 0.2, 0.3]] * 2, **changes}


UP = {"kind": "cartesian", "translation": [0.0, 0.0, 0.1]}
TURNED = {"kind": "quaternion", "xyzw": [0.0, 0.0, 0.0, 2.0]}
HEAVY = {"mass": 1.0, "center_of_mass": [0.0, 0.0, 0.0]}

BAD_KINEMATICS = [
    Bad("jacobian without a position", JACOBIAN, {"robot": "three_dof_arm"}, INVALID, "/position"),
    Bad("jacobian of too few joints", JACOBIAN, jacobian(position=[0.1, 0.2]), INVALID, "/position"),
    Bad("jacobian of too many joints", JACOBIAN, jacobian(position=[0.1] * 4), INVALID, "/position"),
    Bad("jacobian of no joints", JACOBIAN, jacobian(position=[]), INVALID, "/position"),
    Bad("jacobian of a list of positions", JACOBIAN, jacobian(position=[[0.1, 0.2, 0.3]]), INVALID, "/position/0"),
    Bad("jacobian at a huge angle", JACOBIAN, jacobian(position=[0.1, 1e300, 0.3]), INVALID, "/position/1"),
    Bad("jacobian of nobody", JACOBIAN, jacobian(robot="nobody"), "unknown_robot"),
    Bad("jacobian of a flat tool", JACOBIAN, jacobian(tool={"position": [0, 0]}), INVALID, "/tool/position"),
    Bad("jacobian in another frame", JACOBIAN, jacobian(frame="tool"), INVALID, "/frame"),
    Bad("jacobian beyond the deadline's cap", JACOBIAN, jacobian(deadline=1e5), INVALID, "/deadline"),
    Bad("workspace of no robot", WORKSPACE, {"samples": 10}, INVALID, "/robot"),
    Bad("workspace of nobody", WORKSPACE, workspace(robot="nobody"), "unknown_robot"),
    Bad("workspace without samples", WORKSPACE, workspace(samples=0), INVALID, "/samples"),
    Bad("workspace of a negative number", WORKSPACE, workspace(samples=-1), INVALID, "/samples"),
    Bad("workspace of half a sample", WORKSPACE, workspace(samples=10.5), INVALID, "/samples"),
    Bad("workspace of too many samples", WORKSPACE, workspace(samples=10**9), INVALID, "/samples"),
    Bad("workspace of listed samples", WORKSPACE, workspace(samples=[10]), INVALID, "/samples"),
    Bad("workspace of a negative seed", WORKSPACE, workspace(seed=-1), INVALID, "/seed"),
    Bad("workspace of a tool of no kind", WORKSPACE, workspace(tool={"position": "tip"}), INVALID, "/tool/position"),
    Bad("reachability of nothing", REACHABILITY, {"robot": "three_dof_arm"}, INVALID, "/waypoints"),
    Bad("reachability of no waypoints", REACHABILITY, reachability(waypoints=[]), INVALID, "/waypoints"),
    Bad("reachability of too many", REACHABILITY, reachability(*[joint(0, 0, 0)] * 1000), INVALID, "/waypoints"),
    Bad("reachability by nobody", REACHABILITY, reachability(robot="nobody"), "unknown_robot"),
    Bad("reachability of two joints", REACHABILITY, reachability(joint(0.1, 0.2)), INVALID, "/waypoints/1/position"),
    Bad("reachability of no kind", REACHABILITY, reachability({"position": [0]}), INVALID, "/waypoints/1/kind"),
    Bad(
        "reachability of a flat pose",
        REACHABILITY,
        reachability(pose_waypoint([0.1, 0.2])),
        INVALID,
        "/waypoints/1/pose/position",
    ),
    Bad(
        "reachability of a long quaternion",
        REACHABILITY,
        reachability(pose_waypoint([0.1, 0.2, 0.0], TURNED)),
        INVALID,
        "/waypoints/1/pose/orientation/xyzw",
    ),
    Bad(
        "reachability from nowhere",
        REACHABILITY,
        reachability(waypoints=[relative_waypoint(UP)]),
        INVALID,
        "/waypoints/0/kind",
    ),
    Bad("reachability near two joints", REACHABILITY, reachability(ik={"reference": [0, 0]}), INVALID, "/ik/reference"),
    Bad("reachability at 1e300", REACHABILITY, reachability(joint(1e300, 0, 0)), INVALID, "/waypoints/1/position/0"),
    Bad("reachability with a back end", REACHABILITY, reachability(backend={"kind": "cubic"}), INVALID, "/backend"),
    Bad("reachability beyond the deadline's cap", REACHABILITY, reachability(deadline=1e5), INVALID, "/deadline"),
    Bad("torques of nobody", TORQUES, torques(robot="nobody"), "unknown_robot"),
    Bad("torques without positions", TORQUES, {"robot": "three_dof_arm", "payload": HEAVY}, INVALID, "/positions"),
    Bad("torques at no positions", TORQUES, torques(positions=[]), INVALID, "/positions"),
    Bad("torques of one row", TORQUES, torques(positions=[0.1, 0.2, 0.3]), INVALID, "/positions/0"),
    Bad("torques of ragged positions", TORQUES, torques(positions=[[0, 0, 0], [0, 0]]), INVALID, "/positions/1"),
    Bad("torques of ragged velocities", TORQUES, torques(velocities=[[0, 0], [0, 0, 0]]), INVALID, "/velocities/0"),
    Bad("torques of fewer velocities", TORQUES, torques(velocities=[[0, 0, 0]]), INVALID, "/velocities"),
    Bad("torques of more accelerations", TORQUES, torques(accelerations=[[0, 0, 0]] * 3), INVALID, "/accelerations"),
    Bad("torques of a string", TORQUES, torques(accelerations=[[0, 0, "0"]] * 2), INVALID, "/accelerations/0/2"),
    Bad("torques of a weightless payload", TORQUES, torques(payload={"mass": 0.0}), INVALID, "/payload/mass"),
    Bad("torques of a number of kilograms", TORQUES, torques(payload=1.0), INVALID, "/payload"),
    Bad("a force of two numbers", TORQUES, torques(process_force={"force": [1, 2]}), INVALID, "/process_force/force"),
    Bad("torques without masses", TORQUES, torques(payload=None), "missing_dynamics"),
]
