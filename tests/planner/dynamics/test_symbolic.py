"""Torques as CasADi expressions against Pinocchio's."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from planner.dynamics import inverse_dynamics
from planner.dynamics.symbolic import dynamics_content, symbolic_motion
from planner.kinematics import Pose, tool_speeds
from planner.robots import DHJoint, Robot, catalogue_ids, load_robot
from planner.robots.payload import Payload
from planner.spatial import rotation_x
from tests.planner.problems_of_tests import random_position

PAYLOAD = Payload(4.0, (0.05, -0.02, 0.12), (0.02, 0.03, 0.04))


def sliding_arm() -> Robot:
    """Make an arm with a continuous, a sliding and a turning joint, on a base that lies on its side."""

    def link(kind: str, a: float, alpha: float, lower: float | None = None, upper: float | None = None) -> DHJoint:
        return DHJoint(
            kind=kind,  # type: ignore[arg-type]
            theta=0.3,
            d=0.2,
            a=a,
            alpha=alpha,
            mass=2.5,
            center_of_mass=(-0.1, 0.04, 0.02),
            inertia=(0.03, 0.002, -0.001, 0.05, 0.004, 0.04),
            lower=lower,
            upper=upper,
        )

    joints = (
        link("revolute", 0.3, 1.1),
        link("prismatic", 0.1, -0.7, lower=0.0, upper=0.5),
        link("revolute", 0.2, 0.4),
    )
    upright = Pose(np.zeros(3), rotation_x(np.pi / 2.0))
    return Robot.from_dh(joints, convention="modified", base=upright, id="sliding_arm")


ROBOTS = [sliding_arm(), *(robot for name in catalogue_ids() if (robot := load_robot(name)).has_dynamics)]


@pytest.mark.parametrize("payload", [None, PAYLOAD], ids=["empty", "loaded"])
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
def test_torques_are_those_of_pinocchio(robot: Robot, payload: Payload | None) -> None:
    robot = robot if payload is None else robot.with_payload(payload)
    robot = robot.with_tool(Pose(np.array([0.1, -0.05, 0.2]), rotation_x(0.4)))
    rng = np.random.default_rng(5)
    q = np.array([random_position(robot, rng) for _ in range(40)])
    v, a = rng.uniform(-3.0, 3.0, (2, *q.shape))
    symbols = [ca.SX.sym(name, robot.dof) for name in "qva"]
    motion = ca.Function("motion", symbols, list(symbolic_motion(robot, *symbols))).map(len(q))
    torques, tool_velocity, tool_spin = (np.array(value).T for value in motion(q.T, v.T, a.T))
    expected = inverse_dynamics(robot, q, v, a)
    assert np.abs(expected).max() > 1e-3
    assert np.abs(torques - expected).max() <= 1e-12 * max(1.0, np.abs(expected).max())
    linear, angular = tool_speeds(robot, q, v)
    assert np.linalg.norm(tool_velocity, axis=1) == pytest.approx(linear, abs=1e-12)
    assert np.linalg.norm(tool_spin, axis=1) == pytest.approx(angular, abs=1e-12)


def test_content_tells_robots_apart() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    tool = Pose(np.array([0.0, 0.0, 0.1]), None)
    contents = [
        dynamics_content(each)
        for each in (robot, robot.with_payload(PAYLOAD), robot.with_tool(tool), load_robot("kuka_kr16_2"))
    ]
    assert len(set(contents)) == len(contents)
    assert dynamics_content(robot.with_payload(PAYLOAD)) == contents[1]
