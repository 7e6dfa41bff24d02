"""No part of the library plans or certifies beyond the limits of the robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import planner
from planner.limits import segment_limits

if TYPE_CHECKING:
    from collections.abc import Callable

ROBOT = planner.load_robot("ur5e")
POINTS = [planner.JointWaypoint([0.0] * 6), planner.JointWaypoint([0.5] * 6)]
PROBLEM = planner.PlanningProblem(ROBOT, POINTS)
TRAJECTORY = planner.plan(PROBLEM).trajectory
TIME = np.linspace(0.0, TRAJECTORY.duration, 50)

WIDER = {
    "velocity_scale": planner.Limits(velocity_scale=2.0),
    "acceleration_scale": planner.Limits(acceleration_scale=3.0),
    "torque_scale": planner.Limits(torque_scale=1.1),
    "a scale that is no number": planner.Limits(velocity_scale=float("nan")),
    "velocity": planner.Limits(velocity=tuple(2.0 * ROBOT.limit("velocity"))),
    "acceleration": planner.Limits(acceleration=tuple(1.01 * ROBOT.limit("acceleration"))),
    "jerk": planner.Limits(jerk=tuple(1.01 * ROBOT.limit("jerk"))),
    "velocity_range": planner.Limits(velocity_range=tuple((-9.0, 1.0) for _ in range(6))),
}

DOORS: dict[str, Callable[[planner.Limits], Any]] = {
    "plan": lambda limits: planner.plan(replace(PROBLEM, limits=limits)),
    "plan one segment": lambda limits: planner.plan(
        replace(PROBLEM, waypoints=[POINTS[0], replace(POINTS[1], limits=limits)])
    ),
    "certify": lambda limits: planner.certify(ROBOT, TRAJECTORY, limits=limits),
    "certify_samples": lambda limits: planner.certify_samples(
        ROBOT, TIME, TRAJECTORY.evaluate(TIME, [0])[0], limits=limits
    ),
    "retime": lambda limits: planner.retime_trajectory(ROBOT, TRAJECTORY.evaluate(TIME, [0])[0], limits=limits),
    "reverse": lambda limits: planner.reverse_trajectory(ROBOT, TRAJECTORY, limits=limits),
    "resample": lambda limits: planner.resample_trajectory(ROBOT, TRAJECTORY, TIME, limits=limits),
    "stop_joints": lambda limits: planner.stop_joints(
        ROBOT, planner.JointState(np.zeros(6), np.full(6, 0.1), np.zeros(6)), limits=limits
    ),
    "resolve": lambda limits: segment_limits(ROBOT, limits, (None,)),
    "resolve one segment": lambda limits: segment_limits(ROBOT, planner.Limits(), (None, limits)),
}


@pytest.mark.parametrize("limits", WIDER.values(), ids=list(WIDER))
@pytest.mark.parametrize("door", DOORS.values(), ids=list(DOORS))
def test_limits_wider_than_those_of_the_robot_are_refused(
    door: Callable[[planner.Limits], Any], limits: planner.Limits
) -> None:
    with pytest.raises(planner.InvalidProblem, match=r"limits\."):
        door(limits)
