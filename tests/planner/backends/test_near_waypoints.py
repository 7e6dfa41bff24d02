"""Passed waypoints next to each other, some joints at rest: every back end plans them, about as fast as with stops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import BackEnd, Cubic, Quintic, Ruckig, Toppra, Trapezoidal
from planner.kinematics import forward_kinematics
from planner.planning import plan
from planner.problems.moves import CylindricalMove
from planner.problems.problem import (
    AnyWaypoint,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import load_robot
from planner.spatial import Pose
from tests.planner.backends.ruckig.ruckig_problems import passing

BACK_ENDS = [Cubic(), Quintic(), Trapezoidal(), Ruckig(), Toppra(), Toppra(jerk_limited=True)]


@pytest.mark.parametrize("backend", BACK_ENDS, ids=repr)
def test_case_500_through_1e_9(backend: BackEnd) -> None:
    """The second waypoint, 1e-9 rad from the first, is passed: the search for durations ended in an error."""
    first = [
        1.3530053941033573,
        -1.1685315332445814,
        -2.7859724283734235,
        -2.294900548584037,
        -0.08414370027944057,
        -2.0986919288270913,
    ]
    second = [
        1.3530053942165565,
        -1.1685315332143658,
        -2.785972428191305,
        -2.2949005488139336,
        -0.084143699007841,
        -2.098691928305537,
    ]
    rotation = [
        [0.9972108857433788, -0.012352031217907788, 0.07360622718016233],
        [-0.04252865461609773, 0.7163975426521341, 0.6963949126885753],
        [-0.06133321197728442, -0.6975829615226965, 0.7138741127830409],
    ]
    last = Pose(np.array([-0.012388257883995321, 1.2281917209945186, 0.5018654317524006]), np.array(rotation))
    move = CylindricalMove(0.042825131385108836, -0.19255915612957641, -0.012749117933204789)
    waypoints: tuple[AnyWaypoint, ...] = (
        JointWaypoint(tuple(first)),
        JointWaypoint(tuple(second), transition=ThroughTransition()),
        RelativeWaypoint(frame="base", move=move, transition=BlendTransition(0.00347781398431333)),
        PoseWaypoint(last),
    )
    assert plan(PlanningProblem(load_robot("welding_arm"), waypoints), backend).certificate.satisfied


@pytest.mark.long_table
@pytest.mark.parametrize("distance", [3e-9, 1e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("robot_id", ["ur5", "welding_arm"])
def test_near_waypoints_are_passed_by_every_back_end(robot_id: str, distance: float) -> None:
    """The time scaling along a smooth curve through them took 11 times as long as Ruckig."""
    robot, rng = load_robot(robot_id), np.random.default_rng(1)
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    for _ in range(2):
        positions = rng.uniform(0.8 * lower, 0.8 * upper, (4, robot.dof))
        moving = np.sort(rng.permutation(robot.dof)[robot.dof // 2 :])
        still = np.setdiff1d(np.arange(robot.dof), moving)
        positions[:, still] = positions[0, still]
        near = int(rng.integers(1, 4))
        away = rng.uniform(1.0, 2.0, len(moving)) * rng.choice([-1.0, 1.0], len(moving))
        positions[near, moving] = positions[near - 1, moving] + distance * away
        problem = passing(PlanningProblem(robot, tuple(JointWaypoint(tuple(q)) for q in positions.tolist())))
        plans = {repr(backend): plan(problem, backend) for backend in BACK_ENDS}
        assert all(found.certificate.satisfied for found in plans.values())
        along, free = (plans[repr(kind)].trajectory.duration for kind in (Toppra(jerk_limited=True), Ruckig()))
        assert along <= 1.3 * free


NEAR_UR5 = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])


def mixed(order: str, distance: float) -> tuple[list[JointWaypoint], list[JointWaypoint]]:
    """Return waypoints passed (t), blended (b) or stopped at (s), and the same with stops only.

    A small letter stands for a waypoint near the one before.
    """
    rng = np.random.default_rng(1)
    waypoints = [JointWaypoint(NEAR_UR5)]
    for letter in [*order, "S"]:
        away = rng.uniform(-0.4, 0.4, 6) if letter.isupper() else distance * rng.choice([-1.0, 1.0], 6)
        transition = {"t": ThroughTransition(), "b": BlendTransition(0.03), "s": StopTransition()}[letter.lower()]
        waypoints.append(JointWaypoint(np.array(waypoints[-1].position) + away, transition=transition))
    return waypoints, [replace(waypoint, transition=StopTransition()) for waypoint in waypoints]


@pytest.mark.long_table
@pytest.mark.parametrize("order", ["Tb", "Bt", "b", "Bs", "Tbt", "Ttb", "Bbt", "TtB", "BtB"])
@pytest.mark.parametrize("distance", [3e-9, 1e-4])
def test_blends_beside_other_waypoints_are_about_as_fast_as_stops(order: str, distance: float) -> None:
    """A blend 1e-9 rad beside a passed waypoint took 772 s, other orders up to 6 hours, or ended in an error."""
    robot = load_robot("ur5")
    passed, stopped = (PlanningProblem(robot, tuple(waypoints)) for waypoints in mixed(order, distance))
    for backend in (Cubic(), Quintic(), Trapezoidal(), Ruckig(), Toppra()):
        found = plan(passed, backend)
        assert found.certificate.satisfied
        assert found.trajectory.duration <= 1.5 * plan(stopped, backend).trajectory.duration
        met = found.trajectory.evaluate(found.trajectory.arrivals, [0])[0]
        exact = [
            k for k, waypoint in enumerate(passed.waypoints) if not isinstance(waypoint.transition, BlendTransition)
        ]
        assert np.abs(met - found.path.positions)[exact].max() <= 1e-9


@pytest.mark.parametrize("distance", [1e-8, 1e-5])
def test_lines_of_no_length_are_passed_and_blended(distance: float) -> None:
    """The direction of such a line was rounding, and lines along it were refused for a corner."""
    robot = load_robot("ur5")
    (start,) = forward_kinematics(robot, [NEAR_UR5])

    def line(x: float, z: float, transition: Transition) -> PoseWaypoint:
        pose = Pose(start.position + np.array([x, 0.0, z]), start.rotation)
        return PoseWaypoint(pose, motion=LinearMotion(), transition=transition)

    through, blend, stop = ThroughTransition(), BlendTransition(0.02), StopTransition()
    for first, second, up in ((through, blend, 0.1), (through, through, 0.0), (blend, blend, 0.1)):
        waypoints = [
            JointWaypoint(NEAR_UR5),
            line(-0.1, 0.0, first),
            line(-0.1 - distance, 0.0, second),
            line(-0.2, up, stop),
        ]
        stopped = [replace(waypoint, transition=stop) for waypoint in waypoints]
        for backend in (Toppra(), Ruckig()):
            found, slower = (plan(PlanningProblem(robot, tuple(ways)), backend) for ways in (waypoints, stopped))
            assert found.trajectory.duration <= 1.2 * slower.trajectory.duration
