"""Tasks in order: the same optimum as brute force, bounds, rules, and plans through the requested waypoints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.problems.problem import LinearMotion
from tests.planner.tasks.brute_force import Choice, contour_ways, joint_times, shortest
from tests.planner.tasks.parts import DOWN, HOME, LIMITS, ROBOT, joint_waypoint, over_table, random_position
from tests.sizes import SIZE

CASES = max(2, SIZE.examples // 20)
"""Seeds of random tasks: 2, and 100 before a release."""


def random_tasks(random: np.random.Generator, count: int) -> tuple[list[planner.Task], list[Choice]]:
    """Draw points, seams, contours and pairs, with rules; and the same for brute force."""
    tasks: list[planner.Task] = []
    choices: list[Choice] = []
    groups = random.permutation(["left"] * 3 + ["right"] * 2 + [""] * (count - 5)).tolist()
    for k in range(count):
        kind = ["point", "seam", "contour", "pair"][int(random.integers(4))]
        positions = tuple(random_position(random) for _ in range({"point": 1, "contour": 3}.get(kind, 2)))
        ways = {"seam": (positions, positions[::-1]), "contour": contour_ways(positions)}.get(kind, (positions,))
        after = tuple(int(other) for other in range(k) if random.random() < 0.15)
        group = groups[k] or None
        choices.append(Choice(ways, after, group))
        tasks.append(
            planner.Task(
                [joint_waypoint(q) for q in positions],
                name=str(k),
                reversible=kind in ("seam", "contour"),
                closed=kind == "contour",
                after=[str(other) for other in after],
                group=group,
            )
        )
    return tasks, choices


@pytest.mark.sized
@pytest.mark.parametrize("seed", range(CASES))
def test_order_of_8_tasks_with_rules_is_as_short_as_the_shortest_of_all_orders(seed: int) -> None:
    random = np.random.default_rng(seed)
    tasks, choices = random_tasks(random, 8)
    end = random_position(random) if seed % 2 else None
    waypoints = [joint_waypoint(HOME)] + ([] if end is None else [joint_waypoint(end)])
    try:
        found = planner.order_tasks(planner.PlanningProblem(ROBOT, waypoints), tasks, "trapezoidal")
    except planner.InvalidProblem:
        assert shortest(HOME, choices, end, LIMITS) == np.inf
        return
    optimum = shortest(HOME, choices, end, LIMITS)
    assert found.estimate == pytest.approx(optimum, rel=1e-9)
    assert found.plan.trajectory.duration == pytest.approx(optimum, rel=1e-6)
    assert found.bound <= optimum * (1.0 + 1e-9)
    places = {task: k for k, task in enumerate(found.order)}
    assert sorted(places) == list(range(8))
    for k, choice in enumerate(choices):
        assert all(places[other] < places[k] for other in choice.after)
    for group in ("left", "right"):
        together = sorted(places[k] for k, choice in enumerate(choices) if choice.group == group)
        assert together == list(range(together[0], together[-1] + 1))


@pytest.mark.sized
@pytest.mark.parametrize("seed", range(CASES))
def test_order_of_8_poses_chooses_the_configurations_of_the_shortest_order(seed: int) -> None:
    random = np.random.default_rng(100 + seed)
    poses = [over_table(*random.uniform([0.3, -0.4], [0.65, 0.4])) for _ in range(8)]
    choices = [Choice(tuple((tuple(q),) for q in planner.all_solutions(ROBOT, pose, reference=HOME))) for pose in poses]
    problem = planner.PlanningProblem(ROBOT, ["home", "home"])
    found = planner.order_tasks(problem, [planner.Task([planner.PoseWaypoint(pose)]) for pose in poses], "trapezoidal")
    optimum = shortest(HOME, choices, HOME, LIMITS)
    assert found.estimate == pytest.approx(optimum, rel=1e-6)
    assert 0.5 * optimum < found.bound <= optimum


def test_plan_visits_the_seams_in_the_directions_of_the_order() -> None:
    ends = [((0.4, -0.3), (0.4, -0.1)), ((0.5, 0.1), (0.5, 0.3)), ((0.6, -0.1), (0.6, -0.3))]
    tasks = [
        planner.Task(
            [
                planner.PoseWaypoint(over_table(*start)),
                planner.PoseWaypoint(over_table(*end), motion=LinearMotion(), name=f"seam {k}"),
            ],
            reversible=True,
        )
        for k, (start, end) in enumerate(ends)
    ]
    found = planner.order_tasks(planner.PlanningProblem(ROBOT, ["home"]), tasks, "trapezoidal")
    reached = planner.forward_kinematics(ROBOT, found.plan.path.positions)
    for k, (task, is_reversed) in enumerate(zip(found.order, found.reversed, strict=True)):
        wanted = ends[task][::-1] if is_reversed else ends[task]
        for pose, point in zip(reached[1 + 2 * k : 3 + 2 * k], wanted, strict=True):
            assert pose.position == pytest.approx([*point, 0.1], abs=1e-5)
    times = found.plan.trajectory.sample_times(0.01)
    tool = np.array([pose.position for pose in planner.forward_kinematics(ROBOT, found.plan.trajectory(times))])
    assert np.abs(tool[:, 2] - 0.1).min() < 1e-4
    assert found.bound <= found.plan.trajectory.duration


@pytest.mark.large_only
def test_closed_contour_is_entered_where_it_is_near_and_left_there() -> None:
    corners = [(0.3, -0.1), (0.5, -0.1), (0.5, 0.1), (0.3, 0.1)]
    contour = planner.Task(
        [planner.PoseWaypoint(over_table(*corner), motion=LinearMotion()) for corner in corners], closed=True
    )
    for near in range(4):
        start = planner.inverse_kinematics(ROBOT, over_table(*corners[near], 0.2), reference=HOME).position
        found = planner.order_tasks(planner.PlanningProblem(ROBOT, [start, start]), [contour], "trapezoidal")
        assert found.first == (near,)
        reached = planner.forward_kinematics(ROBOT, found.plan.path.positions[1:-1])
        wanted = [corners[(near + k) % 4] for k in range(5)]
        assert np.array([pose.position[:2] for pose in reached]) == pytest.approx(np.array(wanted), abs=1e-5)


@pytest.mark.parametrize("dwells", [(3.0, 0.0), (0.0, 3.0)])
def test_estimate_counts_the_dwell_at_the_entry_of_a_contour_twice(dwells: tuple[float, float]) -> None:
    turned = [(HOME[0] + angle, *HOME[1:]) for angle in (0.5, 0.2)]
    corners = [planner.JointWaypoint(q, dwell=dwell) for q, dwell in zip(turned, dwells, strict=True)]
    found = planner.order_tasks(
        planner.PlanningProblem(ROBOT, [joint_waypoint(HOME)]), [planner.Task(corners, closed=True)], "trapezoidal"
    )
    assert dwells[found.first[0]] == 0.0
    assert found.estimate == pytest.approx(found.plan.trajectory.duration, rel=1e-6)
    assert found.bound <= found.plan.trajectory.duration * (1.0 + 1e-9)


@pytest.mark.large_only
def test_many_tasks_with_all_rules_of_one_order_are_in_this_order() -> None:
    count = 100
    random = np.random.default_rng(3)
    rank = random.permutation(count)
    tasks = [
        planner.Task(
            [joint_waypoint(random_position(random))],
            name=str(k),
            after=[str(other) for other in np.flatnonzero(rank < rank[k])],
            group=f"pair {rank[k] // 2}",
        )
        for k in range(count)
    ]
    found = planner.order_tasks(planner.PlanningProblem(ROBOT, [joint_waypoint(HOME)]), tasks, "trapezoidal")
    assert rank[list(found.order)].tolist() == list(range(count))


@pytest.mark.large_only
def test_equal_requests_have_equal_orders() -> None:
    random = np.random.default_rng(7)
    tasks = [
        planner.Task([planner.PoseWaypoint(over_table(*random.uniform([0.3, -0.4], [0.6, 0.4])))]) for _ in range(30)
    ]
    problem = planner.PlanningProblem(ROBOT, ["home"])
    first, second = (planner.order_tasks(problem, tasks, "trapezoidal") for _ in range(2))
    assert first.order == second.order
    assert first.plan.trajectory.duration == second.plan.trajectory.duration
    assert first.bound <= first.plan.trajectory.duration


def test_single_task_two_equal_tasks_and_tasks_in_a_row() -> None:
    problem = planner.PlanningProblem(ROBOT, ["home"])
    goal = joint_waypoint(np.array(HOME) + 0.5)
    alone = planner.order_tasks(problem, [planner.Task([goal])], "trapezoidal")
    assert alone.order == (0,)
    assert alone.gap == pytest.approx(0.0, abs=1e-9)
    twice = planner.order_tasks(problem, [planner.Task([goal]), planner.Task([goal])], "trapezoidal")
    assert sorted(twice.order) == [0, 1]
    assert twice.plan.trajectory.duration == pytest.approx(alone.plan.trajectory.duration)
    in_a_row = [np.array(HOME) + shift for shift in (0.9, 0.3, 1.2, 0.6)]
    row = planner.order_tasks(problem, [planner.Task([joint_waypoint(q)]) for q in in_a_row], "trapezoidal")
    assert row.order == (1, 3, 0, 2)
    steps = 4.0 * joint_times(np.zeros((1, 6)), np.full((1, 6), 0.3), LIMITS)[0, 0]
    assert row.plan.trajectory.duration == pytest.approx(steps)
    assert row.bound == pytest.approx(steps)


def test_turns_about_the_tool_shorten_an_order() -> None:
    turned = [np.pi * k / 5 for k in (0, 3, 1, 4)]
    poses = [
        planner.Pose(np.array([0.45, -0.2 + 0.1 * k, 0.1]), DOWN @ planner.rotation_from_rpy(0.0, 0.0, turn))
        for k, turn in enumerate(turned)
    ]
    problem = planner.PlanningProblem(ROBOT, ["home"])
    durations = [
        planner.order_tasks(
            problem, [planner.Task([planner.PoseWaypoint(pose, free=free)]) for pose in poses], "trapezoidal"
        ).plan.trajectory.duration
        for free in (None, "rotation_z")
    ]
    assert durations[1] < 0.9 * durations[0]


@pytest.mark.parametrize("mode", [None, planner.ResidualVibration(8.0, 0.05)])
@pytest.mark.parametrize("least", [0.0, 3.0])
def test_estimates_know_least_durations_and_the_time_of_shaping(
    mode: planner.ResidualVibration | None, least: float
) -> None:
    random = np.random.default_rng(1)
    points = [joint_waypoint(random_position(random)) for _ in range(4)]
    line = [joint_waypoint(random_position(random)), replace(points[3], minimum_duration=least)]
    tasks = [planner.Task([replace(points[0], minimum_duration=least)]), planner.Task(points[1:2]), planner.Task(line)]
    end = replace(joint_waypoint(HOME), minimum_duration=least)
    problem = planner.PlanningProblem(ROBOT, [joint_waypoint(HOME), end], residual_vibration=mode)
    found = planner.order_tasks(problem, tasks, "trapezoidal")
    assert found.estimate == pytest.approx(found.plan.trajectory.duration, rel=1e-9)
    assert 3.0 * least <= found.bound <= found.estimate * (1 + 1e-12)


def test_actions_happen_at_the_waypoints_of_their_tasks_and_of_the_start_and_the_end() -> None:
    random = np.random.default_rng(4)
    tasks = []
    for k in range(4):
        waypoints = [replace(joint_waypoint(random_position(random)), dwell=0.5) for _ in range(2)]
        actions = [
            planner.Wait(planner.AtWaypoint(1), 0.3),
            planner.SetOutput(planner.AtWaypoint(1), f"done {k}", True),
            planner.SetOutput(planner.AtWaypoint(0), f"begun {k}", True),
        ]
        tasks.append(planner.Task(waypoints, actions=actions))
    given = [planner.SetOutput(planner.AtWaypoint(k), name, True) for k, name in ((0, "started"), (1, "ended"))]
    problem = planner.PlanningProblem(ROBOT, ["home", "home"], actions=given)
    found = planner.order_tasks(problem, tasks, "trapezoidal")
    at = {timed.action.name: timed.time for timed in found.plan.actions if isinstance(timed.action, planner.SetOutput)}
    assert len(at) == 10
    assert at["started"] == 0.0
    assert at["ended"] == found.plan.trajectory.duration
    for row, origin in enumerate(found.origins):
        if origin.task is not None:
            name, later = ("done", 0.3) if origin.waypoint else ("begun", 0.0)
            arrival = float(found.plan.trajectory.arrivals[row])
            assert at[f"{name} {origin.task}"] == pytest.approx(arrival + later, abs=1e-9)
