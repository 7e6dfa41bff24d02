"""A scale on torque limits is the same as a robot whose torque limits and torque curves are that much lower."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from tests.planner.problems_of_tests import ALL_BACK_ENDS, BACK_END_NAMES

HOME = np.array([0.0, -1.2, 1.8, -0.6, 1.6, 0.3])
WAYPOINTS = [planner.JointWaypoint(HOME + step) for step in (0.0, 0.6, -0.3)]
SCALE = 0.6
SPEEDS = (0.2, 0.6, 3.0)


def _robot(scale: float, *, has_curves: bool) -> planner.Robot:
    arm = planner.load_robot("ur5e")
    torque = scale * 150.0
    limits: dict[str, dict[str, float | planner.TorqueCurve]] = {}
    for name, rated in zip(arm.joint_names, arm.limit("torque"), strict=True):
        limits[name] = {"torque": scale * float(rated)}
    if has_curves:
        curve = planner.TorqueCurve(SPEEDS, (torque, 0.7 * torque, 0.5 * torque))
        limits["shoulder_lift_joint"]["torque_curve"] = curve
    return arm.derived(id="arm", limits=limits)


@pytest.mark.long_table
@pytest.mark.parametrize("backend", ALL_BACK_ENDS, ids=BACK_END_NAMES)
@pytest.mark.parametrize("has_curves", [False, True])
def test_a_scale_is_a_weaker_robot(backend: planner.BackEnd, has_curves: bool) -> None:
    load = planner.Payload(4.9, (0.0, 0.0, 0.1))
    scaled = planner.PlanningProblem(
        _robot(1.0, has_curves=has_curves), WAYPOINTS, limits=planner.Limits(torque_scale=SCALE), payload=load
    )
    weaker = planner.PlanningProblem(_robot(SCALE, has_curves=has_curves), WAYPOINTS, payload=load)
    plans = [planner.plan(problem, backend) for problem in (scaled, weaker)]
    assert plans[0].trajectory.duration == pytest.approx(plans[1].trajectory.duration, rel=1e-6)
    for plan in plans:
        samples = plan.samples(0.002, ["torque"])
        used = np.abs(samples.torque) / plan.path.limits.torque.upper[0]
        assert used.max() <= 1.0 + 1e-6
        if has_curves:
            share = np.interp(np.abs(samples.velocity[:, 1]), SPEEDS, (1.0, 0.7, 0.5)) * 150.0 * SCALE
            assert (np.abs(samples.torque[:, 1]) <= share * (1.0 + 1e-6)).all()


def test_scales_of_the_trajectory_and_of_a_waypoint_multiply() -> None:
    robot = _robot(1.0, has_curves=True)
    waypoints = [WAYPOINTS[0], replace(WAYPOINTS[1], limits=planner.Limits(torque_scale=0.8)), WAYPOINTS[2]]
    plan = planner.plan(planner.PlanningProblem(robot, waypoints, limits=planner.Limits(torque_scale=0.75)), "quintic")
    np.testing.assert_allclose(plan.path.limits.torque.upper, np.outer([0.6, 0.75], robot.limit("torque")))
    (curve,) = (value for own, value in plan.path.limits.further.items() if own.name == "torque_at_speed")
    np.testing.assert_allclose(curve, [0.6, 0.75])


def test_a_scale_that_gravity_exceeds_is_refused_with_a_larger_one() -> None:
    problem = planner.PlanningProblem(
        _robot(1.0, has_curves=False), WAYPOINTS, limits=planner.Limits(torque_scale=0.05)
    )
    with pytest.raises(planner.LimitsUnsatisfiable) as raised:
        planner.plan(problem, planner.Quintic())
    assert any(
        remedy.field == ("limits", "torque_scale") for remedies in [raised.value.remedies] for remedy in remedies
    )
