"""Limits of the tool on one segment, while the profile is refined on the intervals of others."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.robots import load_robot
from planner.spatial import Pose, rotation_from_rpy

ROBOT = load_robot("kuka_kr16_2")
HOME = [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]


@pytest.mark.parametrize("seed", range(8))
def test_a_limit_of_the_tool_on_one_segment(seed: int) -> None:
    """Seed 2 ended in an internal error: intervals without the limit had fewer rows than the limited ones."""
    rng = np.random.default_rng(seed)
    start = planner.tool_pose(ROBOT, HOME)
    count = int(rng.integers(2, 4))
    limited, is_joint_motion = int(rng.integers(0, count)), rng.random() < 0.5
    waypoints: list[planner.Waypoint] = [planner.JointWaypoint(HOME)]
    for k in range(count):
        turn = rotation_from_rpy(*rng.uniform(-0.6, 0.6, 3))
        goal = Pose(start.position + rng.uniform(-0.2, 0.2, 3), np.asarray(start.rotation) @ turn)
        is_last = k == count - 1
        waypoints.append(
            planner.PoseWaypoint(
                goal,
                motion=planner.JointMotion() if is_joint_motion and k == limited else planner.LinearMotion(),
                transition=planner.StopTransition()
                if is_last
                else planner.BlendTransition(rng.random() and float(rng.choice([0.002, 0.02]))),
                limits=planner.Limits(tcp_angular_acceleration=float(rng.choice([1.0, 8.0]))) if k == limited else None,
            )
        )
    planned = planner.plan(planner.PlanningProblem(ROBOT, waypoints), "toppra")
    assert planned.certificate.satisfied
    assert any(check.quantity == "tcp_angular_acceleration" for check in planned.certificate.checks)
