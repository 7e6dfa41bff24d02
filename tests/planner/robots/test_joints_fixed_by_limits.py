"""Joints whose position limits are equal: fixed there, as Pinocchio's own model with this joint at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner import DHJoint, Robot
from planner.backends import BACKENDS
from planner.kinematics import tool_pose
from tests.planner.robots.urdfs import INERTIAL, joint, link, robot

ANGLE = 0.7
LIMIT = '<limit lower="{0}" upper="{0}" velocity="2" effort="30"/>'
ARM = robot(
    link("base"),
    *(link(name, INERTIAL) for name in ("shoulder", "elbow", "wrist", "tip")),
    joint("j1", "base", "shoulder"),
    joint("j2", "shoulder", "elbow", axis='<axis xyz="0 1 0"/>'),
    joint("locked", "elbow", "wrist", axis='<axis xyz="1 0 0"/>', limit=LIMIT.format(ANGLE)),
    joint("j3", "wrist", "tip", axis='<axis xyz="0 1 0"/>', origin='<origin xyz="0.2 0.1 0.3"/>'),
)
ROW = DHJoint(
    "revolute", a=0.3, alpha=0.4, d=0.1, theta=0.2, lower=-2.0, upper=2.0, mass=1.0, inertia=(0.1, 0, 0, 0.1, 0, 0.1)
)
SLIDE = replace(ROW, kind="prismatic", lower=0.15, upper=0.15, name="slide")


def test_a_joint_with_equal_limits_is_fixed_in_a_urdf() -> None:
    arm, whole = Robot.from_urdf(ARM), pin.buildModelFromXML(ARM)
    assert arm.joint_names == ("j1", "j2", "j3")
    (finding,) = (finding for finding in arm.findings if finding.code == "fixed_by_limits")
    assert finding.severity == "warning"
    assert finding.message == "both position limits of locked are 0.7: it is fixed there and is no joint of the arm"
    data = whole.createData()
    for q, v, a in np.random.default_rng(0).uniform(-1.5, 1.5, (10, 3, 3)):
        full = [np.insert(values, 2, fixed) for values, fixed in ((q, ANGLE), (v, 0.0), (a, 0.0))]
        pin.framesForwardKinematics(whole, data, full[0])
        there, expected = tool_pose(arm, q), data.oMf[whole.getFrameId("tip")]
        np.testing.assert_allclose(there.position, expected.translation, atol=1e-12)
        np.testing.assert_allclose(there.rotation, expected.rotation, atol=1e-12)
        torque = planner.inverse_dynamics(arm, q[None], v[None], a[None])[0]
        np.testing.assert_allclose(torque, np.delete(pin.rnea(whole, data, *full), 2), atol=1e-10)


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_row_with_equal_limits_is_fixed_in_a_table(convention: str, place: int) -> None:
    rows = [ROW, ROW]
    rows.insert(place, SLIDE)
    arm = Robot.from_dh(rows, convention=convention)
    free = Robot.from_dh([replace(row, lower=-2.0, upper=2.0) for row in rows], convention=convention)
    assert arm.joint_names == tuple(name for name in free.joint_names if name != "slide")
    for q, v, a in np.random.default_rng(1).uniform(-1.5, 1.5, (5, 3, 2)):
        full = [np.insert(values, place, fixed)[None] for values, fixed in ((q, 0.15), (v, 0.0), (a, 0.0))]
        there, expected = tool_pose(arm, q), tool_pose(free, full[0][0])
        np.testing.assert_allclose(there.position, expected.position, atol=1e-12)
        np.testing.assert_allclose(there.rotation, expected.rotation, atol=1e-12)
        torque = planner.inverse_dynamics(arm, q[None], v[None], a[None])[0]
        expected_torque = planner.inverse_dynamics(free, *full)[0]
        np.testing.assert_allclose(torque, np.delete(expected_torque, place), atol=1e-10)


@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_plans_with_a_fixed_joint(kind: str) -> None:
    plan = planner.plan(planner.PlanningProblem(Robot.from_urdf(ARM), [[0.0, 0.2, -0.3], [0.6, -0.4, 0.5]]), kind)
    assert plan.certificate.satisfied
    np.testing.assert_allclose(plan.trajectory.evaluate(plan.trajectory.duration)[0], [0.6, -0.4, 0.5], atol=1e-9)
