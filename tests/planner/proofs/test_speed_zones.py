"""Speed zones in proofs, against the speeds of points by Pinocchio and distances at dense samples."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from benchmarks.proofs.plans import plan_of
from planner.proofs import check_proof, write_proof
from planner.proofs.checker import Proof
from planner.proofs.statement import pairs_of
from planner.scene import CollisionChecker
from tests.planner.proofs.verdicts import is_rejected

IN_ZONE = 8
"""Number of a plan of the large run that enters its speed zone and leaves it."""

SAMPLES = 100
"""Number of times at which the truth is computed."""


@pytest.fixture(scope="module")
def plan() -> planner.Plan:
    return plan_of(IN_ZONE)


@pytest.fixture(scope="module")
def content(plan: planner.Plan) -> dict[str, Any]:
    return write_proof(plan)


def speeds_at(plan: planner.Plan, shapes: list[dict[str, Any]], times: np.ndarray) -> np.ndarray:
    """Return the largest speeds (N,) of points of shapes and of the tool, m/s."""
    robot, found = plan.path.robot, []
    data, q, v = robot.model.createData(), *plan.trajectory.evaluate(times, [0, 1])
    tool = robot.model.frames[robot.tool_frame_id]
    points = {int(tool.parentJoint): [tool.placement.translation]}
    for shape in shapes:
        points.setdefault(shape["joint"], []).extend(shape.get("points", []))
    for position, velocity in zip(q, v, strict=True):
        pin.forwardKinematics(robot.model, data, position, velocity)
        twists = {joint: pin.getVelocity(robot.model, data, joint) for joint in points if joint}
        fastest = [
            np.linalg.norm(twist.linear + np.cross(twist.angular, points[joint]), axis=1).max()
            for joint, twist in twists.items()
        ]
        found.append(max(fastest))
    return np.array(found)


def test_slow_intervals_are_slow_and_planes_keep_the_zone_away(plan: planner.Plan, content: dict[str, Any]) -> None:
    assert {"clearance", "speed_zones"} <= set(check_proof(content))
    proof, (zone,) = Proof(content), plan.problem.speed_zones
    scene, checker = proof.statement["scenes"][0], CollisionChecker(plan.path.robot, plan.problem.scene)
    assert not any(shape.get("disc") or shape.get("ball") for shape in scene["shapes"] if shape["joint"])
    numbers = [number for number, _ in pairs_of(checker, [zone])["speed_zones"]]
    kinds = set()
    for start, end, planes in proof.evidence["speed_zones"]:
        times = np.linspace(start, end, SAMPLES) * plan.trajectory.lengths[0]
        motion, _ = proof.motion(start, end)
        speeds = speeds_at(plan, scene["shapes"], times)
        placements = checker.bodies.at(plan.trajectory.evaluate(times, [0])[0])
        for pair, evidence in planes:
            kinds.add(type(evidence))
            if evidence == "slow":
                assert speeds.max() <= min(motion.top_speed(scene), zone.speed) * (1.0 + 1e-6)
            else:
                away = min(checker.separate(placements, row, numbers[pair]).proved for row in range(0, SAMPLES, 10))
                assert away >= zone.clearance - 2e-5
    assert kinds == {str, list}


def test_the_bound_on_the_speed_at_one_time_is_the_speed(plan: planner.Plan, content: dict[str, Any]) -> None:
    proof = Proof(content)
    scene = proof.statement["scenes"][0]
    for share in (0.2, 0.5, 0.9):
        (speed,) = speeds_at(plan, scene["shapes"], np.array([share * plan.trajectory.lengths[0]]))
        motion, _ = proof.motion(share, share)
        assert motion.top_speed(scene) == pytest.approx(speed, rel=1e-9)
    around = copy.deepcopy(scene)
    for shape in around["shapes"]:
        shape["ball"] = 0.1
    motion, _ = proof.motion(0.5, 0.5)
    turning = max(sum(x[0] ** 2 for x in w) ** 0.5 for _, _, w, *_ in motion.rates)
    (speed,) = speeds_at(plan, scene["shapes"], np.array([0.5 * plan.trajectory.lengths[0]]))
    assert speed < motion.top_speed(around) <= (speed + 0.1 * turning) * (1.0 + 1e-9)


def test_a_robot_that_is_faster_in_the_zone_is_rejected(plan: planner.Plan, content: dict[str, Any]) -> None:
    (check,) = plan.certificate.speed_zones
    slower = copy.deepcopy(content)
    for pair in slower["statement"]["scenes"][0]["speed_zones"]:
        pair[3] = check.lower * 0.999
    assert is_rejected(slower)
    wider = copy.deepcopy(content)
    for pair in wider["statement"]["scenes"][0]["speed_zones"]:
        pair[2] = 10.0
    assert is_rejected(wider)


def test_slowness_is_no_clearance(content: dict[str, Any]) -> None:
    changed = copy.deepcopy(content)
    changed["evidence"]["clearance"][-1][2][0][1] = "slow"
    assert is_rejected(changed)
    for pair in changed["statement"]["scenes"][0]["clearance"]:
        pair.append(100.0)
    assert is_rejected(changed)
