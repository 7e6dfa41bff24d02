"""The dimensions of workspaces against geometry, and against clouds of points inside them."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import InvalidProblem
from planner.kinematics import FloatArray, Pose, Workspace, forward_kinematics, workspace
from planner.kinematics.workspace import Objective, _derivatives
from planner.robots import DHJoint, Robot, load_robot
from tests.documents.published import gantry
from tests.planner.problems_of_tests import ARMS, random_position

RADII = ("minimum_radius", "maximum_radius", "radius_at_maximum_height")
HEIGHTS = ("minimum_height", "maximum_height")
REACHES = ("minimum_reach", "maximum_reach")


def values(found: Workspace, *names: str) -> list[float]:
    return [getattr(found, name).value for name in names]


def planar(*joints: DHJoint) -> Robot:
    return Robot.from_dh(joints)


def link(length: float, lower: float, upper: float) -> DHJoint:
    return DHJoint(kind="revolute", theta=0.0, d=0.0, a=length, alpha=0.0, lower=lower, upper=upper)


def test_two_links_within_limits() -> None:
    """The law of cosines holds at the ends of the elbow's range."""
    found = workspace(planar(link(0.4, -1.0, 1.0), link(0.3, 0.5, 2.5)), 10)
    shortest, longest = (np.sqrt(0.4**2 + 0.3**2 + 2.0 * 0.4 * 0.3 * np.cos(q)) for q in (2.5, 0.5))
    assert values(found, *REACHES) == pytest.approx([shortest, longest], abs=1e-12)
    assert values(found, *RADII[:2]) == pytest.approx([shortest, longest], abs=1e-12)
    assert values(found, *HEIGHTS) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert found.radius_at_maximum_height.value == pytest.approx(longest, abs=1e-12)


def test_one_link() -> None:
    found = workspace(planar(link(0.5, -1.0, 1.0)), 10)
    assert values(found, *REACHES, *RADII) == pytest.approx([0.5] * 5, abs=1e-12)


def test_a_box() -> None:
    """Three sliding axes of -2 to 2 m have no curvature: every extreme except the nearest is at corners."""
    found = workspace(gantry(), 10)
    assert values(found, *RADII) == pytest.approx([0.0, np.sqrt(8.0), np.sqrt(8.0)], abs=1e-9)
    assert values(found, *HEIGHTS) == pytest.approx([-2.0, 2.0], abs=1e-12)
    assert values(found, *REACHES) == pytest.approx([0.0, np.sqrt(12.0)], abs=1e-9)


def test_the_reach_of_the_kuka_in_its_data_sheet() -> None:
    """The data sheet has 1911 mm from axis 1 to the wrist centre, the arm stretched: 260 + 680 + |(970, 35)| mm."""
    robot = load_robot("kuka_kr16_l6_2").with_tool(Pose(np.array([0.0, 0.0, -0.115])))
    stretched = 0.68 + np.hypot(0.97, 0.035)
    found = workspace(robot, 10)
    assert round(1000.0 * found.maximum_radius.value) == 1911
    assert found.maximum_radius.value == pytest.approx(0.26 + stretched, abs=1e-12)
    # The same upright: shoulder height 675 mm, 260 mm off the axis.
    assert values(found, "maximum_height", "radius_at_maximum_height") == pytest.approx(
        [0.675 + stretched, 0.26], abs=1e-9
    )


@pytest.mark.long_table
@pytest.mark.parametrize("tool", [None, Pose(np.array([0.1, -0.2, 0.3]))], ids=["flange", "tool"])
@pytest.mark.parametrize("robot_id", [*ARMS, "kuka_kr16_2", "welding_arm"])
def test_no_position_lies_beyond_the_figures_and_each_is_reached(robot_id: str, tool: Pose | None) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(8)
    if tool is not None:
        robot = robot.with_tool(tool)
    found = workspace(robot, 10)
    points = at(robot, np.array([random_position(robot, rng) for _ in range(10_000)]))
    for names, measured in ((RADII[:2], radius(points)), (HEIGHTS, points[:, 2]), (REACHES, reach(points))):
        lowest, highest = values(found, *names)
        assert lowest - 1e-12 <= measured.min() <= measured.max() <= highest + 1e-12
    for names, measure in ((RADII, radius), (HEIGHTS, lambda p: p[:, 2]), (REACHES, reach)):
        for extreme in (getattr(found, name) for name in names):
            assert extreme.value == pytest.approx(measure(at(robot, extreme.position[None]))[0], abs=1e-12)
            assert (extreme.position >= robot.limit("lower")).all()
            assert (extreme.position <= robot.limit("upper")).all()


def at(robot: Robot, positions: FloatArray) -> FloatArray:
    return np.array([pose.position for pose in forward_kinematics(robot, positions)])


def radius(points: FloatArray) -> FloatArray:
    return np.hypot(points[:, 0], points[:, 1])


def reach(points: FloatArray) -> FloatArray:
    return np.sqrt((points**2).sum(axis=1))


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ARMS)
def test_the_figures_depend_neither_on_the_seed_nor_on_the_number_of_points(robot_id: str) -> None:
    robot = load_robot(robot_id)
    names = (*RADII, *HEIGHTS, *REACHES)
    first = workspace(robot, 1)
    assert first.points.shape == (1, 3)
    for samples, seed in ((1, 1), (1, 2), (5000, 3)):
        other = workspace(robot, samples, seed)
        assert other.points.shape == (samples, 3)
        assert values(other, *names) == pytest.approx(values(first, *names), abs=1e-7)


def test_the_points_are_those_of_the_seed() -> None:
    robot = load_robot("three_dof_arm")
    points = workspace(robot, 200, seed=1).points
    assert (workspace(robot, 200, seed=1).points == points).all()
    assert (workspace(robot, 50, seed=1).points == points[:50]).all()
    assert not (workspace(robot, 200, seed=2).points == points).any()
    # Whole turns of the first joint: all four quarters about the axis.
    assert len(np.unique(np.sign(points[:, :2]), axis=0)) == 4


def test_a_joint_that_slides_for_ever_has_no_workspace() -> None:
    endless = planar(link(0.4, -1.0, 1.0), DHJoint(kind="prismatic", theta=0.0, d=0.0, a=0.0, alpha=0.0, velocity=1.0))
    with pytest.raises(InvalidProblem) as raised:
        workspace(endless, 10)
    assert raised.value.faults == ((("robot",), "joint_2 slides without limits: no workspace"),)


@pytest.mark.parametrize("robot_id", ARMS)
def test_gradient_and_hessian_equal_finite_differences(robot_id: str) -> None:
    robot, rng, h = load_robot(robot_id), np.random.default_rng(9), 1e-5
    objective = Objective(linear=(0.3, -0.7, 1.0), square=(1.0, -0.5, 0.2))
    for _ in range(20):
        q = np.array(random_position(robot, rng))
        gradient, hessian = _derivatives(robot, objective, q)
        steps = h * np.eye(robot.dof)
        slopes = (objective.value(at(robot, q + steps)) - objective.value(at(robot, q - steps))) / (2.0 * h)
        assert gradient == pytest.approx(slopes, abs=1e-8)
        ends = [[_derivatives(robot, objective, q + side * step)[0] for step in steps] for side in (1.0, -1.0)]
        assert hessian == pytest.approx(np.subtract(*ends) / (2.0 * h), abs=1e-8)
