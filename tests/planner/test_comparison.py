"""Figures by which plans are compared, where the service's own tests do not reach."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import Quintic
from planner.comparison import figures
from planner.planning import plan
from planner.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot


def test_peak_jerk_is_that_of_any_joint_not_of_the_one_nearest_to_its_limit() -> None:
    """Joint 6 has the largest jerk, joint 1 the largest share of its limit. A quintic's peak is 60 travel / T^3."""
    robot = load_robot("ngv_refuelling_arm")
    start, end = JointWaypoint(position=(0.0,) * 6), JointWaypoint(position=(0.5, 0, 0, 0, 0, 1.0), duration=2.0)
    result = plan(PlanningProblem(robot, (start, end)), Quintic())
    (check,) = (check for check in result.certificate.checks if check.quantity == "jerk")
    assert check.joint == "joint_1"
    assert figures(result).peak_jerk == pytest.approx(60.0 * 1.0 / 2.0**3, rel=1e-9)
    assert figures(result).rms_jerk == pytest.approx(np.sqrt(720.0 * (1.0**2 + 0.5**2)) / 2.0**3, rel=1e-9)
