"""The certificate of samples of any origin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Quintic
from planner.certificate.checks import Certificate, Check
from planner.certificate.samples import certify_samples
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.limits import Limits
from planner.planning import plan
from planner.robots import load_robot
from tests.planner.problems_of_tests import problem_of


def check_of(certificate: Certificate, quantity: str) -> Check:
    return next(check for check in certificate.checks if check.quantity == quantity)


def test_samples_of_our_own_quintic_pass_and_agree_with_its_certificate() -> None:
    result = plan(problem_of("ngv_refuelling_arm", 1, 5), Quintic())
    time = result.trajectory.sample_times(0.01)
    position, velocity, acceleration = result.trajectory.evaluate(time)
    certificate = certify_samples(result.path.robot, time, position, velocity, acceleration)
    for quantity in ("position", "velocity", "acceleration"):
        assert check_of(certificate, quantity).peak == pytest.approx(
            check_of(result.certificate, quantity).peak, rel=1e-3
        )
    assert certificate.continuity == "C2"
    assert certificate.waypoint_error == 0.0


def test_samples_run_faster_break_the_limits_by_the_powers_of_the_factor() -> None:
    problem = problem_of("ngv_refuelling_arm", 1, 5)
    # Whole samples a segment: then the controller's cubics are the planner's.
    waypoints = tuple(replace(w, duration=6.0 if i else None) for i, w in enumerate(problem.waypoints))
    result = plan(replace(problem, waypoints=waypoints))
    time = result.trajectory.sample_times(0.01)
    position, velocity = result.trajectory.evaluate(time, [0, 1])
    certificate = certify_samples(result.path.robot, time, position, velocity)
    assert certificate.satisfied
    hurried = certify_samples(result.path.robot, time / 4.0, position, velocity * 4.0)
    assert not hurried.satisfied
    for quantity, factor in (("velocity", 4.0), ("acceleration", 16.0)):
        expected = factor * (check_of(result.certificate, quantity).ratio or 0.0)
        assert check_of(hurried, quantity).ratio == pytest.approx(expected, rel=1e-6)


def test_positions_alone_are_run_as_straight_lines() -> None:
    robot = load_robot("three_dof_arm")
    time, position = np.array([0.0, 1.0, 3.0]), np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0.4, 0]], float)
    certificate = certify_samples(robot, time, position)
    assert check_of(certificate, "velocity").peak == pytest.approx(0.5)
    assert not check_of(certificate, "acceleration").bounded
    assert not check_of(certificate, "acceleration").enforced
    assert certificate.continuity == "C0"


@pytest.mark.parametrize(
    ("time", "position", "field"),
    [
        ([0.0], [[0, 0, 0]], ("samples", "time")),
        ([0.0, 1.0, 1.0], [[0, 0, 0]] * 3, ("samples", "time", 2)),
        ([0.0, 1.0], [[0, 0, 0]] * 3, ("samples", "position")),
        ([0.0, 1.0], [[0, 0]] * 2, ("samples", "position")),
        ([0.0, np.nan], [[0, 0, 0]] * 2, ("samples", "time")),
        ([0.0, np.inf], [[0, 0, 0]] * 2, ("samples", "time")),
        ([0.0, 1.0], [[0, 0, 0], [0, np.nan, 0]], ("samples", "position")),
    ],
)
def test_samples_that_do_not_fit_are_refused(time: list[float], position: list[list[float]], field: FieldPath) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        certify_samples(load_robot("three_dof_arm"), np.array(time), np.array(position, float))
    assert refusal.value.faults[0][0] == field


def test_limits_wider_than_the_robot_are_refused() -> None:
    problem = problem_of("ngv_refuelling_arm", 1, 3)
    wide = tuple((2.0 * problem.robot.limit("velocity")).tolist())
    with pytest.raises(InvalidProblem) as refusal:
        plan(replace(problem, limits=Limits(velocity=wide, jerk=(1.0,))))
    assert [field for field, _ in refusal.value.faults] == [("limits", "velocity", i) for i in range(6)] + [
        ("limits", "jerk")
    ]
