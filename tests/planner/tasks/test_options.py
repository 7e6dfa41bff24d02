"""Goal sets of tasks: the same optimum as brute force over all options, faults and refusals that name the option."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import planner
from tests.planner.tasks.brute_force import Choice, shortest
from tests.planner.tasks.parts import HOME, LIMITS, ROBOT, joint_waypoint, random_position
from tests.sizes import SIZE

CASES = max(2, SIZE.examples // 20)
"""Seeds of random tasks: 2, and 100 before a release."""

START = planner.PlanningProblem(ROBOT, ["home"])
POINT = joint_waypoint(np.array(HOME) + 0.1)
OUT_OF_REACH = planner.PoseWaypoint(planner.Pose(np.array([3.0, 0.0, 0.0])))


def random_option(random: np.random.Generator) -> tuple[tuple[float, ...], ...]:
    return tuple(random_position(random) for _ in range(int(random.integers(1, 3))))


def option_of(positions: tuple[tuple[float, ...], ...]) -> planner.AnyWaypoint | planner.WaypointSequence:
    points = [joint_waypoint(position) for position in positions]
    return points[0] if len(points) == 1 else planner.WaypointSequence(points)


@pytest.mark.sized
@pytest.mark.parametrize("seed", range(CASES))
def test_order_of_6_tasks_with_goal_sets_is_as_short_as_the_shortest_of_all_options(seed: int) -> None:
    random = np.random.default_rng(seed)
    choices, tasks, sets = [], [], []
    for k in range(6):
        options = [[random_option(random) for _ in range(int(random.integers(1, 4)))] for _ in range(1 + k % 2)]
        ways = tuple(tuple(step for option in chosen for step in option) for chosen in product(*options))
        after = tuple(other for other in range(k) if random.random() < 0.2)
        choices.append(Choice(ways, after))
        sets.append(options)
        waypoints = [planner.AnyOf([option_of(one) for one in each]) for each in options]
        tasks.append(planner.Task(waypoints, name=str(k), after=[str(other) for other in after]))
    found = planner.order_tasks(START, tasks, "trapezoidal")
    optimum = shortest(HOME, choices, None, LIMITS)
    assert found.estimate == pytest.approx(optimum, rel=1e-9)
    assert found.plan.trajectory.duration == pytest.approx(optimum, rel=1e-6)
    assert found.bound <= optimum * (1.0 + 1e-9)
    visited = [
        step
        for task, chosen in zip(found.order, found.options, strict=True)
        for each, option in zip(sets[task], chosen, strict=True)
        for step in each[option]
    ]
    assert np.array([HOME, *visited]) == pytest.approx(found.plan.path.positions, abs=1e-9)


def test_dwells_actions_and_origins_follow_the_chosen_option() -> None:
    far = joint_waypoint(np.array(HOME) + 1.0)
    near = planner.WaypointSequence([POINT, joint_waypoint(np.array(HOME) + 0.2)])
    signal = planner.SetOutput(planner.AtWaypoint(0), "close", True)
    pick = planner.Task([planner.AnyOf([far, near], dwell=0.5)], actions=[signal])
    found = planner.order_tasks(START, [pick], "trapezoidal")
    assert found.options == ((1,),)
    assert [origin.field for origin in found.origins[1:]] == [
        ("tasks", 0, "waypoints", 0, "options", 1, "waypoints", 0),
        ("tasks", 0, "waypoints", 0, "options", 1, "waypoints", 1),
    ]
    assert [waypoint.dwell for waypoint in found.problem.waypoints] == [0.0, 0.0, 0.5]
    assert [action.at for action in found.problem.actions] == [planner.AtWaypoint(2)]


def test_options_that_cannot_be_reached_are_not_chosen_and_named_if_all_are() -> None:
    found = planner.order_tasks(START, [planner.Task([planner.AnyOf([OUT_OF_REACH, POINT])])], "trapezoidal")
    assert found.options == ((1,),)
    with pytest.raises(planner.UnreachableWaypoint, match=r"waypoint 0 \(option 0\) of task 0"):
        planner.order_tasks(START, [planner.Task([planner.AnyOf([OUT_OF_REACH, OUT_OF_REACH])])], "trapezoidal")


@pytest.mark.parametrize(
    ("task", "field"),
    [
        (planner.Task([planner.AnyOf([])]), ("waypoints", 0, "options")),
        (planner.Task([planner.AnyOf([POINT]), POINT], reversible=True), ("reversible",)),
        (planner.Task([planner.AnyOf([POINT]), POINT], closed=True), ("closed",)),
        (planner.Task([planner.AnyOf([POINT] * 11), planner.AnyOf([POINT] * 10)]), ("waypoints", 1, "options")),
        (
            planner.Task([planner.AnyOf([POINT, planner.JointWaypoint(HOME, duration=2.0)])]),
            ("waypoints", 0, "options", 1, "duration"),
        ),
        (
            planner.Task([planner.AnyOf([POINT, planner.JointWaypoint(HOME, motion=planner.LinearMotion())])]),
            ("waypoints", 0, "options", 1, "motion"),
        ),
        (
            planner.Task([POINT, planner.AnyOf([planner.JointWaypoint([0.0])])]),
            ("waypoints", 1, "options", 0, "position"),
        ),
    ],
)
def test_faults_of_goal_sets_name_their_option(task: planner.Task, field: tuple[str | int, ...]) -> None:
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.order_tasks(START, [planner.Task([POINT]), task], "trapezoidal")
    assert ("tasks", 1, *field) in [fault.field for fault in refused.value.faults]
