"""The certificate of trajectories that did not come straight from a back end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Cubic, Quintic
from planner.certificate import Certificate, Check, certify
from planner.errors import InvalidProblem, MissingDynamics
from planner.guarantees import QUANTITIES
from planner.limits import Limits
from planner.planning import plan
from planner.robots import load_robot
from planner.robots.payload import Payload
from tests.planner.problems_of_tests import problem_of


def check_of(certificate: Certificate, quantity: str) -> Check:
    return next(check for check in certificate.checks if check.quantity == quantity)


def test_a_plans_trajectory_gets_the_certificate_of_the_plan() -> None:
    result = plan(problem_of("kuka_kr16_2", 1, 4), Quintic())
    certificate = certify(result.path.robot, result.trajectory, positions=result.path.positions)
    # Only the plan knows the request, whose fields relax a limit.
    of_trajectory = [replace(check, segment=None, relaxed_by=()) for check in result.certificate.checks]
    assert list(certificate.checks) == of_trajectory
    assert certificate.waypoint_error == result.certificate.waypoint_error
    assert (certificate.satisfied, certificate.continuity) == (True, "C2")


@pytest.mark.parametrize("factor", [0.4, 0.999, 1.0, 3.0])
def test_scaled_trajectories_use_the_limits_by_the_powers_of_the_factor(factor: float) -> None:
    result = plan(problem_of("ngv_refuelling_arm", 2, 3), Quintic())
    certificate = certify(result.path.robot, result.trajectory.scaled(factor))
    assert certificate.satisfied == (factor >= 1.0)
    for power, quantity in enumerate(("position", "velocity", "acceleration", "jerk")):
        expected = check_of(result.certificate, quantity).peak / factor**power
        assert check_of(certificate, quantity).peak == pytest.approx(expected, rel=1e-9)


def test_what_is_not_enforced_is_reported() -> None:
    result = plan(problem_of("ngv_refuelling_arm", 2, 3), Cubic())
    assert not certify(result.path.robot, result.trajectory).satisfied, "its acceleration jumps: its jerk has no bound"
    certificate = certify(result.path.robot, result.trajectory, enforced=set(QUANTITIES) - {"jerk"})
    assert certificate.satisfied
    assert [check.quantity for check in certificate.checks if not check.enforced] == ["jerk"]


def test_limits_and_loads_that_the_plan_did_not_know() -> None:
    result = plan(problem_of("kuka_kr16_2", 3, 4), Quintic())
    robot = result.path.robot
    slow = Limits(velocity_scale=0.5, tcp_linear_velocity=0.1)
    narrowed = certify(robot, result.trajectory, limits=slow)
    speed = check_of(certify(robot, result.trajectory), "velocity").ratio or 0.0
    assert check_of(narrowed, "velocity").ratio == pytest.approx(2.0 * speed)
    assert not check_of(narrowed, "tcp_linear_velocity").satisfied
    loaded = certify(robot.with_payload(Payload(16.0, (0.0, 0.0, 0.3))), result.trajectory)
    assert check_of(loaded, "torque").peak > check_of(certify(robot, result.trajectory), "torque").peak


def test_positions_that_are_missed() -> None:
    result = plan(problem_of("ngv_refuelling_arm", 2, 3), Quintic())
    missed = result.path.positions.copy()
    missed[1, 4] += 0.03
    assert certify(result.path.robot, result.trajectory, positions=missed).waypoint_error == pytest.approx(0.03)
    with pytest.raises(ValueError, match="positions of shape"):
        certify(result.path.robot, result.trajectory, positions=missed[:2])


def test_what_cannot_be_checked_is_refused() -> None:
    result = plan(problem_of("ngv_refuelling_arm", 2, 3), Quintic())
    robot, trajectory = result.path.robot, result.trajectory
    with pytest.raises(InvalidProblem):
        certify(load_robot("three_dof_arm"), trajectory)
    with pytest.raises(InvalidProblem):
        certify(robot, trajectory, limits=Limits(velocity=(1e3,) * 6))
    with pytest.raises(MissingDynamics):
        certify(robot, trajectory, limits=Limits(torque=(1.0,) * 6))
    with pytest.raises(ValueError, match="velocty: the quantities are"):
        certify(robot, trajectory, enforced=["velocty"])
    broken = trajectory.coefficients.copy()
    broken[0, 0, 0] = np.nan
    with pytest.raises(ValueError, match="not all of its coefficients are numbers"):
        certify(robot, replace(trajectory, coefficients=broken))
