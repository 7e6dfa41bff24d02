"""Figures by which plans are compared, where the service's own tests do not reach."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import Cubic, MinEffort, Quintic, Trapezoidal
from planner.comparison import compare, figures
from planner.errors import MissingDynamics
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
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


def test_back_ends_side_by_side_with_refusals_among_them() -> None:
    """The laws of the books on one joint that moves by 1 rad in 2 s: the jerk of each."""
    robot = load_robot("ngv_refuelling_arm")
    problem = PlanningProblem(robot, [JointWaypoint([0.0] * 6), JointWaypoint([1.0, 0, 0, 0, 0, 0], duration=2.0)])
    backends = [Quintic(), MinEffort(), Cubic(), Trapezoidal()]
    compared = compare(problem, iter(backends))
    assert [one.backend for one in compared] == backends
    peaks = [None if one.figures is None else one.figures.peak_jerk for one in compared]
    assert peaks == [pytest.approx(60.0 / 8.0), None, pytest.approx(12.0 / 8.0), pytest.approx(0.0, abs=1e-9)]
    for one in compared:
        assert (one.plan is None) == (one.figures is None) == isinstance(one.refusal, MissingDynamics)
        if one.plan is not None and one.figures is not None:
            assert one.plan.trajectory.duration == pytest.approx(one.figures.duration) == pytest.approx(2.0)
