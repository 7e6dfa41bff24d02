"""The names of configurations, against elbow and wrist by plain forward kinematics, and against documents."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.kinematics import (
    Configuration,
    FloatArray,
    Pose,
    all_solutions,
    configurations,
    forward_kinematics,
    in_configuration,
    inverse_kinematics,
    inverse_kinematics_many,
    jacobian,
    named_parts,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.robots import Robot, catalogue_ids, load_robot
from tests.documents.published import document, standard_dh
from tests.planner.kinematics.dh_arms import Row, arm_of, spherical_wrist, three_parallel, turn_and_slides
from tests.planner.problems_of_tests import random_position

if TYPE_CHECKING:
    from collections.abc import Callable

OPTIONS = InverseKinematicsOptions()
UR5_LINKS = [(0.089159, 0.0, 90), (0.0, -0.425, 0), (0.0, -0.39225, 0), (0.10915, 0.0, 90), (0.09465, 0.0, -90)]
UR5_ROWS = [(d, a, float(np.radians(alpha))) for d, a, alpha in [*UR5_LINKS, (0.0823, 0.0, 0)]]
NAMED = {
    "date_sorting_arm": ("shoulder", "wrist"),
    "three_dof_arm": ("shoulder", "elbow"),
    "panda": (),
    "xarm7": (),
} | dict.fromkeys(
    ["kuka_kr16_2", "kuka_kr16_l6_2", "ngv_refuelling_arm", "welding_arm", "ur3", "ur5", "ur10"],
    ("shoulder", "elbow", "wrist"),
)
UP = np.array([0.0, 0.0, 1.0])


def origins(robot: Robot, q: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return origins (3,), m, and z axes (3,) of the joints' frames."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    placements = data.oMi.tolist()[1:]
    return [M.translation.copy() for M in placements], [M.rotation[:, 2].copy() for M in placements]


def is_above(point: FloatArray, start: FloatArray, end: FloatArray, outwards: FloatArray) -> bool | None:
    """Return whether a point is above a line that leads outwards; None where the line is too steep to tell."""
    run = (end - start) @ outwards
    if run < 0.05:
        return None
    rise = (end - start)[2] / run
    return bool((point - start)[2] > rise * ((point - start) @ outwards))


@pytest.mark.parametrize("robot_id", [name for name in NAMED if name in catalogue_ids()])
def test_arms_have_names_of_the_parts_that_they_have(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert named_parts(robot) == NAMED[robot_id]
    (found,) = configurations(robot, [random_position(robot, np.random.default_rng(0))])
    assert set(found.names) == set(NAMED[robot_id])


@pytest.mark.parametrize("robot_id", ["kuka_kr16_2", "kuka_kr16_l6_2", "ngv_refuelling_arm", "welding_arm"])
def test_shoulder_and_elbow_are_where_the_links_are(robot_id: str) -> None:
    """The frames of joints 2, 3 and 5 of these arms stand in the shoulder, the elbow and the wrist centre."""
    robot, rng, compared = load_robot(robot_id), np.random.default_rng(5), 0
    for q in (np.array(random_position(robot, rng)) for _ in range(200)):
        (found,), (at, z) = configurations(robot, [q]), origins(robot, q)
        front = (at[1] - at[0]) * [1.0, 1.0, 0.0]
        assert found.shoulder == ("right" if (at[4] - at[0]) @ front > 0.0 else "left")
        outwards = front / np.linalg.norm(front) * (1.0 if found.shoulder == "right" else -1.0)
        above = is_above(at[2], at[1], at[4], outwards)
        if above is not None:
            compared += 1
            assert found.elbow == ("up" if above else "down")
        assert found.wrist == ("no_flip" if np.cross(z[3], z[5]) @ z[4] * _sense(robot) > 0.0 else "flip")
    assert compared > 100


def _sense(robot: Robot) -> float:
    """Return the sign by which a small positive fifth joint turns axis 6 away from axis 4."""
    _, z = origins(robot, np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0]))
    return float(np.sign(np.cross(z[3], z[5]) @ z[4]))


@pytest.mark.skipif("ur5" not in catalogue_ids(), reason="example-robot-data is not installed")
@pytest.mark.parametrize("by_table", [True, False])
def test_the_sides_of_a_ur5_are_those_that_one_sees(by_table: bool) -> None:
    """Two models: the package's, and the published table, whose base is turned by half a turn."""
    table = arm_of([("continuous", *row) for row in UR5_ROWS])
    robot, rng, compared = table if by_table else load_robot("ur5"), np.random.default_rng(6), 0
    for q in rng.uniform(-np.pi, np.pi, (200, 6)):
        (found,) = configurations(robot, [q])
        elbow, fourth, _, centre = (standard_dh(UR5_ROWS[:n], q[:n]) for n in (2, 3, 4, 5))
        # The second axis is the y axis of the frames that stand beside the arm; the links lie at a distance along it.
        across = standard_dh(UR5_ROWS[:1], q[:1])[:3, 2]
        aside = (centre[:3, 3] @ across) * across
        outwards = (centre[:3, 3] - aside) * [1.0, 1.0, 0.0]
        to_the_right = np.cross(outwards, UP)
        assert found.shoulder == ("right" if aside @ to_the_right > 0.0 else "left")
        outwards /= np.linalg.norm(outwards)
        above = is_above(elbow[:3, 3], UP * UR5_ROWS[0][0], fourth[:3, 3], outwards)
        if above is not None:
            compared += 1
            assert found.elbow == ("up" if above else "down")
        assert found.wrist == ("no_flip" if np.sin(q[4]) > 0.0 else "flip")
    assert compared > 50


def test_the_cases_of_table_2_1_of_document_002() -> None:
    """Elbow up and down, base not inverted and inverted: all solutions of Table 2.2."""
    robot = load_robot("three_dof_arm")
    cases = {1: ("right", "up"), 2: ("right", "down"), 3: ("left", "up"), 4: ("left", "down")}
    rows = document("three_dof_arm")["inverse_kinematics"]["table_2_2"]["rows"]
    assert len(rows) == 5
    for row in rows:
        for case, solution in enumerate(row["published_solutions_deg"], start=1):
            (found,) = configurations(robot, [np.radians(solution)])
            assert (found.shoulder, found.elbow) == cases[case]


def test_the_right_elbow_of_document_004() -> None:
    """Section 5.2 of the document takes the solution with the right elbow for its test points."""
    robot = load_robot("date_sorting_arm")
    for point in document("date_sorting")["test_points"]["points"]:
        turns = np.radians([point[f"theta{i}_deg"] for i in (1, 2, 3, 4)])
        q = np.array([turns[0], point["l1_mm"] / 1e3, point["l2_mm"] / 1e3, *turns[1:]])
        (found,) = configurations(robot, [q])
        assert found.shoulder == "right"
        sine = np.sin(q[4])
        assert found.wrist == (None if abs(sine) < 1e-9 else "no_flip" if sine > 0.0 else "flip")


def parallel_elbow(rng: np.random.Generator) -> list[Row]:
    rows = spherical_wrist(rng)
    rows[1] = (*rows[1][:3], 0.0)
    return rows


@pytest.mark.parametrize("make", [parallel_elbow, three_parallel, turn_and_slides])
@given(seed=st.integers(0, 2**32))
@settings(max_examples=25)
def test_all_solutions_of_a_pose_have_different_names(
    make: Callable[[np.random.Generator], list[Row]], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    robot = arm_of(make(rng))
    q = rng.uniform(-1.0, 1.0, 6) * np.where(robot.is_angle, np.pi, 0.5)
    if np.linalg.svd(jacobian(robot, q), compute_uv=False)[-1] < 1e-3:
        return
    solutions = all_solutions(robot, forward_kinematics(robot, q[None])[0], OPTIONS)
    found = configurations(robot, solutions)
    assert len(set(found)) == len(found)
    assert {tuple(one.names) for one in found} == {named_parts(robot)}


@pytest.mark.parametrize("robot_id", ["ngv_refuelling_arm", "welding_arm"])
def test_eight_solutions_have_all_eight_names(robot_id: str) -> None:
    robot = load_robot(robot_id)
    pose = forward_kinematics(robot, np.array([[0.3, 0.4, -1.0, 0.5, 0.8, -0.4]]))[0]
    solutions = all_solutions(robot, pose, OPTIONS)
    assert len(solutions) == len(set(configurations(robot, solutions))) == 8
    for shoulder in ("left", "right"):
        assert len(in_configuration(robot, solutions, Configuration(shoulder=shoulder))) == 4


@pytest.mark.parametrize("robot_id", ["kuka_kr16_l6_2", "ngv_refuelling_arm", "welding_arm", "ur5"])
def test_the_names_change_where_the_jacobian_is_singular(robot_id: str) -> None:
    """The determinant of the Jacobian is a product of the three quantities: its sign changes with each of them."""
    robot, rng, signs = load_robot(robot_id), np.random.default_rng(8), set()
    for q in (np.array(random_position(robot, rng)) for _ in range(300)):
        (found,) = configurations(robot, [q])
        # The elbow's quantity is the quantity of its name times the sign of the shoulder's.
        factors = (found.elbow == "up", found.wrist == "flip")
        signs.add(np.linalg.slogdet(jacobian(robot, q))[0] * (-1.0) ** sum(factors))
    assert len(signs) == 1


@pytest.mark.parametrize("aside", [0.0, 1e-9, -1e-9])
def test_singular_joint_positions_belong_to_both(aside: float) -> None:
    robot = load_robot("kuka_kr16_l6_2")
    straight = configurations(robot, [[0.3, -1.2, 1.4, 0.0, aside, 0.0]])[0]
    assert straight == Configuration("right", "up", None)
    stretched = configurations(robot, [[0.3, -1.2, -np.arctan2(0.035, 0.97) + aside, 0.0, 0.5, 0.0]])[0]
    assert stretched == Configuration("right", None, "no_flip")
    for wrist in ("flip", "no_flip"):
        assert Configuration(wrist=wrist).allows(straight)
        assert not Configuration(wrist=wrist, elbow="down").allows(straight)
    for side in (-1e-4, 1e-4):
        (near,) = configurations(robot, [[0.3, -1.2, 1.4, 0.0, side, 0.0]])
        assert near.wrist == ("no_flip" if side > 0.0 else "flip")


def test_a_wrist_centre_over_the_first_axis_is_on_neither_side() -> None:
    robot = load_robot("ngv_refuelling_arm")
    pose = Pose(np.array([0.0, 0.0, 0.9]))
    for q in all_solutions(robot, pose, OPTIONS):
        assert configurations(robot, [q])[0].shoulder is None


def test_every_solution_says_its_configuration() -> None:
    robot, rng = load_robot("kuka_kr16_l6_2"), np.random.default_rng(4)
    poses = forward_kinematics(robot, np.array([random_position(robot, rng) for _ in range(20)]))
    for result in [*inverse_kinematics_many(robot, poses), inverse_kinematics(robot, poses[0])]:
        assert result.configuration == configurations(robot, [result.position])[0]
        assert set(result.configuration.names) == {"shoulder", "elbow", "wrist"}
    away = inverse_kinematics(robot, Pose(np.array([9.0, 0.0, 0.0])))
    assert away.configuration == configurations(robot, [away.position])[0]


def test_a_configuration_in_words() -> None:
    assert str(Configuration("left", wrist="flip")) == "shoulder left, wrist flip"
    assert str(Configuration()) == "any configuration"
    assert Configuration("left", "up", "flip").of_parts(["elbow"]) == Configuration(elbow="up")
