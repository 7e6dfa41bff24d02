"""The Jacobian against differences of the forward kinematics, and quantities derived from it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.kinematics import FloatArray, Pose, forward_kinematics, jacobian, manipulability, singular_values
from planner.robots import Robot, load_robot
from planner.spatial import rotation_from_rpy
from tests.planner.problems_of_tests import ARMS, random_position

TOOL = Pose(np.array([0.1, -0.2, 0.3]), rotation_from_rpy(0.4, -0.5, 0.6))


def differences(robot: Robot, q: FloatArray, h: float = 1e-5) -> FloatArray:
    """Compute (6, joints) by central differences: of the position, and of the rotation as R' R^T = [w]x."""
    columns = []
    for step in h * np.eye(robot.dof):
        below, here, above = forward_kinematics(robot, np.array([q - step, q, q + step]))
        assert below.rotation is not None
        assert above.rotation is not None
        assert here.rotation is not None
        spin = (above.rotation - below.rotation) @ here.rotation.T / (2.0 * h)
        linear = (above.position - below.position) / (2.0 * h)
        columns.append([*linear, spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@pytest.mark.parametrize("tool", [None, TOOL], ids=["flange", "tool"])
@pytest.mark.parametrize("robot_id", [*ARMS, "kuka_kr16_2", "welding_arm"])
def test_jacobian_equals_finite_differences(robot_id: str, tool: Pose | None) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(5)
    if tool is not None:
        robot = robot.with_tool(tool)
    for _ in range(20):
        q = np.array(random_position(robot, rng))
        assert jacobian(robot, q) == pytest.approx(differences(robot, q), abs=1e-8)


@pytest.mark.parametrize("robot_id", [*ARMS, "kuka_kr16_2"])
def test_singular_values_are_the_square_roots_of_the_eigenvalues(robot_id: str) -> None:
    """They are eigenvalues of J J^T, with the position's rows for an arm that only positions its tool.

    The squared manipulability is their product.
    """
    robot, rng = load_robot(robot_id), np.random.default_rng(6)
    positions = np.array([random_position(robot, rng) for _ in range(20)])
    for q, values, product in zip(
        positions, singular_values(robot, positions), manipulability(robot, positions), strict=True
    ):
        J = differences(robot, q)[: 3 if robot_id == "three_dof_arm" else 6]
        gram = J @ J.T
        assert values**2 == pytest.approx(np.linalg.eigvalsh(gram)[::-1], abs=1e-7)
        assert product**2 == pytest.approx(np.linalg.det(gram), abs=1e-7)


def test_a_three_joint_arm_is_singular_where_it_is_stretched() -> None:
    """In document 002, theta3 = 0 puts forearm and upper arm on one line, so the tool cannot go further."""
    robot = load_robot("three_dof_arm")
    assert manipulability(robot, np.array([0.3, 0.4, 0.0])) < 1e-12
    assert manipulability(robot, np.array([0.3, 0.4, 1.0])) > 1e-4


def test_a_singular_position_has_no_manipulability() -> None:
    """In the stretched wrist of the KUKA, axes 4 and 6 coincide."""
    robot = load_robot("kuka_kr16_l6_2")
    position = np.array([[0.3, -1.0, 1.0, 0.2, 0.0, 0.1]])
    assert manipulability(robot, position)[0] < 1e-15
    assert singular_values(robot, position)[0, -1] < 1e-15
    assert singular_values(robot, position)[0, -2] > 0.1
