"""Tolerances agree with each other: the certificate accepts every plan that a back end accepts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import BACKENDS
from planner.errors import InfeasibleDuration
from planner.kinematics import Pose, forward_kinematics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointMotion, JointWaypoint, LinearMotion, Motion, PlanningProblem, PoseWaypoint
from planner.robots import load_robot
from planner.tolerances import DURATION_TOLERANCE, LIMIT_TOLERANCE

BACK_ENDS: dict[str, tuple[str, dict[str, object]]] = {
    "cubic": ("cubic", {}),
    "quintic": ("quintic", {}),
    "trapezoidal": ("trapezoidal", {}),
    "toppra": ("toppra", {}),
    "toppra, jerk limited": ("toppra", {"jerk_limited": True}),
    "ruckig": ("ruckig", {}),
    "ruckig, time": ("ruckig", {"synchronization": "time"}),
}
"""Back ends that repeat the same motion when given its shortest duration, with their options."""


@pytest.mark.long_table
@pytest.mark.parametrize("motion", [JointMotion(), LinearMotion()], ids=["joint", "linear"])
@pytest.mark.parametrize("name", BACK_ENDS)
def test_a_duration_a_little_too_short_is_planned_or_refused_as_a_duration(name: str, motion: Motion) -> None:
    """Short by 9e-10, it passed the back end, and the certificate refused 6.80678 rad/s^2 for a limit of 6.80678."""
    kind, options = BACK_ENDS[name]
    robot, start = load_robot("kuka_kr16_2"), np.array([0.1, -1.2, 1.4, 0.2, 0.5, 0.1])
    home = forward_kinematics(robot, start[None])[0]
    goal = PoseWaypoint(pose=Pose(home.position + np.array([0.2, 0.1, -0.1]), home.rotation), motion=motion)
    first, backend = JointWaypoint(position=tuple(start.tolist())), BACKENDS[kind](**options)
    shortest = plan(PlanningProblem(robot, (first, goal)), backend).trajectory.duration

    def plan_shorter_by(share: float) -> Plan:
        asking = replace(goal, duration=shortest * (1.0 - share))
        return plan(PlanningProblem(robot, (first, asking)), backend)

    assert plan_shorter_by(0.9 * DURATION_TOLERANCE).trajectory.duration < shortest
    for share in (9.0 * DURATION_TOLERANCE, 0.9 * LIMIT_TOLERANCE, 2.0 * LIMIT_TOLERANCE):
        with pytest.raises(InfeasibleDuration) as refusal:
            plan_shorter_by(share)
        assert refusal.value.limit == pytest.approx(shortest, rel=2.0 * DURATION_TOLERANCE)
