"""All solutions of a pose, compared with an analytic solver; and no false success."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from typing import NoReturn

import numpy as np
import pytest

from planner.kinematics import (
    FloatArray,
    Pose,
    all_solutions,
    forward_kinematics,
    inverse_kinematics,
    is_isolated,
    with_whole_turns,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search
from planner.robots import Robot, load_robot
from tests.documents.published import homogeneous
from tests.locations import DATA
from tests.planner.kinematics.dh_arms import apart, ngv_product
from tests.planner.problems_of_tests import random_position

OPTIONS = InverseKinematicsOptions()
BRANCHES = json.loads((DATA / "inverse_kinematics_branches.json").read_text())["robots"]


@pytest.mark.parametrize("robot_id", BRANCHES)
def test_the_branches_of_an_analytic_solver_are_found_and_no_others(robot_id: str) -> None:
    robot = load_robot(robot_id)
    for case in BRANCHES[robot_id]:
        pose = forward_kinematics(robot, np.array([case["from"]]))[0]
        solutions = all_solutions(robot, pose, OPTIONS)
        expected = np.array(case["solutions"])
        assert len(solutions) == len(expected)
        for branch in expected:
            assert min(apart(branch, found) for found in solutions) < 1e-5


def test_solutions_come_in_the_order_of_their_distance_in_time() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    reference = np.array([0.3, -1.2, 1.1, 0.4, 0.7, -0.5])
    pose = forward_kinematics(robot, reference[None] + 0.1)[0]
    solutions = all_solutions(robot, pose, OPTIONS, reference)
    times = [np.linalg.norm((q - reference) / robot.limit("velocity")) for q in solutions]
    assert len(times) > 1
    assert all(first <= second for first, second in pairwise(times))
    assert solutions[0] == pytest.approx(reference + 0.1, abs=1e-6)


def test_whole_turns_of_joints_are_solutions_of_their_own() -> None:
    robot = load_robot("kuka_kr16_l6_2")  # joints 4 and 6 turn by 700 degrees
    q = np.array([0.3, -1.2, 1.1, 1.0, 0.7, -1.5])
    turned = with_whole_turns(robot, (q,), q, 64)
    assert len(turned) == 4
    assert turned[0] == pytest.approx(q)
    full = 2.0 * np.pi
    for fourth, sixth in ((0.0, 0.0), (-full, 0.0), (0.0, full), (-full, full)):
        wanted = q + np.array([0.0, 0.0, 0.0, fourth, 0.0, sixth])
        assert min(np.abs(wanted - other).max() for other in turned) < 1e-12
    assert [list(other) for other in with_whole_turns(robot, (q,), q, 2)] == [list(other) for other in turned[:2]]


@pytest.mark.long_table
@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("beyond", [1e-13, 3e-11, 1e-9, 1e-7])
def test_a_solution_at_a_limit_is_found_though_rounding_puts_it_outside(beyond: float, fixed: bool) -> None:
    """Job `fixed_axis-05-ngv_refuelling_arm`: a joint is fixed 3e-11 rad from its position in the pose."""
    robot, q = load_robot("ngv_refuelling_arm"), np.array([-0.6, -0.4, 0.8, 0.0, -0.4, -0.6])
    (pose,) = forward_kinematics(robot, q[None])
    for sign in (-1.0, 1.0):
        for joint in (1, 3):
            end = float(q[joint]) - sign * beyond
            lower, upper = sorted((end, end - sign * (0.0 if fixed else 1.0)))
            joints = list(robot.joints)
            joints[joint] = replace(joints[joint], kind="revolute", lower=lower, upper=upper)
            limited = replace(robot, joints=tuple(joints))
            found = all_solutions(limited, pose, OPTIONS, q)
            assert found
            assert min(apart(q, other) for other in found) < 1e-6
            assert all(lower <= other[joint] <= upper for other in found)


def test_of_a_continuum_a_spread_is_given() -> None:
    robot = load_robot("kuka_kr16_l6_2")  # position alone: three joints too many
    point = forward_kinematics(robot, robot.middle[None] + 0.2)[0].position
    solutions = all_solutions(robot, Pose(point), OPTIONS)
    assert len(solutions) == 16
    assert not is_isolated(robot, Pose(point), solutions[0])
    for i, q in enumerate(solutions):
        assert forward_kinematics(robot, q[None])[0].position == pytest.approx(point, abs=1e-6)
        assert all(apart(q, other) > 0.29 for other in solutions[:i])


def test_a_tool_changes_the_pose_and_not_the_branches() -> None:
    robot = load_robot("ngv_refuelling_arm")
    tool = Pose(np.array([0.1, -0.05, 0.2]), homogeneous("y", 0.7)[:3, :3])
    q = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
    bare, held = (forward_kinematics(arm, q[None])[0] for arm in (robot, robot.with_tool(tool)))
    without, with_tool = all_solutions(robot, bare, OPTIONS), all_solutions(robot.with_tool(tool), held, OPTIONS)
    assert len(without) == len(with_tool)
    for solution in without:
        assert min(apart(solution, other) for other in with_tool) < 1e-5


def test_a_pose_out_of_reach_is_given_up_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for the nearest pose takes sixty times as long, and its result is not needed here."""

    def searched(_: Search) -> NoReturn:
        raise AssertionError

    monkeypatch.setattr(Search, "nearest", searched)
    monkeypatch.setattr(Search, "beyond_the_limits", searched)
    assert all_solutions(load_robot("kuka_kr16_2"), Pose([5.0, 0.0, 1.0], np.eye(3)), OPTIONS) == ()


def within(robot: Robot, q: FloatArray) -> bool:
    return bool((q >= robot.limit("lower")).all() and (q <= robot.limit("upper")).all())


@pytest.mark.parametrize("stretch", [1.0, 1.02, 1.3])
def test_never_a_wrong_success(stretch: float) -> None:
    """Poses are within reach, at the border and beyond; a plain D-H product checks the solutions."""
    robot, rng = load_robot("ngv_refuelling_arm"), np.random.default_rng(12)
    solved = 0
    requests = 2000 if stretch == 1.0 else 40
    for _ in range(requests):
        wanted = ngv_product(np.array(random_position(robot, rng)))
        wanted[:3, 3] *= stretch
        result = inverse_kinematics(robot, Pose(wanted[:3, 3], wanted[:3, :3]), OPTIONS)
        if result.status == "solved":
            solved += 1
            reached = ngv_product(result.position)
            assert within(robot, result.position)
            assert np.linalg.norm(reached[:3, 3] - wanted[:3, 3]) <= 1e-6
            # |log R| <= 1e-6 rad means |R - R*|_F <= sqrt(2) 1e-6
            assert np.linalg.norm(reached[:3, :3] - wanted[:3, :3]) <= 1.5e-6
    assert solved >= {1.0: 0.999, 1.02: 0.5, 1.3: 0.0}[stretch] * requests
    assert stretch < 1.3 or solved < requests
