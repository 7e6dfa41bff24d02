"""Free motions of a cell that make way where waits do not help: clearances at dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from tests.planner.cells.arms import MARGIN, REACH
from tests.planner.cells.brute_force import facing_capsule_arms, least_distance, robot_world

NEAR = [REACH[0] + 0.05, *REACH[1:]]
"""A joint position near one that reaches forwards."""


def in_the_way(apart: float, turn: float, *, is_free: bool = True) -> tuple[planner.CellRobot, planner.CellRobot]:
    """Return an arm that always reaches forwards, and one that swings across it."""
    first, second = facing_capsule_arms(apart)
    motion = planner.FreeMotion() if is_free else planner.JointMotion()
    ends = [planner.JointWaypoint([REACH[0] + side * turn, *REACH[1:]], motion=motion) for side in (-1.0, 1.0)]
    stays = planner.PlanningProblem(first, [REACH, NEAR, REACH], self_collision=False)
    swings = planner.PlanningProblem(second, [replace(ends[0], motion=planner.JointMotion()), ends[1]])
    return planner.CellRobot("a", stays), planner.CellRobot("b", replace(swings, self_collision=False))


@pytest.mark.parametrize(
    ("apart", "turn", "skew"),
    [
        (1.5, 0.9, 0.0),
        *(pytest.param(*case, marks=pytest.mark.large_only) for case in ((1.4, 0.9, 0.1), (1.6, 1.2, 0.0))),
    ],
)
def test_a_free_motion_makes_way_where_no_waits_help(apart: float, turn: float, skew: float) -> None:
    with pytest.raises(planner.Collision, match="no waits where the robots rest keep them apart"):
        planner.plan_cell(in_the_way(apart, turn, is_free=False), margin=MARGIN, skew=skew)
    stays, swings = in_the_way(apart, turn)
    cell = planner.plan_cell([stays, swings], margin=MARGIN, skew=skew)
    alone = planner.plan(stays.problem, stays.backend)
    assert cell.unhindered[0] == alone.trajectory.duration, "a robot without free motions keeps to its path"
    assert cell.plans[1].problem.scene is None, "the other robot is no object of the scene of its plan"
    assert cell.plans[1].detours
    for own, robot in zip(cell.plans, (stays, swings), strict=True):
        assert own.certificate.satisfied
        ends = own.trajectory.evaluate(np.array([0.0, own.trajectory.duration]), [0])[0]
        requested = [robot.problem.waypoints[k].position for k in (0, -1)]
        assert np.allclose(ends, requested, atol=1e-6)
    worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
    skews = np.linspace(-skew, skew, 3)
    assert least_distance(worlds[0], worlds[1], np.linspace(-skew, cell.duration + skew, 80), skews) > MARGIN - 2e-5


def test_robots_whose_waits_suffice_do_not_search_other_paths() -> None:
    stays, swings = in_the_way(2.4, 0.7)
    cell = planner.plan_cell([stays, swings], margin=MARGIN)
    alone = planner.plan(swings.problem, swings.backend)
    assert np.array_equal(cell.plans[1].trajectory.coefficients, alone.trajectory.coefficients)


def test_a_goal_where_another_robot_ends_is_refused() -> None:
    stays, swings = in_the_way(1.5, 0.7)
    there = replace(swings.problem.waypoints[1], position=tuple(REACH))
    problem = replace(swings.problem, waypoints=[swings.problem.waypoints[0], there])
    with pytest.raises(planner.Collision, match="no waits where the robots rest keep them apart"):
        planner.plan_cell([stays, replace(swings, problem=problem)], margin=MARGIN)
