"""The estimated duration, compared with back ends and with finite differences of the kinematics."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from benchmarks.trajectories.off_path import REGION, through_poses, trapezoidal_duration
from planner.planning.off_path.leg_times import LegTimes
from planner.planning.off_path.open_waypoints import open_waypoints
from planner.problems.transitions import ThroughTransition

UR5E, PANDA = planner.load_robot("ur5e"), "panda"
"""An arm, and a redundant one with constant limits, of the extra `robots`: without that its tests are skipped."""


@pytest.mark.parametrize("seed", range(5))
def test_the_estimate_is_the_duration_of_trapezoids_from_stop_to_stop(seed: int) -> None:
    """Two closed forms and the back end agree where all waypoints are stops."""
    panda = planner.load_robot(PANDA)
    plan = planner.plan(through_poses(panda, seed, 3), "trapezoidal")
    estimate = float(LegTimes(plan.path, keeps_jerk=False)(plan.path.positions).total)
    assert estimate == pytest.approx(plan.trajectory.duration, rel=1e-9)
    assert estimate == pytest.approx(trapezoidal_duration(panda, plan.path.positions), rel=1e-9)


def test_the_estimate_is_shorter_without_stops_and_longer_with_jerk_limits() -> None:
    """Passing waypoints saves time, and jerk limits cost time."""
    stops, passed = (
        planner.plan(through_poses(UR5E, 0, 3, *more), "trapezoidal") for more in ((), (ThroughTransition(),))
    )
    totals = [float(LegTimes(plan.path, keeps_jerk=False)(stops.path.positions).total) for plan in (stops, passed)]
    assert totals[1] < totals[0]
    assert LegTimes(stops.path, keeps_jerk=True)(stops.path.positions).total > totals[0]


@pytest.mark.long_table
@pytest.mark.parametrize(("name", "free"), [("fr3", None), ("ur5e", REGION), (PANDA, REGION)])
def test_open_waypoints_move_within_their_poses(name: str, free: planner.Region | None) -> None:
    """Tangents keep the pose to first order, and returned coordinates keep it within the tolerances."""
    robot = planner.load_robot(name)
    problem = through_poses(robot, 1, 3, free=free)
    path = planner.plan(problem, "trapezoidal").path
    found = open_waypoints(problem, path.positions)
    assert [one.index for one in found] == [1, 2, 3]
    for one, coordinates in found.items():
        assert one.position(coordinates) == pytest.approx(path.positions[one.index], abs=1e-12)
        tangent = one.tangent(coordinates)
        assert len(tangent) == robot.dof - 6 + (0 if free is None else 2)
        for direction in tangent:
            assert one.search.miss(coordinates + 1e-4 * direction) < 1e-7
            moved = one.returned(coordinates + 0.05 * direction)
            if moved is None:
                continue
            pose = planner.forward_kinematics(robot, one.position(moved))
            wanted = problem.waypoints[one.index]
            assert isinstance(wanted, planner.PoseWaypoint)
            offsets = {} if free is None else free.offsets(wanted.pose, pose)
            reached = wanted.pose if free is None else free.pose(wanted.pose, np.array([*offsets.values()]))
            assert pose.position == pytest.approx(reached.position, abs=2e-6)
            assert pose.rotation == pytest.approx(reached.rotation, abs=2e-6)
            assert all(
                low - 1e-6 <= offsets[name] <= high + 1e-6
                for name, (low, high) in (free.ranges if free else {}).items()
            )


@pytest.mark.large_only
def test_nothing_is_open_with_joint_waypoints_isolated_poses_or_a_preference() -> None:
    """Six joints leave nothing of a pose open, and a preference decides the joint position itself."""
    isolated = through_poses(UR5E, 0, 2)
    assert not open_waypoints(isolated, planner.plan(isolated, "trapezoidal").path.positions)
    options = planner.InverseKinematicsOptions(prefer="manipulability")
    fr3 = planner.load_robot("fr3")
    preferred = planner.PlanningProblem(fr3, through_poses(fr3, 0, 2).waypoints, inverse_kinematics=options)
    assert not open_waypoints(preferred, planner.plan(preferred, "trapezoidal").path.positions)
