"""Optimised durations that begin at another trajectory: of an earlier plan, of another origin, or useless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from benchmarks.trajectories.off_path import REGION, through_poses
from planner.planning.off_path.descent import Points
from planner.planning.off_path.open_waypoints import open_waypoints
from planner.planning.off_path.warm_start import points_on
from planner.problems.regions import Region
from planner.spatial import rotation_from_rpy

ROBOT, UR5E = planner.load_robot("fr3"), planner.load_robot("ur5e")
DOWN = np.diag([1.0, -1.0, -1.0])
START, END = [-0.5, 0.3, -0.2, -2.2, 0.1, 2.4, 0.6], [1.0, 0.4, -0.3, -1.4, 0.3, 1.9, 1.2]
PICK = planner.PoseWaypoint(planner.Pose([0.4, -0.3, 0.4], DOWN), free=Region(rotation_z=(-3.0, 3.0)))
PROBLEM = planner.PlanningProblem(ROBOT, [START, PICK, END])


def optimised(iterates: int, warm_start: planner.Trajectory | None = None) -> planner.Plan:
    problem = replace(PROBLEM, optimise="duration", optimise_iterates=iterates, warm_start=warm_start)
    return planner.plan(problem, "trapezoidal")


def through(*positions: np.ndarray | list[float]) -> planner.Trajectory:
    """Return straight lines through joint positions, one a second."""
    return planner.interpolated(ROBOT, np.arange(len(positions)), np.array(positions), interpolation="linear")


def solved(pose: planner.Pose, near: np.ndarray) -> np.ndarray:
    """Return the joint position at a pose nearest to one."""
    return np.array(planner.inverse_kinematics(ROBOT, pose, reference=tuple(near.tolist())).position)


def test_one_iterate_from_an_earlier_plan_is_as_short_as_that() -> None:
    """Its samples say where it stopped, within the regions of four waypoints."""
    problem = replace(through_poses(UR5E, 3, 4, planner.StopTransition(), REGION), optimise="duration")
    earlier = planner.plan(replace(problem, optimise_iterates=20), "trapezoidal").trajectory
    one = replace(problem, optimise_iterates=1)
    times = earlier.sample_times(0.01)
    sampled = planner.interpolated(UR5E, times, *earlier.evaluate(times, [0, 1, 2]))
    again = planner.plan(replace(one, warm_start=sampled), "trapezoidal")
    assert again.trajectory.duration <= earlier.duration * (1.0 + 1e-5)
    assert again.trajectory.duration < 0.99 * planner.plan(one, "trapezoidal").trajectory.duration
    assert again.certificate.satisfied


def test_the_best_of_other_solutions_is_taken_from_a_line_of_another_origin() -> None:
    """Brute force over the turns of the tool and many solutions finds a joint position near the best."""
    random = np.random.default_rng(3)
    best = (np.inf, np.zeros(7))
    for turn in np.linspace(-3.0, 3.0, 25).tolist():
        turned = planner.Pose(PICK.pose.position, DOWN @ rotation_from_rpy(0.0, 0.0, turn))
        position = solved(turned, (np.array(START) + END) / 2.0 + random.normal(scale=0.3, size=7))
        plan = planner.plan(planner.PlanningProblem(ROBOT, [START, position, END]), "trapezoidal")
        best = min(best, (plan.trajectory.duration, position), key=lambda one: one[0])
    near = best[1] + 1e-3
    plan = optimised(2, through(START, near, END))
    assert plan.trajectory.duration <= best[0] * (1.0 + 1e-3)


@pytest.mark.parametrize("positions", [[START, START], [END, START], [[0.1] * 7, [-0.1] * 7]])
def test_a_useless_trajectory_does_no_harm(positions: list[list[float]]) -> None:
    plan = optimised(5, through(*positions))
    assert plan.trajectory.duration <= planner.plan(PROBLEM, "trapezoidal").trajectory.duration
    reached = planner.forward_kinematics(ROBOT, plan.trajectory.at_arrivals[1])
    assert reached.position == pytest.approx(PICK.pose.position, abs=3e-6)


def test_waypoints_are_met_in_order_where_a_trajectory_passes_a_pose_twice() -> None:
    """Both waypoints have one pose, reached with the last joint on one side first, then on the other."""
    turns = [PICK.pose, planner.Pose(PICK.pose.position, DOWN @ np.diag([-1.0, -1.0, 1.0]))]
    first, second = (solved(pose, np.array(START)) for pose in turns)
    problem = planner.PlanningProblem(ROBOT, [START, PICK, START, PICK, END])
    positions = np.array([START, first, START, first, END])
    found = open_waypoints(problem, positions)
    points = Points([(one, one.index) for one in found], tuple(found.values()), positions)
    for order in ([first, second], [second, first]):
        moved = points_on(through(START, order[0], START, order[1], END), points)
        assert moved is not None
        assert moved.positions[[1, 3]] == pytest.approx(np.array(order), abs=0.3)


@pytest.mark.parametrize(
    ("problem", "field"),
    [
        (replace(PROBLEM, warm_start=through(START, END)), ("warm_start",)),
        (
            replace(
                planner.PlanningProblem(UR5E, ["home", "home"], optimise="duration"),
                warm_start=through(START, END),
            ),
            ("warm_start",),
        ),
    ],
)
def test_fault_names_the_warm_start(problem: planner.PlanningProblem, field: tuple[str, ...]) -> None:
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.plan(problem)
    assert field in [fault.field for fault in refused.value.faults]
