"""The catalogue's notes, and the plans of arms whose joints have no limits."""

from __future__ import annotations

import json

import pytest

from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from tests.locations import ROOT

DOCUMENTS = ("ngv_refuelling_arm", "ngv_refuelling_arm_published", "three_dof_arm", "welding_arm")


@pytest.mark.parametrize("robot_id", DOCUMENTS)
def test_plans_of_the_documents_arms_say_that_no_position_is_refused(robot_id: str) -> None:
    """Positions of -189, -226 and 236 degrees were accepted without a remark."""
    robot = load_robot(robot_id)
    ends = [JointWaypoint([0.0] * robot.dof), JointWaypoint([-3.3, -3.94, 4.12][: robot.dof] + [0.0] * (robot.dof - 3))]
    (said,) = [w.message for w in plan(PlanningProblem(robot, ends)).warnings if w.code == "position_unchecked"]
    assert all(name in said for name in robot.joint_names)
    written = json.loads((ROOT / f"planner/robots/data/{robot_id}.json").read_text())["notes"]
    assert list(robot.notes) == list(robot.derived(id="mine").notes) == written
    assert any("position limits" in note for note in written)


def test_arms_with_limits_and_joints_that_turn_for_ever_are_not_warned_of() -> None:
    robot = load_robot("kuka_kr16_2")
    ends = [JointWaypoint(robot.middle), JointWaypoint(robot.middle + 0.1)]
    assert not plan(PlanningProblem(robot, ends)).warnings


def test_the_arm_that_hangs_says_so() -> None:
    notes = " ".join(load_robot("three_dof_arm").notes)
    assert "hangs from its foot" in notes
    assert "z axis of its base points downwards" in notes
