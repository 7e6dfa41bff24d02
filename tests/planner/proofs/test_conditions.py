"""Constraints on the tool, process forces and limits by speed in proofs, against scipy, Pinocchio and dense samples."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from typing_extensions import override

import planner
from benchmarks.proofs.plans import slower_when_fast
from planner.proofs import check_proof, write_proof
from planner.proofs.checker import AT_SPEED_CLAIMS, Proof
from planner.proofs.conditions import conditions_at, conditions_in, conditions_of
from tests.planner.proofs.verdicts import is_rejected

START = [0.2, -1.4, 1.6, -1.5, -1.4, 0.1]
"""Joint positions of a UR5e with the tool in front of it, rad."""

END = [0.7, -1.3, 1.55, -1.5, -1.3, 0.4]
"""Joint positions near these, rad."""

ROUNDING = 1e-6
"""Relative excess that the checkers allow."""


def are_met(conditions: list[Any], pose: planner.Pose) -> bool:
    """Return whether a pose meets conditions, in plain numpy."""
    assert pose.rotation is not None
    row = np.hstack([1.0, pose.position, pose.rotation.ravel()])
    sums = [np.dot(linear, row) + sum(np.dot(x, row) ** 2 for x in squared) for linear, squared, _ in conditions]
    return all(value <= limit for value, (_, _, limit) in zip(sums, conditions, strict=True))


def angle_between(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), np.dot(one, other)))


@pytest.mark.large_only
def test_conditions_are_met_where_constraints_are() -> None:
    generator, met = np.random.default_rng(1), 0
    for _ in range(600):
        limit, far = float(generator.uniform(0.2, 2.5)), float(generator.uniform(0.2, 1.5))
        middle = planner.Pose(generator.uniform(-1, 1, 3), Rotation.random(random_state=generator).as_matrix())
        turn = Rotation.from_rotvec(generator.normal(size=3)).as_matrix()
        assert middle.rotation is not None
        pose = planner.Pose(middle.position + generator.uniform(-1, 1, 3), middle.rotation @ turn)
        assert pose.rotation is not None
        axis, direction = generator.normal(size=(2, 3))
        away, unit = pose.position - middle.position, direction / np.linalg.norm(direction)
        point, along = tuple(middle.position), tuple(direction)
        inside = np.abs(middle.rotation.T @ away)
        quaternion = tuple(Rotation.from_matrix(middle.rotation).as_quat())
        relative = Rotation.from_matrix(middle.rotation.T @ pose.rotation)
        cases = [
            (planner.ToolAxis(along, limit, tuple(axis)), angle_between(pose.rotation @ axis, direction) - limit),
            (planner.ToolOrientation(quaternion, limit), relative.magnitude() - limit),
            (planner.ToolNearPlane(point, along, far), abs(away @ unit) - far),
            (planner.ToolNearLine(point, along, far), np.linalg.norm(np.cross(away, unit)) - far),
            (planner.ToolInBox(middle, (far, limit, far)), (inside - np.array([far, limit, far]) / 2.0).max()),
            (planner.ToolInHalfSpace(along, far), pose.position @ unit - far),
        ]
        for kept, excess in cases:
            conditions = conditions_of(kept)
            assert conditions is not None
            if abs(excess) > 10.0 * ROUNDING:
                assert are_met(conditions, pose) == (excess < 0.0)
                met += excess < 0.0
        near = np.linalg.norm(away) <= far and relative.magnitude() <= min(limit, 1.0) * 0.98
        assert are_met(conditions_at(middle, (far, limit)), pose) >= near
        assert are_met(conditions_at(middle, (far, limit)), pose) <= (np.linalg.norm(away) <= far + ROUNDING)
        assert are_met(conditions_at(planner.Pose(middle.position), (far,)), pose) == (np.linalg.norm(away) <= far)
    assert met > 500


class HalfAsNear(planner.ToolNearLine):
    """A kind of its own that allows less than its base."""

    @override
    def gauges(self, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Compute twice the distances (N,)."""
        return 2.0 * super().gauges(positions, rotations)


def test_a_constraint_of_another_kind_has_no_conditions() -> None:
    assert conditions_of(HalfAsNear((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1)) is None


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_models_of_torque_contain_the_process_force(frame: Any) -> None:
    generator = np.random.default_rng(2)
    for name in ("ur5e", "kuka_kr16_2"):
        offset = planner.Pose([0.03, -0.02, 0.15], Rotation.from_rotvec([0.4, 0.2, -0.3]).as_matrix())
        robot = planner.load_robot(name).with_tool(offset)
        middle = (robot.limit("lower") + robot.limit("upper")) / 2.0
        force, moment = generator.uniform(-20.0, 20.0, 3), generator.uniform(-2.0, 2.0, 3)
        exerted = planner.ProcessForce(tuple(force), tuple(moment), frame)
        waypoints = [
            planner.JointWaypoint((middle + 0.1).tolist()),
            planner.JointWaypoint((middle + 0.5).tolist(), process_force=exerted),
        ]
        problem = planner.PlanningProblem(robot, waypoints)
        plan = planner.plan(problem, planner.Quintic())
        content = write_proof(plan)
        assert "torque" in check_proof(content)
        proof, held = Proof(content), plan.path.dynamics.robot_on(0)
        data = held.model.createData()
        for time in (0.0, 0.3, 0.8):
            (q, v, a) = (x[0] for x in plan.trajectory.evaluate(np.array([time * plan.trajectory.duration])))
            torque = pin.rnea(held.model, data, q, v, a)
            aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED if frame == "base" else pin.ReferenceFrame.LOCAL
            jacobian = pin.computeFrameJacobian(held.model, data, q, held.tool_frame_id, aligned)
            torque += jacobian.T @ np.hstack([force, moment])
            motion, _ = proof.motion(time * proof.pieces, time * proof.pieces)
            if proof.pieces == 1:
                np.testing.assert_allclose([x[0] for x in motion.torques()], torque, atol=1e-8)
        proof.robots[0]["process_force"][1][2] += 1e6
        assert is_rejected(content)


def test_limits_by_speed_are_proved_and_lower_ones_rejected() -> None:
    robot = slower_when_fast(planner.load_robot("ur5e"))
    waypoints = [planner.JointWaypoint(START), planner.JointWaypoint(END)]
    plan = planner.plan(planner.PlanningProblem(robot, waypoints), planner.Quintic())
    proof = write_proof(plan)
    assert set(AT_SPEED_CLAIMS) <= set(check_proof(proof)) and not proof["statement"]["not_covered"]
    q, v, a, j = plan.trajectory.evaluate(np.linspace(0.0, plan.trajectory.duration, 20_001), [0, 1, 2, 3])
    rates = (planner.inverse_dynamics(robot, q, v, a), a, j)
    for name, values in zip(AT_SPEED_CLAIMS, rates, strict=True):
        for joint in (0, 4):
            shares = []
            for low, high, most, slope in proof["statement"]["limits"][name][0][joint]:
                speed = np.abs(v[:, joint])
                there = (speed >= low) & (speed <= (np.inf if high is None else high))
                allowed = most - slope * (speed[there] - low)
                shares.append((np.abs(values[there, joint]) / allowed).max(initial=0.0))
            assert max(shares) <= 1.0 + ROUNDING
            changed = copy.deepcopy(proof)
            for line in changed["statement"]["limits"][name][0][joint]:
                line[2:] = [x * max(shares) * 0.998 for x in line[2:]]
            assert is_rejected(changed)


def test_all_kinds_of_constraints_are_proved() -> None:
    robot = planner.load_robot("ur5e")
    pose = planner.forward_kinematics(robot, START)
    assert pose.rotation is not None
    point = tuple(pose.position.tolist())
    keep = (
        planner.ToolAxis(tuple(pose.rotation[:, 2].tolist()), 0.5),
        planner.ToolOrientation(tuple(Rotation.from_matrix(pose.rotation).as_quat().tolist()), 1.2),
        planner.ToolInHalfSpace((0.0, 0.0, 1.0), point[2] + 0.3),
        planner.ToolNearPlane(point, (0.1, 0.0, 1.0), 0.4),
        planner.ToolNearLine(point, (1.0, 1.0, 0.2), 0.4),
        planner.ToolInBox(planner.Pose(pose.position), (1.0, 1.2, 0.8)),
    )
    end = replace(planner.JointWaypoint(END), motion=planner.FreeMotion(keep=keep))
    proof = write_proof(planner.plan(planner.PlanningProblem(robot, [planner.JointWaypoint(START), end])))
    assert "tool_pose" in check_proof(proof) and not proof["statement"]["not_covered"]
    assert len(proof["statement"]["limits"]["tool_pose"][0]) == 8


def test_conditions_of_regions_are_met_inside_alone() -> None:
    generator, inside, outside = np.random.default_rng(6), 0, 0
    widest = np.array([0.3, 0.3, 0.3, np.pi / 2.0, 1.3, np.pi])
    names = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
    for case in range(300):
        middle = planner.Pose(generator.uniform(-1, 1, 3), Rotation.random(random_state=generator).as_matrix())
        ends = np.sort(generator.uniform(-1.0, 1.0, (6, 2)), axis=1) * widest[:, None]
        ends[generator.random(6) < 0.4] = 0.0
        ends[5] = ends[5] if generator.random() < 0.7 else [[-np.pi, np.pi], [-np.pi / 2.0, np.pi / 2.0]][case % 2]
        chosen = {name: tuple(pair) for name, pair in zip(names, ends.tolist(), strict=True) if pair != [0.0, 0.0]}
        conditions = conditions_in(planner.Region(**chosen), middle, (1e-6, 1e-6))
        if conditions is None:
            assert ends[5, 1] - ends[5, 0] > np.pi < 2.0 * np.pi - 1e-5
            continue
        assert middle.rotation is not None
        for _ in range(20):
            at = generator.uniform(*ends.T)
            if generator.random() < 0.5:
                at = at + generator.choice([0.0, 0.0, 0.0, 1e-3, -1e-3, 0.5, np.pi], 6)
            turn = Rotation.from_euler("XYZ", at[3:])
            if abs(at[4]) > 1.4:  # the angles are then others
                continue
            turned = (at[3:] + np.pi) % (2.0 * np.pi) - np.pi
            excess = np.maximum(ends[:, 0] - [*at[:3], *turned], [*at[:3], *turned] - ends[:, 1]).max()
            pose = planner.Pose(middle.position + middle.rotation @ at[:3], middle.rotation @ turn.as_matrix())
            if excess <= 0.0 or excess > 1e-4:
                assert are_met(conditions, pose) == (excess <= 0.0), (ends, at)
                inside += excess <= 0.0
                outside += excess > 0.0
    assert min(inside, outside) > 500


def test_a_waypoint_may_be_anywhere_in_its_region_and_nowhere_else() -> None:
    robot = planner.load_robot("ur5e")
    pose = planner.forward_kinematics(robot, END)
    region = planner.Region(x=(-0.02, 0.05), rotation_x=(-0.1, 0.2), rotation_z=(-1.0, 1.0))
    waypoints: list[planner.AnyWaypoint] = [planner.JointWaypoint(START), planner.PoseWaypoint(pose, free=region)]
    proof = write_proof(planner.plan(planner.PlanningProblem(robot, waypoints), planner.Quintic()))
    assert "waypoints" in check_proof(proof) and not proof["statement"]["not_covered"]
    for axis in range(3):
        changed = copy.deepcopy(proof)
        changed["statement"]["robots"][-1]["tool"]["translation"][axis] += 0.08
        assert is_rejected(changed)
