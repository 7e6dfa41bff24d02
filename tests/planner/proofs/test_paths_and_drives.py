"""Lines, circles, axes of the tool and drives in proofs, against scipy, closed forms and sampled motions."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import planner
from planner.certificate.lines_and_circles import Circle, Line
from planner.kinematics.forward import tool_poses
from planner.proofs import check_proof, write_proof
from planner.proofs.checker import Model, Motion, Proof
from planner.proofs.guides import NODES, guide_of, shares_of
from tests.planner.proofs.guided_poses import constant, pose_at
from tests.planner.proofs.verdicts import is_rejected

if TYPE_CHECKING:
    from planner.spatial import FloatArray

START = (0.2, -1.4, 1.6, -1.5, -1.4, 0.1)
"""Joint positions of a UR5e with the tool in front of it, rad."""


def pose(generator: np.random.Generator) -> planner.Pose:
    return planner.Pose(
        generator.uniform(-1.0, 1.0, 3), Rotation.random(random_state=int(generator.integers(1 << 30))).as_matrix()
    )


def test_guides_lead_along_lines() -> None:
    generator = np.random.default_rng(1)
    for _ in range(20):
        start, end = pose(generator), pose(generator)
        guide = guide_of(Line.between(start, end))
        assert guide is not None and start.rotation is not None and end.rotation is not None
        turn = Rotation.from_matrix(start.rotation.T @ end.rotation).as_rotvec()
        for u in (0.0, 0.3, 1.0):
            point, rotation = pose_at(guide, u)
            np.testing.assert_allclose(point, (1.0 - u) * start.position + u * end.position, atol=1e-12)
            expected = start.rotation @ Rotation.from_rotvec(u * turn).as_matrix()
            np.testing.assert_allclose(rotation, expected, atol=1e-12)


@pytest.mark.large_only
def test_guides_lead_along_circles() -> None:
    generator = np.random.default_rng(2)
    for _ in range(4):
        start, end, via = pose(generator), pose(generator), planner.Pose(generator.uniform(-1.0, 1.0, 3))
        circle = Circle.through(start, via, end)
        guide = guide_of(circle)
        assert guide is not None and start.rotation is not None and end.rotation is not None
        points = np.array([pose_at(guide, u)[0] for u in np.linspace(0.0, 1.0, 400)])
        np.testing.assert_allclose(points[[0, -1]], [start.position, end.position], atol=1e-9)
        assert np.linalg.norm(points - via.position, axis=1).min() < 0.02
        np.testing.assert_allclose(np.linalg.norm(points - circle.center, axis=1), np.linalg.norm(circle.x), atol=1e-9)
        np.testing.assert_allclose(pose_at(guide, 1.0)[1], end.rotation, atol=1e-9)


def test_a_turn_about_several_axes_has_no_guide() -> None:
    generator = np.random.default_rng(3)
    assert guide_of(Circle.through(*(pose(generator) for _ in range(3)))) is None


def test_shares_are_the_places_on_a_path() -> None:
    generator = np.random.default_rng(4)
    for _ in range(10):
        one, other, via = pose(generator), pose(generator), planner.Pose(generator.uniform(-1.0, 1.0, 3))
        still = planner.Pose(one.position, other.rotation)
        for path in (Line.between(one, other), Line.between(one, still), Circle.through(one, via, other)):
            u = 0.4 + 0.1 * NODES + 0.02 * NODES**3
            points, rotations = path.poses(u)
            assert rotations is not None
            np.testing.assert_allclose(shares_of(path, points, rotations), [0.4, 0.1, 0.0, 0.02, 0.0, 0.0], atol=1e-9)


@pytest.fixture(scope="module")
def guided() -> dict[str, Any]:
    """Return the proof of a line with a blended corner, and a circle."""
    robot = planner.load_robot("ur5e")
    start = planner.forward_kinematics(robot, START)
    up, side = (planner.Pose(start.position + np.array(x), start.rotation) for x in ((0, 0, 0.08), (0.06, 0.02, 0.08)))
    via, end = (planner.Pose(side.position + np.array(x), start.rotation) for x in ((0.02, 0.02, 0), (0.04, 0, 0)))
    waypoints: list[planner.AnyWaypoint] = [
        planner.JointWaypoint(START),
        planner.PoseWaypoint(up, motion=planner.LinearMotion(), transition=planner.BlendTransition(0.02)),
        planner.PoseWaypoint(side, motion=planner.LinearMotion()),
        planner.PoseWaypoint(end, motion=planner.CircularMotion(via=planner.Pose(via.position))),
    ]
    return write_proof(planner.plan(planner.PlanningProblem(robot, waypoints), planner.Trapezoidal()))


def test_lines_circles_and_blends_are_proved(guided: dict[str, Any]) -> None:
    assert {"path_deviation", "waypoints"} <= set(check_proof(guided))
    assert guided["statement"]["not_covered"] == []
    kinds = {type(shares) for shares in guided["evidence"]["along"]}
    assert kinds == {list, int}
    assert guided["statement"]["waypoints"][1]["tool_pose"][0][2] == pytest.approx(0.02**2, rel=1e-6)


@pytest.mark.parametrize("segment", [0, 1, 2])
def test_a_path_elsewhere_is_rejected(guided: dict[str, Any], segment: int) -> None:
    for moved, rejected in ((0.5e-4, False), (3e-4, True)):
        changed = copy.deepcopy(guided)
        (guide,) = changed["statement"]["limits"]["path_deviation"][segment]["guides"]
        guide["links"][0]["origin"][1] += moved
        assert is_rejected(changed) == rejected
    changed = copy.deepcopy(guided)
    tool = changed["statement"]["limits"]["path_deviation"][segment]["guides"][0]["tool"]
    tool["rotation"] = (np.array(tool["rotation"]) @ Rotation.from_rotvec([0.0, 3e-3, 0.0]).as_matrix()).tolist()
    assert is_rejected(changed)
    changed = copy.deepcopy(guided)
    changed["statement"]["limits"]["path_deviation"][segment]["tolerance"] = [1e-24, 1e-6]
    assert is_rejected(changed)


def test_the_tool_is_in_the_blend_that_the_evidence_names(guided: dict[str, Any]) -> None:
    for radius, rejected in ((0.03, False), (0.004, True)):
        changed = copy.deepcopy(guided)
        for guide in changed["statement"]["limits"]["path_deviation"][:2]:
            for blend in guide["blends"]:
                blend[2] = radius**2
        assert is_rejected(changed) == rejected


def test_shares_beyond_the_ends_of_a_path_are_rejected(guided: dict[str, Any]) -> None:
    """The line goes on beyond its end in the file, and the tool would be on it."""
    changed = copy.deepcopy(guided)
    (guide,) = changed["statement"]["limits"]["path_deviation"][0]["guides"]
    guide["rates"] = [[rate / 2.0 for rate in rates] for rates in guide["rates"]]
    first = changed["trajectory"]["segments"].count(0)
    for k, start in enumerate(changed["evidence"]["bounded"][:-1]):
        if start < first and isinstance(changed["evidence"]["along"][k], list):
            changed["evidence"]["along"][k] = [2.0 * x for x in changed["evidence"]["along"][k]]  # 0 is the guide
    assert is_rejected(changed)


def test_kept_axes_are_proved() -> None:
    robot = planner.load_robot("ur5e")
    rotation = planner.forward_kinematics(robot, START).rotation
    assert rotation is not None
    end = planner.JointWaypoint([0.7, -1.3, 1.55, -1.5, -1.3, 0.4])
    reached = 0.5
    for angle in (0.5, 1.005):
        kept = planner.ToolAxis(tuple(rotation[:, 2].tolist()), angle * reached if angle > 1.0 else angle)
        waypoints = [planner.JointWaypoint(START), replace(end, motion=planner.FreeMotion(keep=(kept,)))]
        plan = planner.plan(planner.PlanningProblem(robot, waypoints), planner.Quintic())
        proof = write_proof(plan)
        assert "tool_pose" in check_proof(proof)
        sampled = plan.trajectory.evaluate(np.linspace(0.0, plan.trajectory.duration, 2001), [0])[0]
        reached = float(np.arccos((tool_poses(robot, sampled)[1][:, :, 2] @ rotation[:, 2]).min()))
        assert proof["statement"]["limits"]["tool_pose"][0][0][2] == pytest.approx(-np.cos(kept.angle), abs=1e-5)
        proof["statement"]["limits"]["tool_pose"][0][0][2] = -np.cos(reached * 0.999)
        assert is_rejected(proof)


@pytest.fixture(scope="module")
def driven() -> tuple[planner.Plan, dict[str, Any]]:
    """Return a plan whose joints turn back, of a robot with friction and rotors, and its proof."""
    arm = planner.load_robot("ur5e")
    drive = {"friction": 6.0, "damping": 3.0, "rotor_inertia": 0.4}
    robot = arm.derived(limits={joint.name: drive for joint in arm.joints})
    generator, through = np.random.default_rng(6), planner.ThroughTransition()
    turns = [
        planner.JointWaypoint((START + generator.uniform(-0.4, 0.4, 6)).tolist(), transition=through) for _ in range(3)
    ]
    turns = [planner.JointWaypoint(START), *turns, planner.JointWaypoint(START)]
    plan = planner.plan(planner.PlanningProblem(robot, turns), planner.Quintic())
    return plan, write_proof(plan)


def torques(plan: planner.Plan, times: FloatArray) -> FloatArray:
    """Return torques from the robot without drives, and the formula of friction and rotors."""
    q, v, a = plan.trajectory.evaluate(times)
    bare: FloatArray = planner.inverse_dynamics(planner.load_robot("ur5e"), q, v, a)
    return bare + 6.0 * np.sign(v) + 3.0 * v + 0.4 * a


@pytest.mark.large_only
def test_torques_with_friction_and_rotors_are_proved(driven: tuple[planner.Plan, dict[str, Any]]) -> None:
    plan, proof = driven
    assert {"torque"} <= set(check_proof(proof))
    assert proof["statement"]["not_covered"] == []
    found = torques(plan, np.linspace(0.0, plan.trajectory.duration, 20_001)[1:-1])
    for joint in range(6):
        for side, peak in enumerate((found[:, joint].min(), found[:, joint].max())):
            changed = copy.deepcopy(proof)
            for limits in changed["statement"]["limits"]["torque"]:
                limits[side][joint] = peak * (0.999 if (peak > 0.0) == (side == 1) else 1.001)
            assert is_rejected(changed)


def test_models_contain_torques_where_the_velocity_changes_its_sign(
    driven: tuple[planner.Plan, dict[str, Any]],
) -> None:
    plan, content = driven
    proof, generator = Proof(content), np.random.default_rng(5)
    x = np.linspace(-1.0, 1.0, 21)
    widened = 0
    for _ in range(60):
        piece = int(generator.integers(proof.pieces))
        start, end = sorted(generator.random(2))
        times = float(proof.begins[piece]) + float(proof.lengths[piece]) * (start + (end - start) * (x + 1.0) / 2.0)
        motion, _ = proof.motion(piece + start, piece + end)
        velocities = plan.trajectory.evaluate(times, [1])[0]
        for joint, (model, expected) in enumerate(zip(motion.torques(), torques(plan, times).T, strict=True)):
            away = np.abs(np.polynomial.polynomial.polyval(x, model[:6]) - expected)
            assert (away <= model[6] * (1.0 + 1e-9) + 1e-9).all()
            turns_back = velocities[:, joint].min() < 0.0 < velocities[:, joint].max()
            assert not turns_back or model[6] >= 6.0
            widened += turns_back
    assert widened > 5


def test_friction_at_rest_has_no_sign() -> None:
    """At rest the torque is the one of gravity, up to the friction towards the motion; nothing needs the other side."""
    link = {"rotation": np.eye(3).tolist(), "origin": [0.0] * 3, "motion": "revolute", "mass": 0.0}
    link |= {"center_of_mass": [0.0] * 3, "inertia": np.zeros((3, 3)).tolist()}
    link |= {"friction": 2.0, "damping": 0.0, "rotor_inertia": 0.0}
    tool = {"joint": 1, "translation": [0.0] * 3}
    robot = {"links": [link], "gravity": [0.0] * 3, "tool": tool, "process_force": [1, [0.0] * 3, [0.0] * 3]}
    for v, low, high in (
        ((0.5, 0.5, 0.0), 0.0, 2.0),
        ((-0.5, 0.5, 0.0), -2.0, 0.0),
        ((0.5, 0.4, 0.0), 2.0, 2.0),
        ((-0.5, 0.4, 0.0), -2.0, -2.0),
        ((0.1, 0.5, 0.0), -2.0, 2.0),
        ((0.0, 0.0, 0.0), 0.0, 0.0),
    ):
        rate: Model = (*v, 0.0, 0.0, 0.0, 0.0)
        (torque,) = Motion(robot, [constant(0.3)], [rate], [constant(0.0)], [constant(0.0)]).torques()
        assert torque[0] - torque[6] == pytest.approx(low, abs=1e-12)
        assert torque[0] + torque[6] == pytest.approx(high, abs=1e-12)
