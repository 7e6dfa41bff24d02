"""The deviation of least effort from straight joint motions, against nearest neighbours of dense samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from planner.backends import MinEffort, Quintic
from planner.certificate.checks import Check
from planner.comparison import figures
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import load_robot
from planner.spatial import FloatArray
from tests.planner.problems_of_tests import problem_of
from tests.planner.tool_motions.dense_paths import StraightPositions, StraightWay, tool_positions

ROBOT = load_robot("kuka_kr16_l6_2")
REACHING = PlanningProblem(
    ROBOT,
    [JointWaypoint([-0.8, -0.35, 0.6, 0.0, 0.5, 0.0]), JointWaypoint([0.8, -0.35, 0.6, 0.0, 0.5, 0.0], duration=6.0)],
)
"""A slow motion from side to side with the arm stretched out, which is hard to hold: the best path is near the body."""

KNOTS = 16
"""Enough for the problems of these tests, and quick."""

DENSE = np.linspace(0.0, 1.0, 3001)
"""Samples of a motion for the brute force: a millimetre apart."""


@cache
def reaching(most: float | None, joints: float | None = None) -> Plan:
    return plan(REACHING, MinEffort(knots=KNOTS, max_deviation=most, max_joint_deviation=joints))


def deviation(planned: Plan, quantity: str = "tool_deviation") -> Check:
    (check,) = (check for check in planned.certificate.checks if check.quantity == quantity)
    return check


def true_deviation(planned: Plan, samples: FloatArray = DENSE) -> float:
    """Return the deviation of the tool on the only segment, m."""
    return StraightWay(planned.path.robot, planned.path.positions, samples).farthest(planned.trajectory)


def true_joint_deviation(planned: Plan) -> float:
    """Return the largest deviation of a joint on the only segment, rad."""
    return StraightPositions(planned.path.positions, DENSE).farthest(planned.trajectory)


def farthest_joints(planned: Plan) -> set[str]:
    """Return the joints farthest from the straight motion, by brute force; often several are equally far."""
    (joints,) = planned.trajectory.evaluate(DENSE * planned.trajectory.duration, [0])
    worst = joints[StraightPositions(planned.path.positions, DENSE).distances(joints).argmax()]
    start, goal = planned.path.positions
    away = np.abs(worst - start - np.linspace(0.0, 1.0, 10_001)[:, None] * (goal - start))
    nearest = away[away.max(axis=1).argmin()]
    return {name for name, distance in zip(ROBOT.joint_names, nearest, strict=True) if distance > 0.98 * nearest.max()}


@pytest.mark.long_table
@pytest.mark.parametrize("most", [0.003, 0.03, 0.1, 0.3, None])
def test_the_deviation_is_what_is_said_and_what_is_allowed(most: float | None) -> None:
    planned = reaching(most)
    # A millimetre between samples would add 2 % to a deviation of 2.4 mm.
    samples = np.linspace(0.0, 1.0, 60_001) if most == 0.003 else DENSE
    check, true = deviation(planned), true_deviation(planned, samples)
    assert true - 1e-6 <= check.peak <= 1.01 * true + 1e-6
    assert check.lower is not None
    assert check.lower <= true + 1e-6
    assert (check.limit, check.enforced, check.method) == (most, True, "bounded")
    wanders = [warning.message for warning in planned.warnings if warning.code == "tool_deviates"]
    if most is None:
        assert true > 1.0
        assert "from waypoint 0 to 1 the tool goes" in wanders[0]
    else:
        assert true <= most
        assert bool(wanders) == (check.peak > 0.1)


@pytest.mark.long_table
@pytest.mark.parametrize("most", [None, 0.6, 0.1, 0.01])
def test_the_deviation_of_joints_is_what_is_said_and_what_is_allowed(most: float | None) -> None:
    planned = reaching(None, most)
    check, true = deviation(planned, "joint_deviation"), true_joint_deviation(planned)
    assert true - 1e-9 <= check.peak <= 1.0001 * true + 1e-6
    assert (check.limit, check.enforced, check.method) == (most, True, "exact")
    wanders = [warning.message for warning in planned.warnings if warning.code == "joint_deviates"]
    assert bool(wanders) == (check.peak > 1.0)
    if most is not None:
        assert 0.8 * most <= true <= most
    else:
        assert f"from waypoint 0 to 1 {check.joint} goes" in wanders[0]
        assert check.joint in farthest_joints(planned)


@pytest.mark.large_only
@settings(max_examples=max(3, settings.default.max_examples // 20))
@given(
    robot_id=st.sampled_from(["kuka_kr16_l6_2", "ur5", "panda"]),
    seed=st.integers(0, 2**32),
    tool=st.none() | st.floats(-2.0, 0.0).map(lambda power: 10.0**power),
    joints=st.none() | st.floats(-2.0, 0.0).map(lambda power: 10.0**power),
)
def test_random_motions_keep_near(robot_id: str, seed: int, tool: float | None, joints: float | None) -> None:
    backend = MinEffort(knots=8, max_deviation=tool, max_joint_deviation=joints)
    planned = plan(problem_of(robot_id, seed, 2, 0.5), backend)
    assert true_deviation(planned) <= (tool or np.inf)
    assert true_joint_deviation(planned) <= (joints or np.inf)


@pytest.mark.large_only
def test_the_tool_stays_within_0_1_m_unless_it_is_let_go() -> None:
    assert MinEffort().max_deviation == 0.1
    assert true_deviation(plan(REACHING, MinEffort(knots=KNOTS))) <= 0.1


@pytest.mark.long_table
@pytest.mark.parametrize("problem", [REACHING, *(problem_of("kuka_kr16_l6_2", seed, 2, 0.4) for seed in range(4))])
def test_more_room_is_never_dearer(problem: PlanningProblem) -> None:
    """Effort does not rise with the allowed deviation and never exceeds the quintic's; most of the deviation is used.

    Each search ends in a local minimum of its own: efforts differ by 1 %.
    """
    quintic = figures(plan(problem, Quintic())).effort
    rooms = (0.003, 0.03, 0.1, None)
    if problem is REACHING:
        plans = [reaching(most) for most in rooms]
    else:
        plans = [plan(problem, MinEffort(knots=KNOTS, max_deviation=most)) for most in rooms]
    efforts = [figures(planned).effort for planned in plans]
    for dear, cheap in zip([quintic, *efforts], efforts, strict=False):
        assert dear is not None
        assert cheap is not None
        assert cheap <= dear * 1.01
    free = true_deviation(plans[-1])
    for most, planned in zip(rooms[:-1], plans, strict=False):
        assert most is not None
        assert true_deviation(planned) >= 0.8 * min(most, free) - 2e-4


def test_a_search_with_room_to_spare_finds_what_the_search_without_bounds_does() -> None:
    """The joint positions of equal effort differ by more, as the optimum is flat."""
    problem = problem_of("kuka_kr16_l6_2", 3, 2, 0.1)
    bounded, free = (
        plan(problem, MinEffort(knots=KNOTS, max_deviation=most, max_joint_deviation=most)) for most in (2.0, None)
    )
    assert figures(bounded).effort == pytest.approx(figures(free).effort, rel=1e-5)
    ways = [planned.trajectory.evaluate(0.5 * planned.trajectory.duration)[0] for planned in (bounded, free)]
    assert ways[0] == pytest.approx(ways[1], abs=4e-3)


@pytest.mark.long_table
@pytest.mark.parametrize("transition", [ThroughTransition(), BlendTransition(0.05)])
def test_where_waypoints_are_passed_the_deviation_is_reported(transition: ThroughTransition | BlendTransition) -> None:
    problem = problem_of("kuka_kr16_l6_2", 5, 3, 0.3)
    start, middle, end = problem.waypoints
    passed = replace(problem, waypoints=(start, replace(middle, transition=transition), end))
    planned = plan(passed, MinEffort(knots=KNOTS, max_joint_deviation=0.3))
    stopped = plan(problem, MinEffort(knots=KNOTS, max_joint_deviation=0.3))
    for quantity, most in (("tool_deviation", 0.1), ("joint_deviation", 0.3)):
        assert not deviation(planned, quantity).enforced
        assert deviation(stopped, quantity).enforced
        assert deviation(stopped, quantity).peak <= most


@pytest.mark.large_only
def test_through_waypoints_the_way_is_that_of_the_quintic() -> None:
    """The path stays within the allowed deviation from the quintic's; a larger deviation costs less."""
    problem = problem_of("kuka_kr16_l6_2", 1, 4, 0.4)
    first, *inner, last = problem.waypoints
    passed = [first, *(replace(waypoint, transition=ThroughTransition()) for waypoint in inner), last]
    problem = replace(problem, waypoints=passed)
    quintic = plan(problem, Quintic())
    efforts = [figures(quintic).effort or 0.0]
    way = cKDTree(tool_positions(ROBOT, quintic.trajectory.evaluate(DENSE * quintic.trajectory.duration, [0])[0]))
    for most in (0.01, 0.1):
        planned = plan(problem, MinEffort(knots=KNOTS, max_deviation=most))
        (joints,) = planned.trajectory.evaluate(DENSE * planned.trajectory.duration, [0])
        assert 0.3 * most <= way.query(tool_positions(ROBOT, joints))[0].max() <= most
        efforts.append(figures(planned).effort or 0.0)
    assert efforts == sorted(efforts, reverse=True)


@pytest.mark.large_only
def test_each_segment_has_its_own_straight_motion() -> None:
    """On the way there and back, the deviation of the list is that of its worst segment."""
    there, back = REACHING.waypoints
    problem = replace(REACHING, waypoints=[there, back, replace(there, duration=6.0, dwell=0.5)])
    planned = plan(problem, MinEffort(knots=KNOTS))
    assert deviation(planned).peak == pytest.approx(deviation(reaching(0.1)).peak, rel=0.05)
    assert deviation(planned).peak <= 0.1
    assert np.isfinite(deviation(planned).time)
