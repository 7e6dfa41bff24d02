"""Cells of two to four robots: waits against the coordination diagram by brute force, clearances at dense samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, count

import numpy as np
import pytest

import planner
from planner.cells.coordination import Blocked, shortest_waits
from planner.cells.diagram import Axis, Diagram
from planner.cells.movers import Rules
from planner.spatial import Pose
from tests.planner.cells.arms import AWAY, MARGIN, REACH, STEPS, placed, times_of
from tests.planner.cells.brute_force import (
    distance_table,
    facing_capsule_arms,
    fewest_steps,
    least_distance,
    random_plan,
    robot_world,
)
from tests.sizes import SIZE


def cell_of(*plans: planner.Plan) -> list[planner.CellRobot]:
    return [planner.CellRobot(name, own.problem) for name, own in zip("abcd", plans, strict=False)]


@pytest.mark.sized
def test_cells_end_within_five_percent_of_the_bound_by_brute_force() -> None:
    rng = np.random.default_rng(5)
    solved = near_free_bound = 0
    while solved < max(1, SIZE.requests // 20):
        first, second = (random_plan(robot, rng, 4) for robot in facing_capsule_arms(rng.uniform(0.95, 1.3)))
        step = max(own.trajectory.duration for own in (first, second)) / (2 * STEPS)
        times = times_of(first, step), times_of(second, step)
        table = distance_table((first, second), times)
        free, shorter = table >= MARGIN, min(table.shape)
        rests = tuple(
            np.append(np.rint(own.trajectory.departures / step).astype(int)[:-1], len(of) - 1)
            for own, of in zip((first, second), times, strict=True)
        )
        if (
            fewest_steps(table >= MARGIN + 0.01, (rests[0], rests[1])) is None
            or np.diag(free[:shorter, :shorter]).all()
        ):
            continue  # blocked or nearly so, or free without waits
        solved += 1
        cell = planner.plan_cell(cell_of(first, second), margin=MARGIN)
        least, anywhere = fewest_steps(free, (rests[0], rests[1])), fewest_steps(free)
        assert least is not None
        assert anywhere is not None
        assert cell.duration <= 1.05 * (least + 1) * step
        assert cell.duration >= (anywhere - 2) * step
        near_free_bound += cell.duration <= 1.05 * anywhere * step
        worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
        assert least_distance(worlds[0], worlds[1], np.linspace(0.0, cell.duration, 60)) > MARGIN - 2e-5
    assert near_free_bound >= 0.95 * solved


def crossing_plans(apart: float = 1.3) -> tuple[planner.Plan, planner.Plan]:
    """Return plans of two arms that both reach between them and back."""
    first, second = facing_capsule_arms(apart)
    return (
        planner.plan(planner.PlanningProblem(first, [AWAY, REACH, AWAY])),
        planner.plan(planner.PlanningProblem(second, [AWAY, REACH, AWAY])),
    )


@pytest.mark.parametrize("skew", [0.0, 0.05])
def test_crossing_robots_wait_and_never_touch_for_any_skew(skew: float) -> None:
    plans = crossing_plans()
    with pytest.raises(planner.Collision):
        planner.clearance_between(*(planner.Mover.of_plan(n, own) for n, own in zip("ab", plans, strict=True)))
    cell = planner.plan_cell(cell_of(*plans), margin=MARGIN, skew=skew)
    longest = max(own.trajectory.duration for own in plans)
    assert longest < cell.duration < sum(own.trajectory.duration for own in plans) + 0.1
    assert cell.unhindered == tuple(own.trajectory.duration for own in plans)
    for own, alone, waits in zip(cell.plans, plans, cell.waits, strict=True):
        assert own.certificate.satisfied
        assert own.trajectory.duration == pytest.approx(alone.trajectory.duration + sum(waits), abs=1e-9)
    worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
    skews = np.linspace(-skew, skew, 3) if skew else np.zeros(1)
    least = least_distance(worlds[0], worlds[1], np.linspace(-skew, cell.duration + skew, 50), skews)
    assert least > MARGIN - 2e-5
    (between,) = cell.clearances
    assert between.movers == ("a", "b")
    assert MARGIN - 2e-5 <= between.clearance.lower <= least + 1e-6
    assert between.skew == skew


@pytest.mark.large_only
def test_a_larger_skew_takes_no_less_time() -> None:
    durations = [planner.plan_cell(cell_of(*crossing_plans()), skew=skew).duration for skew in (0.0, 0.3)]
    assert durations[0] + 0.15 < durations[1]


def test_robots_that_keep_apart_have_the_trajectories_of_their_own_plans() -> None:
    plans = crossing_plans(apart=3.0)
    cell = planner.plan_cell(cell_of(*plans), margin=MARGIN, skew=0.1)
    for own, alone in zip(cell.plans, plans, strict=True):
        assert np.array_equal(own.trajectory.coefficients, alone.trajectory.coefficients)
    assert cell.waits == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("count", [3, pytest.param(4, marks=pytest.mark.large_only)])
def test_robots_around_a_table_take_turns_and_never_touch(count: int) -> None:
    arm = planner.load_robot("ur5e")
    places = (-0.6, 0.0, 0.0), (0.6, 0.0, np.pi), (0.0, -0.6, np.pi / 2.0), (0.0, 0.6, -np.pi / 2.0)
    plans = [
        planner.plan(planner.PlanningProblem(placed(arm, *at), [AWAY, REACH, AWAY]), "ruckig") for at in places[:count]
    ]
    cell = planner.plan_cell(cell_of(*plans), margin=MARGIN)
    assert len(cell.clearances) == count * (count - 1) / 2
    assert cell.duration < sum(cell.unhindered)
    worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
    times = np.linspace(0.0, cell.duration, 12)
    assert all(least_distance(one, other, times) > MARGIN - 2e-5 for one, other in combinations(worlds, 2))


def test_a_requested_duration_is_that_of_the_motion_without_waits() -> None:
    first, second = crossing_plans()
    slow = replace(first.problem, duration=2.0)
    cell = planner.plan_cell([planner.CellRobot("a", slow), planner.CellRobot("b", second.problem)], margin=MARGIN)
    assert cell.plans[0].trajectory.duration == pytest.approx(2.0 + sum(cell.waits[0]))


def test_robots_wait_on_paths_of_optimised_duration() -> None:
    first, second = crossing_plans()
    earlier = planner.plan(first.problem).trajectory
    optimised = replace(first.problem, optimise="duration", optimise_iterates=3, warm_start=earlier)
    robots = [planner.CellRobot("a", optimised), planner.CellRobot("b", second.problem)]
    cell = planner.plan_cell(robots, margin=MARGIN)
    assert cell.plans[0].trajectory.duration == pytest.approx(cell.unhindered[0] + sum(cell.waits[0]))
    assert any(map(any, cell.waits))


@pytest.mark.large_only
def test_ends_that_touch_are_refused() -> None:
    first, second = facing_capsule_arms(0.9)
    problems = [planner.PlanningProblem(robot, [AWAY, REACH]) for robot in (first, second)]
    with pytest.raises(planner.Collision, match="no waits where the robots rest"):
        planner.plan_cell([planner.CellRobot(name, own) for name, own in zip("ab", problems, strict=True)])
    problems = [planner.PlanningProblem(robot, [REACH, AWAY]) for robot in (first, second)]
    with pytest.raises(planner.StartInCollision, match="before both start"):
        planner.plan_cell([planner.CellRobot(name, own) for name, own in zip("ab", problems, strict=True)])


def test_faults_of_cells_name_their_fields() -> None:
    (first, second) = (own.problem for own in crossing_plans(3.0))
    a, b = planner.CellRobot("a", first), planner.CellRobot("b", second)
    for robots in ((), (a,), (a, b, replace(a, name="c"), replace(a, name="d"), replace(a, name="e"))):
        with pytest.raises(planner.InvalidProblem, match="a cell must have 2 to 4 robots"):
            planner.plan_cell(robots)
    with pytest.raises(planner.InvalidProblem, match=r"robots\[1\].name"):
        planner.plan_cell([a, replace(b, name="a")])
    for field in ("skew", "margin"):
        for value in (-0.1, np.nan, np.inf):
            with pytest.raises(planner.InvalidProblem, match=field):
                planner.plan_cell([a, b], **{field: value})
    wrong = replace(b, problem=replace(second, waypoints=[[9.0] * 6, [0.0] * 6]))
    with pytest.raises(planner.PlanningError, match="robot 'b'"):
        planner.plan_cell([a, wrong])


PART = planner.SceneObject("part", [planner.Box([0.1, 0.1, 0.1])], Pose([-0.5, 0.0, 1.2]))
"""An object between two arms that face each other."""


def robots_apart() -> tuple[planner.CellRobot, planner.CellRobot]:
    """Return two robots of a cell whose workspaces do not meet."""
    robots = [placed(planner.load_robot("ur5e"), x, 0.0, turn) for x, turn in ((0.0, 0.0), (3.0, np.pi))]
    a, b = (
        planner.CellRobot(n, planner.PlanningProblem(r, [AWAY, REACH, AWAY])) for n, r in zip("ab", robots, strict=True)
    )
    return a, b


def test_objects_of_the_scene_are_around_every_robot() -> None:
    robots = robots_apart()
    wall = planner.SceneObject("wall", [planner.Box([0.1, 2.0, 2.0])], Pose([2.4, 0.0, 0.5]))
    with pytest.raises(planner.Collision, match="robot 'b'") as refused:
        planner.plan_cell(robots, scene=planner.Scene([wall], margin=0.01), budget=planner.Budget(3))
    assert refused.value.robot == 1
    assert "wall" in refused.value.pair
    assert not refused.value.remedies
    assert all(hint.field[0] in ("robots", "scene") for hint in refused.value.hints)


def test_scenes_of_robots_and_of_the_cell_do_not_contradict_each_other() -> None:
    a, b = robots_apart()
    own = replace(b, problem=replace(b.problem, scene=planner.Scene([PART])))
    with pytest.raises(planner.InvalidProblem, match=r"robots\[1\].scene.objects: must be empty"):
        planner.plan_cell([a, own])
    held = planner.AttachedObject("held", PART.shapes)
    with pytest.raises(planner.InvalidProblem, match=r"^scene.attached: must be empty: each robot has its own$"):
        planner.plan_cell([a, b], scene=planner.Scene([PART], [held]))
    twice = planner.Scene([PART, PART])
    with pytest.raises(planner.InvalidProblem, match=r"^scene.objects\[1\].id"):
        planner.plan_cell([a, b], scene=twice)


def taking(robot: planner.CellRobot, index: int, name: str) -> planner.CellRobot:
    waypoints = [planner.JointWaypoint(tuple(position)) for position in (AWAY, REACH, AWAY)]
    waypoints[index] = replace(waypoints[index], attach=[planner.Attach(name)])
    return replace(robot, problem=replace(robot.problem, waypoints=waypoints))


def test_no_object_goes_from_one_robot_to_another() -> None:
    a, b = robots_apart()
    robots = [taking(a, 1, "part"), taking(b, 2, "part")]
    fault = r"^robots\[1\].waypoints\[2\].attach\[0\].id: must be an object that no other robot takes, or .*; robot 'a'"
    with pytest.raises(planner.InvalidProblem, match=fault):
        planner.plan_cell(robots, scene=planner.Scene([PART]))
    away = planner.JointWaypoint(tuple(AWAY))
    options = planner.AnyOf([away, [away, robots[1].problem.waypoints[2]]])
    with_options = replace(b, problem=replace(b.problem, waypoints=[away, options]))
    with pytest.raises(planner.InvalidProblem, match=r"waypoints\[1\].options\[1\].waypoints\[1\].attach\[0\].id"):
        planner.plan_cell([robots[0], with_options], scene=planner.Scene([PART]))
    with pytest.raises(
        planner.InvalidProblem, match=r"robots\[1\].waypoints\[2\].attach\[0\].id: nothing in the scene"
    ):
        planner.plan_cell([a, taking(b, 2, "other")], scene=planner.Scene([PART]))


def test_a_spent_budget_ends_the_search_for_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    robots = cell_of(*crossing_plans())
    with pytest.raises(planner.Collision, match="no waits that keep the robots apart were found in time"):
        planner.plan_cell(robots, margin=MARGIN, budget=planner.Budget(seconds=1e-6))
    apart = planner.plan_cell(cell_of(*crossing_plans(3.0)), budget=planner.Budget(seconds=1e-6))
    assert len(apart.clearances) == 1
    ticks = count()  # the budget ends while the first diagram is made
    for module in ("plan", "waits"):
        monkeypatch.setattr(f"planner.cells.{module}.monotonic", lambda: float(next(ticks)))
    monkeypatch.setattr("planner.scene.blocks.monotonic", lambda: np.inf)
    with pytest.raises(planner.Collision, match="found in time"):
        planner.plan_cell(robots, margin=MARGIN, budget=planner.Budget(seconds=3.5))
    monkeypatch.undo()
    movers = [planner.Mover.of_plan(name, own) for name, own in zip("ab", crossing_plans(3.0), strict=True)]
    axes = [Axis(mover, mover.duration / 8.0, np.array([0.0, mover.duration])) for mover in movers]
    assert not Diagram.of(axes[0], axes[1], Rules(MARGIN))[0].cells.any()
    assert Diagram.of(axes[0], axes[1], Rules(MARGIN), end=0.0)[0].cells.all()


@pytest.mark.sized
def test_free_entries_of_a_diagram_are_free_and_clearly_free_ones_are_found() -> None:
    rng = np.random.default_rng(11)
    for _ in range(max(1, SIZE.requests // 240)):
        plans = tuple(random_plan(robot, rng, 3) for robot in facing_capsule_arms(0.8))
        first, second = plans[0], plans[1]
        axes = [
            Axis(planner.Mover.of_plan("arm", own), own.trajectory.duration / 16.0, own.trajectory.departures)
            for own in plans
        ]
        (diagram,) = Diagram.of(axes[0], axes[1], Rules(MARGIN))
        blocked = diagram.cells
        inside = [np.linspace(axis.cells[:, 0], axis.cells[:, 1], 4).T.ravel() for axis in axes]
        table = distance_table((first, second), (inside[0], inside[1]))
        least = table.reshape(len(axes[0].cells), 4, len(axes[1].cells), 4).min(axis=(1, 3))
        assert blocked.any()
        assert not blocked.all()
        assert least[~blocked].min() > MARGIN - 1e-6
        assert not blocked[least > MARGIN + 0.5].any()
        at_rest = distance_table((first, second), (axes[0].rests, axes[1].rests))
        assert np.array_equal(diagram.both_rest, at_rest < MARGIN)


def test_shortest_waits_equal_those_of_all_paths() -> None:
    rng = np.random.default_rng(2)
    for _ in range(60):
        rows, columns = rng.integers(2, 9, 2)
        rests = [np.unique(np.append(rng.integers(0, n + 1, 2), [0, n])) for n in (rows, columns)]
        both = rng.random((rows, columns)) < 0.35
        first, second = np.ones((rows, columns + 1), dtype=bool), np.ones((rows + 1, columns), dtype=bool)
        first[:, rests[1]] = rng.random((rows, len(rests[1]))) < 0.2
        second[rests[0]] = rng.random((len(rests[0]), columns)) < 0.2
        found = shortest_waits(Blocked(both, first, second))
        reached, steps = {(0, 0)}, 0
        while reached and (rows, columns) not in reached:  # breadth first, without a table
            after = {(i + 1, j + 1) for i, j in reached if i < rows and j < columns and not both[i, j]}
            after |= {(i + 1, j) for i, j in reached if i < rows and not first[i, j]}
            reached = after | {(i, j + 1) for i, j in reached if j < columns and not second[i, j]}
            steps += 1
        assert (found is None) == (not reached)
        if found is not None:
            assert len(found[0]) - 1 == steps
