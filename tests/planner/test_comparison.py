"""Figures that compare plans, beyond the service's own tests."""

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
    """Joint 6 has the largest jerk, and joint 1 the largest share of its limit. A quintic's peak is 60 travel / T^3."""
    robot = load_robot("ngv_refuelling_arm")
    start, end = JointWaypoint(position=(0.0,) * 6), JointWaypoint(position=(0.5, 0, 0, 0, 0, 1.0), duration=2.0)
    result = plan(PlanningProblem(robot, (start, end)), Quintic())
    (check,) = (check for check in result.certificate.checks if check.quantity == "jerk")
    assert check.joint == "joint_1"
    assert figures(result).peak_jerk == pytest.approx(60.0 * 1.0 / 2.0**3, rel=1e-9)
    assert figures(result).rms_jerk == pytest.approx(np.sqrt(720.0 * (1.0**2 + 0.5**2)) / 2.0**3, rel=1e-9)


def test_back_ends_side_by_side_with_refusals_among_them() -> None:
    """Textbook time scalings of one joint over 1 rad in 2 s: where accelerations jump, the jerk is infinite."""
    robot = load_robot("ngv_refuelling_arm")
    problem = PlanningProblem(robot, [JointWaypoint([0.0] * 6), JointWaypoint([1.0, 0, 0, 0, 0, 0], duration=2.0)])
    backends = [Quintic(), MinEffort(), Cubic(), Trapezoidal()]
    compared = compare(problem, iter(backends))
    assert [one.backend for one in compared] == backends
    peaks = [None if one.figures is None else one.figures.peak_jerk for one in compared]
    assert peaks == [pytest.approx(60.0 / 8.0), None, np.inf, np.inf]
    assert [None if one.figures is None else one.figures.rms_jerk for one in compared][1:] == [None, np.inf, np.inf]
    for one in compared:
        assert (one.plan is None) == (one.figures is None) == isinstance(one.refusal, MissingDynamics)
        if one.plan is not None and one.figures is not None:
            assert one.plan.trajectory.duration == pytest.approx(one.figures.duration) == pytest.approx(2.0)


def test_efforts_of_different_durations_are_compared_by_their_mean() -> None:
    """Holding still costs the same in each second: twice the duration has twice the effort, and the same mean."""
    robot = load_robot("kuka_kr16_2")
    held = JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    short, long = (figures(plan(PlanningProblem(robot, [held], duration=seconds), Quintic())) for seconds in (1.0, 2.0))
    assert short.effort is not None and long.effort is not None
    assert long.effort == pytest.approx(2.0 * short.effort)
    assert long.effort > 0.0
    assert long.mean_effort == pytest.approx(short.mean_effort) == pytest.approx(short.effort)
