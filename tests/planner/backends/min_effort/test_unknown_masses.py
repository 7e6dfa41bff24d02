"""Least effort where masses of links or torque limits are unknown: no worse than the quintic, and as smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import MinEffort, Quintic
from planner.backends.min_effort.cost import Cost, Objective
from planner.dynamics import inverse_dynamics
from planner.kinematics import FloatArray, forward_kinematics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import ExternalAxis, Robot, load_robot
from planner.robots.payload import Payload
from planner.spatial import Pose

KNOTS = 16
SAMPLES = np.linspace(0.0, 5.0, 5001)
RAIL = ExternalAxis("rail", "prismatic", (1.0, 0.0, 0.0), lower=0.0, upper=3.0, velocity=1.0, mass=60.0)
ARMS = {
    "date_sorting_arm": load_robot("date_sorting_arm"),
    "on a rail with a mass": load_robot("ngv_refuelling_arm").derived(id="on_a_rail", external_axes=[RAIL]),
}


def positions(robot: Robot, seed: int, count: int) -> FloatArray:
    """Return random joint positions, not near to the limits."""
    lower, upper = (np.clip(robot.limit(side), -np.pi, np.pi) for side in ("lower", "upper"))
    return lower + (upper - lower) * np.random.default_rng(seed).uniform(0.2, 0.8, (count, robot.dof))


def energy_and_jerk(made: Plan) -> tuple[float, float, float]:
    """Return the integral of the summed |torque x velocity|, J, and integral and peak of the jerk, by samples."""
    q, dq, ddq, jerk = made.trajectory.evaluate(SAMPLES, [0, 1, 2, 3])
    torque = inverse_dynamics(made.path.robot, q, dq, ddq)
    energy = np.trapezoid(np.abs(torque * dq).sum(axis=1), SAMPLES)
    return float(energy), float(np.trapezoid((jerk**2).sum(axis=1), SAMPLES)), float(np.abs(jerk).max())


@pytest.mark.long_table
@pytest.mark.parametrize("objective", ["effort", "mechanical_work"])
@pytest.mark.parametrize("arm", sorted(ARMS))
def test_without_masses_the_motion_costs_no_more_energy_and_is_as_smooth_as_the_quintic(
    arm: str, objective: Objective
) -> None:
    """For 1 kg in 5 s, a sum of N^2 and (N m)^2 fell by 0.9 % at twice the energy and 75 times the jerk."""
    robot = ARMS[arm]
    waypoints = [JointWaypoint(position) for position in positions(robot, 1, 2)]
    problem = PlanningProblem(robot, waypoints, payload=Payload(1.0), duration=5.0)
    energy, jerk, peak = energy_and_jerk(plan(problem, Quintic()))
    made = plan(problem, MinEffort(objective=objective, knots=KNOTS, max_deviation=None))
    found = energy_and_jerk(made)
    assert found[0] <= 1.1 * energy
    assert found[1] <= 2.5 * jerk
    assert found[2] <= 4.0 * peak
    said = {warning.code: warning.message for warning in made.warnings}
    assert "effort_incomplete" in said
    (unchecked,) = [said[code] for code in ("payload_only", "torque_unchecked") if code in said]
    assert unchecked.endswith("has no torque limits: no torque is checked")


@pytest.mark.parametrize("objective", ["effort", "mechanical_work"])
def test_without_masses_a_law_along_a_line_is_as_smooth_as_the_quintic(objective: Objective) -> None:
    robot = ARMS["date_sorting_arm"]
    (start,) = positions(robot, 1, 1)
    (pose,) = forward_kinematics(robot, start[None])
    goal = Pose(pose.position + np.array([0.03, -0.05, 0.06]), pose.rotation)
    waypoints = [JointWaypoint(start), PoseWaypoint(goal, motion=LinearMotion())]
    problem = PlanningProblem(robot, waypoints, payload=Payload(1.0), duration=5.0)
    energy, jerk, _ = energy_and_jerk(plan(problem, Quintic()))
    found = energy_and_jerk(plan(problem, MinEffort(objective=objective)))
    assert found[0] <= 1.1 * energy
    assert found[1] <= 2.5 * jerk


def test_torques_and_forces_without_limits_are_each_measured_by_the_first_motion() -> None:
    """The second and third joints slide; no N is compared with an N m."""
    robot = ARMS["date_sorting_arm"].with_payload(Payload(1.0, (0.1, 0.0, 0.0)))
    waypoints = [JointWaypoint(position) for position in positions(robot, 2, 2)]
    first = plan(PlanningProblem(robot, waypoints, duration=5.0), Quintic()).trajectory
    torque = np.abs(inverse_dynamics(robot, *first.evaluate(SAMPLES)))
    units = Cost(robot, "effort", first).units[0]
    assert units[[1, 2]] == pytest.approx(torque[:, [1, 2]].max(), rel=0.02)
    assert units[[0, 3, 4, 5]] == pytest.approx(torque[:, [0, 3, 4, 5]].max(), rel=0.02)


def test_a_joint_without_a_torque_limit_counts_like_the_strongest_of_its_kind() -> None:
    robot = load_robot("kuka_kr16_2")
    joints = (replace(robot.joints[0], torque=np.inf), *robot.joints[1:])
    waypoints = [JointWaypoint(position) for position in positions(robot, 2, 2)]
    first = plan(PlanningProblem(robot, waypoints), Quintic()).trajectory
    units = Cost(replace(robot, joints=joints), "effort", first).units[0]
    assert units[0] == units[1:].max()
    assert (units[1:] == robot.limit("torque")[1:]).all()


def test_a_plan_says_that_a_robot_with_masses_has_no_torque_limits() -> None:
    robot = load_robot("kuka_kr16_2")
    without = replace(robot, joints=tuple(replace(joint, torque=np.inf) for joint in robot.joints))
    waypoints = [JointWaypoint(position) for position in positions(robot, 2, 2)]
    assert "torque_unchecked" not in [warning.code for warning in plan(PlanningProblem(robot, waypoints)).warnings]
    assert "torque_unchecked" in [warning.code for warning in plan(PlanningProblem(without, waypoints)).warnings]
