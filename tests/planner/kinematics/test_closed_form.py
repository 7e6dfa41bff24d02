"""Closed forms: random arms of each kind find a configuration again from its pose, and all solutions are correct."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.kinematics.check import PlainProduct, check
from planner.kinematics import (
    Pose,
    all_solutions,
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    solution_layers,
    solutions_or_failure,
)
from planner.kinematics.closed_form import closed_form
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.screws import Screws
from planner.robots import load_robot
from tests.planner.kinematics.dh_arms import (
    Row,
    apart,
    arm_of,
    general,
    ngv_product,
    plain_product,
    rot,
    spherical_wrist,
    three_parallel,
    trans,
    turn_and_slides,
)
from tests.planner.problems_of_tests import random_position

if TYPE_CHECKING:
    from collections.abc import Callable

OPTIONS = InverseKinematicsOptions()


@pytest.mark.parametrize("make", [spherical_wrist, three_parallel, turn_and_slides])
@given(seed=st.integers(0, 2**32))
@settings(max_examples=25)
def test_six_joints_are_found_again(make: Callable[[np.random.Generator], list[Row]], seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = make(rng)
    robot = arm_of(rows)
    assert closed_form(Screws.of(robot), None) is not None
    configurations = rng.uniform(-np.pi, np.pi, (4, 6)) * np.where(robot.is_angle, 1.0, 0.5)
    configurations = [q for q in configurations if np.linalg.svd(jacobian(robot, q), compute_uv=False)[-1] > 1e-3]
    placements = [plain_product(rows, q) for q in configurations]
    layers = solution_layers(robot, [Pose(T[:3, 3], T[:3, :3]) for T in placements], OPTIONS)
    for q, T, solutions in zip(configurations, placements, layers, strict=True):
        assert 1 <= len(solutions) <= 8
        assert min(apart(q, other) for other in solutions) < 1e-5
        for other in solutions:
            assert plain_product(rows, other) == pytest.approx(T, abs=1e-8)


@given(seed=st.integers(0, 2**32))
@settings(max_examples=25)
def test_three_joints_are_found_again_by_the_position_of_a_tool(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = [general("continuous", rng) for _ in range(3)]
    tool = rng.uniform(0.1, 0.5, 3)
    robot = arm_of(rows).with_tool(Pose(tool))
    q = rng.uniform(-np.pi, np.pi, 3)
    if np.linalg.svd(jacobian(robot, q)[:3], compute_uv=False)[-1] < 1e-3:
        return
    wanted = (plain_product(rows, q) @ trans(*tool))[:3, 3]
    solutions = all_solutions(robot, Pose(wanted), OPTIONS)
    assert 1 <= len(solutions) <= 4
    assert min(apart(q, other) for other in solutions) < 1e-5
    for other in solutions:
        assert (plain_product(rows, other) @ trans(*tool))[:3, 3] == pytest.approx(wanted, abs=1e-8)


def test_an_arm_with_an_offset_wrist_has_no_closed_form_and_is_solved_by_descents() -> None:
    rng = np.random.default_rng(3)
    rows = spherical_wrist(rng)
    rows[4] = ("continuous", 0.0, 0.08, rows[4][3])
    robot = arm_of(rows)
    assert closed_form(Screws.of(robot), None) is None
    for q in rng.uniform(-np.pi, np.pi, (5, 6)):
        T = plain_product(rows, q)
        solutions = all_solutions(robot, Pose(T[:3, 3], T[:3, :3]), OPTIONS)
        assert min(apart(q, other) for other in solutions) < 1e-5


@pytest.mark.parametrize("robot_id", ["date_sorting_arm", "kuka_kr16_l6_2", "ngv_refuelling_arm", "three_dof_arm"])
def test_the_screws_are_pinocchios_kinematics(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(2)
    q = np.array([random_position(robot, rng) for _ in range(5)])
    positions, rotations, jacobians = Screws.of(robot).reach(q, np.zeros(3))
    for i, pose in enumerate(forward_kinematics(robot, q)):
        assert positions[i] == pytest.approx(pose.position, abs=1e-12)
        assert rotations[i] == pytest.approx(pose.rotation, abs=1e-12)
        assert jacobians[i] == pytest.approx(jacobian(robot, q[i]), abs=1e-12)


def test_branches_next_to_a_straight_wrist_are_not_lost() -> None:
    """The same fault as in EAIK: at -1e-5 rad of joint 5, three of four branches counted as one continuum."""
    robot = load_robot("kuka_kr16_l6_2")
    q = np.array([-2.99906936, 0.45754104, -0.02196981, -1.47125484, -1.0281168e-05, 2.80230572])
    flipped = q + np.array([0.0, 0.0, 0.0, np.pi, -2.0 * q[4], -np.pi])
    solutions = all_solutions(robot, forward_kinematics(robot, q[None])[0], OPTIONS)
    for branch in (q, flipped):
        assert min(apart(branch, other) for other in solutions) < 1e-4


@pytest.mark.parametrize(
    "q",
    [
        [-2.7248, -0.9489, 0.1543, -np.pi / 2, np.pi, 1.5276],
        [0.66, -3.1098, 0.0, -1.6893, np.pi, -np.pi / 2],
        [2.2772, -1.2229, 0.0, -np.pi / 2, -np.pi, -1.9749],
    ],
)
def test_a_singular_pose_of_a_ur5_is_no_false_refusal(q: list[float]) -> None:
    """At joint 5 = pi joint 6 is free; with the closed form's choice of it the pose seemed out of reach."""
    links = [(0.089159, 0.0, 90), (0.0, -0.425, 0), (0.0, -0.39225, 0), (0.10915, 0.0, 90), (0.09465, 0.0, -90)]
    rows: list[Row] = [("continuous", d, a, float(np.radians(alpha))) for d, a, alpha in [*links, (0.0823, 0.0, 0)]]
    T = plain_product(rows, np.array(q))
    solutions = all_solutions(arm_of(rows), Pose(T[:3, 3], T[:3, :3]), OPTIONS)
    assert solutions
    for other in solutions:
        assert plain_product(rows, other) == pytest.approx(T, abs=1e-6)


def test_many_poses_together_are_answered_as_each_alone() -> None:
    robot, rng = load_robot("kuka_kr16_l6_2"), np.random.default_rng(7)
    poses = forward_kinematics(robot, np.array([random_position(robot, rng) for _ in range(6)]))
    poses[1] = Pose(poses[1].position)
    poses[3] = Pose(np.array([9.0, 0.0, 0.0]), np.eye(3))
    layers = solution_layers(robot, poses, OPTIONS)
    assert layers[3] == ()
    for pose, together in zip(poses, layers, strict=True):
        alone = all_solutions(robot, pose, OPTIONS)
        assert len(alone) == len(together)
        assert np.array(together) == pytest.approx(np.array(alone), abs=1e-9)
    assert solution_layers(robot, [], OPTIONS) == []


def test_one_search_gives_the_solutions_or_the_reason() -> None:
    robot = load_robot("date_sorting_arm")
    reachable, beyond = forward_kinematics(
        robot, np.array([[0.3, 0.4, 0.2, 0.5, 1.0, 0.4], [0.3, 0.6, 0.2, 0.5, 1.0, 0.4]])
    )
    solutions = solutions_or_failure(robot, reachable, OPTIONS)
    assert isinstance(solutions, tuple)
    assert min(np.abs(q - [0.3, 0.4, 0.2, 0.5, 1.0, 0.4]).max() for q in solutions) < 1e-6
    failure, expected = solutions_or_failure(robot, beyond, OPTIONS), inverse_kinematics(robot, beyond, OPTIONS)
    assert not isinstance(failure, tuple)
    assert (failure.status, failure.joint) == (expected.status, expected.joint) == ("joint_position_limit", "l1")
    assert failure.value == pytest.approx(0.6, abs=1e-6)


def test_the_check_of_the_benchmark_is_the_product_of_the_document() -> None:
    robot, rng = load_robot("ngv_refuelling_arm"), np.random.default_rng(1)
    q = rng.uniform(-np.pi, np.pi, (4, 6))
    product = PlainProduct(robot)
    expected = np.array([ngv_product(row) for row in q])
    assert product(q) == pytest.approx(expected, abs=1e-12)
    moved = Pose(expected[0, :3, 3] + [0.0, 2e-6, 0.0], expected[0, :3, :3])
    turned = Pose(expected[0, :3, 3], expected[0, :3, :3] @ rot(0, 3e-6)[:3, :3])
    assert product.errors([(moved, q[0]), (turned, q[0])]) == pytest.approx([2e-6, 3e-6], rel=1e-6)
    outside = load_robot("date_sorting_arm")
    beyond = outside.limit("upper") + 1e-3
    assert PlainProduct(outside).errors([(forward_kinematics(outside, beyond[None])[0], beyond)])[0] == np.inf


@pytest.mark.parametrize("robot_id", ["kuka_kr16_l6_2", "ngv_refuelling_arm", "date_sorting_arm"])
def test_random_requests_of_all_classes_are_never_answered_wrongly(robot_id: str) -> None:
    figures = check(load_robot(robot_id), 400, seed=11)
    for name, row in figures.items():
        assert row["wrong"] == 0, name
        assert row["worst"] <= 1e-6
    for name in ("reachable", "singular"):
        assert figures[name]["solved"] == figures[name]["requests"]
    assert 0 < figures["border"]["requests"] > figures["border"]["solved"]
