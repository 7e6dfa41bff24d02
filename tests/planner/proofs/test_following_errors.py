"""Following errors in proofs, against Pinocchio at random positions of the joints within them."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.proofs import check_proof, write_proof
from planner.proofs.checker import Proof, combine, upper
from tests.planner.proofs.verdicts import is_rejected

START = [0.2, -1.4, 1.6, -1.5, -1.4, 0.1]
END = [0.7, -1.3, 1.55, -1.5, -1.3, 0.4]
"""Joint positions of a UR5e with the tool in front of it, rad."""

ERRORS = [0.002, 0.001, 0.003, 0.002, 0.005, 0.001]
"""Following errors of its joints, rad."""

OF_PLANNED = "following errors: all claims hold for planned positions"

DRAWN = 40
"""Number of drawn positions at each time."""


def arm(**limits: Any) -> planner.Robot:
    robot = planner.load_robot("ur5e")
    errors = zip(robot.joints, ERRORS, strict=True)
    return robot.derived(limits={joint.name: {"following_error": error, **limits} for joint, error in errors})


def problem_of(robot: planner.Robot) -> planner.PlanningProblem:
    waypoints = [planner.JointWaypoint(START), planner.JointWaypoint(END)]
    limits = planner.Limits(tcp_linear_velocity=0.4, tcp_linear_acceleration=4.0)
    return planner.PlanningProblem(robot, waypoints, limits=limits)


@pytest.fixture(scope="module")
def plan() -> planner.Plan:
    return planner.plan(problem_of(arm()), planner.Quintic())


@pytest.fixture(scope="module")
def content(plan: planner.Plan) -> dict[str, Any]:
    return write_proof(plan)


def drawn(plan: planner.Plan, times: np.ndarray) -> dict[str, np.ndarray]:
    """Return the largest torques and speeds (N, ...) of positions within the following errors, by Pinocchio.

    Half of the positions are corners of the box.
    """
    robot, generator = plan.path.robot, np.random.default_rng(3)
    data, axes = robot.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    torques, speeds = [], []
    for q, v, a in zip(*plan.trajectory.evaluate(times, [0, 1, 2]), strict=True):
        shares = generator.uniform(-1.0, 1.0, (DRAWN, len(q)))
        shares[::2] = np.sign(shares[::2])
        actual = q + shares * ERRORS
        torques.append(np.max([np.abs(pin.rnea(robot.model, data, x, v, a)) for x in actual], axis=0))
        each = []
        for x in actual:
            pin.forwardKinematics(robot.model, data, x, v)
            each.append(
                float(np.linalg.norm(pin.getFrameVelocity(robot.model, data, robot.tool_frame_id, axes).linear))
            )
        speeds.append(max(each))
    return {"torque": np.array(torques), "tcp_linear_velocity": np.array(speeds)}


def test_models_contain_torques_and_speeds_within_the_errors(plan: planner.Plan, content: dict[str, Any]) -> None:
    proof = Proof(content)
    shares = np.array([0.1, 0.35, 0.6, 0.85]) * proof.pieces
    lengths = plan.trajectory.lengths
    times = plan.trajectory.breakpoints[shares.astype(int)] + shares % 1.0 * lengths[shares.astype(int)]
    reached = drawn(plan, times)
    for k, share in enumerate(shares):
        motion, _ = proof.motion(share, share)
        bounds = [max(upper(x), upper(combine([-1.0], [x]))) for x in motion.actual.torques()]
        assert (reached["torque"][k] <= np.array(bounds) + 1e-9).all()
        assert bounds[1] <= reached["torque"][k][1] * 1.02
        speed = upper(motion.actual.tool_squares()["tcp_linear_velocity"]) ** 0.5
        planned = upper(motion.tool_squares()["tcp_linear_velocity"]) ** 0.5
        assert planned < reached["tcp_linear_velocity"][k] <= speed <= 1.02 * reached["tcp_linear_velocity"][k]


def test_a_limit_that_only_planned_positions_keep_is_rejected(plan: planner.Plan, content: dict[str, Any]) -> None:
    assert {"torque", "tcp_linear_velocity", "tcp_linear_acceleration"} <= set(check_proof(content))
    assert content["statement"]["not_covered"] == ["following errors: waypoints hold for planned positions"]
    times = np.linspace(0.0, plan.trajectory.duration, 101)
    reached = drawn(plan, times)["tcp_linear_velocity"].max()
    changed = copy.deepcopy(content)
    changed["evidence"]["bounded"] = np.linspace(0.0, 1.0, 97).tolist()
    assert not is_rejected(changed)
    changed["statement"]["limits"]["tcp_linear_velocity"] = [float(reached) * 0.9999]
    assert is_rejected(changed)
    for robot in changed["statement"]["robots"]:
        robot["following_errors"] = [0.0] * len(ERRORS)
    assert not is_rejected(changed)


def test_limits_that_models_cannot_decide_are_proved_for_planned_positions(plan: planner.Plan) -> None:
    """The certificate's bound on torques with following errors is nearer to the true peak."""
    (peak,) = (check for check in plan.certificate.checks if check.quantity == "torque_with_tolerances")
    held = {joint.name: {"following_error": joint.following_error} for joint in plan.path.robot.joints}
    held[str(peak.joint)]["torque"] = float(peak.peak) * (1.0 + 1e-6)
    fixed = replace(problem_of(planner.load_robot("ur5e").derived(limits=held)), duration=plan.trajectory.duration)
    proof = write_proof(planner.plan(fixed, planner.Quintic()))
    assert "torque" in check_proof(proof)
    assert {"torque_with_tolerances", OF_PLANNED} <= set(proof["statement"]["not_covered"])


def test_tolerances_of_payloads_are_not_covered() -> None:
    payload = planner.Payload(mass=1.0, mass_tolerance=0.2)
    proof = write_proof(planner.plan(replace(problem_of(arm()), payload=payload), planner.Quintic()))
    assert "torque" in check_proof(proof)
    assert "torque_with_tolerances" in proof["statement"]["not_covered"]
