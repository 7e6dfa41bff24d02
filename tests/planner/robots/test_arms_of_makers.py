"""Descriptions as different makers write them are read, reach as far as the data sheets say, and plan."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

import planner
from tests.planner.robots.arms_of_makers import ARMS
from tests.planner.robots.frames import frame_pose, pinocchio_configuration

NAMES = sorted(ARMS)
CATALOGUE = ("ur5e", "fr3")
"""The makers whose arms are in the catalogue."""


def read(name: str) -> planner.Robot:
    """Return an arm that is read from its maker's description."""
    return planner.load_robot(name) if name in CATALOGUE else planner.Robot.from_urdf(ARMS[name].urdf(), id=name)


@pytest.mark.parametrize("name", NAMES)
def test_the_arm_moves_as_pinocchio_reads_the_same_text(name: str) -> None:
    arm, model = read(name), pin.buildModelFromXML(ARMS[name].urdf())
    data, frame = model.createData(), model.getFrameId("tool0")
    assert (arm.dof, arm.tip_frame) == (len(ARMS[name].rows), "tool0")
    for q in np.random.default_rng(3).uniform(-3.0, 3.0, (20, arm.dof)):
        pin.framesForwardKinematics(model, data, pinocchio_configuration(model, arm, q))
        np.testing.assert_allclose(frame_pose(arm, q), data.oMf[frame].homogeneous, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_limits_are_those_of_the_maker(name: str) -> None:
    arm = read(name)
    for joint, (*_, (lower, upper), speed) in zip(arm.joints, ARMS[name].rows, strict=True):
        assert joint.velocity == pytest.approx(np.radians(speed))
        assert (joint.lower, joint.upper) == pytest.approx(np.radians([lower, upper]))
        assert joint.torque == (ARMS[name].effort or np.inf)  # 0 stands for "not known"


@pytest.mark.parametrize("name", [name for name in NAMES if ARMS[name].reach is not None])
def test_the_reach_is_that_of_the_data_sheet(name: str) -> None:
    arm, description = read(name), ARMS[name]
    second, fifth = (arm.joint_names[k] for k in (1, 4))

    def reach(q: np.ndarray) -> float:
        pin.framesForwardKinematics(arm.model, arm.data, q)
        origins = {name: arm.data.oMi[arm.model.getJointId(name)].translation for name in (second, fifth)}
        if description.to_flange:
            tip = arm.data.oMf[arm.tip_frame_id].translation
            return float(np.linalg.norm(tip - origins[second]))
        return float(np.hypot(*origins[fifth][:2]))

    low, high = (np.clip(limit, -np.pi, np.pi) for limit in (arm.limit("lower"), arm.limit("upper")))
    starts = np.random.default_rng(1).uniform(low, high, (6, arm.dof))
    found = [minimize(lambda q: -reach(q), q, bounds=list(zip(low, high, strict=True))) for q in starts]
    assert max(-each.fun for each in found) == pytest.approx(description.reach, abs=1e-3)


@pytest.mark.parametrize("name", [*NAMES, *CATALOGUE])
def test_the_tool_follows_a_straight_line(name: str) -> None:
    arm = read(name)
    start = arm.named_positions.get(
        "home", np.clip(0.3 + 0.2 * np.arange(arm.dof), *map(arm.limit, ("lower", "upper")))
    )
    goal = planner.forward_kinematics(arm, np.asarray(start) + 0.08)
    line = planner.PoseWaypoint(goal, motion=planner.LinearMotion())
    plan = planner.plan(planner.PlanningProblem(arm, [planner.JointWaypoint(start), line]))
    assert plan.certificate.satisfied
    times = np.linspace(0.0, plan.trajectory.duration, 200)
    points = np.array([frame_pose(arm, q)[:3, 3] for q in plan.trajectory.evaluate(times, (0,))[0]])
    along = (goal.position - points[0]) / np.linalg.norm(goal.position - points[0])
    beside = (points - points[0]) - np.outer((points - points[0]) @ along, along)
    assert np.linalg.norm(beside, axis=1).max() < 1e-4
    np.testing.assert_allclose(points[-1], goal.position, atol=1e-6)
