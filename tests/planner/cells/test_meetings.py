"""Meetings and handovers in cells: waits by brute force, and carried objects at dense samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.cells.coordination import Blocked, shortest_waits, through
from planner.robots import Robot
from planner.spatial import Pose, rotation_with_z_along
from tests.planner.cells.arms import AWAY, MARGIN, REACH, STEPS, placed, times_of
from tests.planner.cells.brute_force import (
    Placed,
    distance,
    distance_table,
    facing_capsule_arms,
    fewest_steps,
    least_distance,
    random_plan,
    robot_world,
    se3,
)
from tests.planner.scene.random_scenes import in_capsules
from tests.sizes import SIZE

ASIDE = [np.pi + 0.7, *REACH[1:]]
"""A joint position of the UR5e that reaches to the side."""


OTHER = [np.pi - 0.7, *REACH[1:]]
"""One to the other side."""


def list_of(*waypoints: tuple[list[float], dict[str, Any]] | list[float]) -> list[planner.JointWaypoint]:
    return [
        planner.JointWaypoint(own[0], **own[1]) if isinstance(own, tuple) else planner.JointWaypoint(own)
        for own in waypoints
    ]


def member(name: str, robot: Robot, waypoints: list[planner.JointWaypoint]) -> planner.CellRobot:
    return planner.CellRobot(name, planner.PlanningProblem(robot, waypoints, self_collision=False))


@pytest.mark.sized
def test_cells_with_a_meeting_end_within_five_percent_of_the_bound_by_brute_force() -> None:
    rng, solved, waited = np.random.default_rng(7), 0, 0
    while solved < max(1, SIZE.requests // 90):
        plans = [random_plan(robot, rng, 4) for robot in facing_capsule_arms(rng.uniform(0.95, 1.3))]
        stops = rng.integers(1, 3, 2).tolist()
        step = max(own.trajectory.duration for own in plans) / STEPS
        times = [times_of(own, step) for own in plans]
        table = distance_table((plans[0], plans[1]), (times[0], times[1]))
        rests = [
            np.append(np.rint(own.trajectory.departures / step).astype(int)[:-1], len(of) - 1)
            for own, of in zip(plans, times, strict=True)
        ]
        i, j = (int(own[stop]) for own, stop in zip(rests, stops, strict=True))
        bounds = []
        for free in (table >= MARGIN, table >= MARGIN + 0.03):
            before = fewest_steps(free[: i + 1, : j + 1], (rests[0][rests[0] <= i], rests[1][rests[1] <= j]))
            after = fewest_steps(free[i:, j:], (rests[0][rests[0] >= i] - i, rests[1][rests[1] >= j] - j))
            bounds.append(None if before is None or after is None else before + after)
        if bounds[1] is None:
            continue  # blocked, or nearly so
        robots = []
        for name, own, stop in zip("ab", plans, stops, strict=True):
            waypoints = list(own.problem.waypoints)
            waypoints[stop] = replace(waypoints[stop], name="here")
            robots.append(planner.CellRobot(name, replace(own.problem, waypoints=waypoints)))
        cell = planner.plan_cell(robots, margin=MARGIN, meetings=["here"])
        solved += 1
        waited += any(map(any, cell.waits))
        assert bounds[0] is not None
        assert (bounds[0] - 4) * step <= cell.duration <= 1.05 * (bounds[1] + 2) * step
        (met,) = cell.meetings
        assert met.waypoints == dict(zip("ab", stops, strict=True))
        for own, stop in zip(cell.plans, stops, strict=True):
            assert own.trajectory.departures[stop] >= met.time - 1e-9
            assert own.trajectory.arrivals[stop] <= met.time + 1e-9
        worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
        assert least_distance(worlds[0], worlds[1], np.linspace(0.0, cell.duration, 60)) > MARGIN - 2e-5
    assert waited == solved


def test_paths_through_a_node_are_the_shortest_of_all() -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        rows, columns = (int(n) for n in rng.integers(3, 8, 2))
        at = int(rng.integers(0, rows + 1)), int(rng.integers(0, columns + 1))
        both, first, second = (
            rng.random(shape) < 0.2 for shape in ((rows, columns), (rows, columns + 1), (rows + 1, columns))
        )
        found = shortest_waits(through(Blocked(both, first, second), at))

        def steps(a: tuple[int, int], b: tuple[int, int], moves: tuple[np.ndarray, ...]) -> int | None:
            reached, count = {a}, 0  # breadth first
            while reached and b not in reached:
                after = {(i + 1, j + 1) for i, j in reached if i < b[0] and j < b[1] and not moves[0][i, j]}
                after |= {(i + 1, j) for i, j in reached if i < b[0] and not moves[1][i, j]}
                reached = after | {(i, j + 1) for i, j in reached if j < b[1] and not moves[2][i, j]}
                count += 1
            return count if reached else None

        halves = [steps(a, b, (both, first, second)) for a, b in (((0, 0), at), (at, (rows, columns)))]
        assert (found is None) == (None in halves)
        if found is not None:
            assert len(found[0]) - 1 == sum(half or 0 for half in halves)
            assert at in set(zip(*(own.tolist() for own in found), strict=True))


@pytest.mark.large_only
def test_three_robots_meet_two_by_two_and_never_touch() -> None:
    arm = planner.load_robot("ur5e")
    places = (-0.7, 0.0, 0.0), (0.7, 0.0, np.pi), (0.0, -0.7, np.pi / 2.0)
    robots = [placed(arm, *at) for at in places]
    for robot in robots:
        in_capsules(robot)
    first, second = ({"name": name, "dwell": 0.2} for name in ("first", "second"))
    cell = planner.plan_cell(
        [
            member("a", robots[0], list_of(AWAY, REACH, (AWAY, first))),
            member("b", robots[1], list_of(AWAY, (OTHER, first), (AWAY, second), OTHER)),
            member("c", robots[2], list_of(AWAY, (REACH, {"dwell": 1.0}), (AWAY, second | {"dwell": 0.7}), REACH)),
        ],
        margin=MARGIN,
        meetings=["first", "second"],
    )
    assert [dict(met.waypoints) for met in cell.meetings] == [{"a": 2, "b": 1}, {"b": 2, "c": 2}]
    for met in cell.meetings:
        plans = [cell.plans["abc".index(name)] for name in met.waypoints]
        stops = list(met.waypoints.values())
        arrivals = [own.trajectory.arrivals[stop] for own, stop in zip(plans, stops, strict=True)]
        assert met.time == pytest.approx(max(arrivals) + (0.7 if met.name == "second" else 0.2), abs=1e-6)
        for own, stop in zip(plans, stops, strict=True):
            if stop < len(own.problem.waypoints) - 1:  # else it rests there for good
                assert own.trajectory.departures[stop] >= met.time - 1e-9
    worlds = [robot_world(own.problem.robot, own.trajectory) for own in cell.plans]
    times = np.linspace(0.0, cell.duration, 12)
    assert all(least_distance(one, other, times) > MARGIN - 2e-5 for one, other in combinations(worlds, 2))


def tool_pose(robot: Robot, position: list[float]) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.array(position))
    return se3(robot.mounting) * data.oMf[robot.tool_frame_id]


def handing_over() -> tuple[planner.CellRobot, planner.CellRobot, planner.SceneObject, list[tuple[str, str]]]:
    """Return a robot that takes a bar to another one, the bar, and the pairs that touch there."""
    left, right = facing_capsule_arms(2.0)
    ends = [tool_pose(robot, REACH).translation for robot in (left, right)]
    along = ends[1] - ends[0]
    bar = planner.Box([0.04, 0.04, float(np.linalg.norm(along)) + 0.04])
    there = pin.SE3(
        rotation_with_z_along(along / np.linalg.norm(along)), (ends[0] + ends[1]) / 2.0 - np.array([0.0, 0.0, 0.04])
    )
    first = tool_pose(left, ASIDE) * tool_pose(left, REACH).inverse() * there
    take, meets = {"attach": [planner.Attach("bar")], "dwell": 0.3}, {"name": "handover"}
    robots = (
        member("left", left, list_of(AWAY, (ASIDE, take), (REACH, meets | {"detach": ["bar"], "dwell": 0.5}), AWAY)),
        member("right", right, list_of(AWAY, (REACH, meets | take), (ASIDE, {"detach": ["bar"]}), AWAY)),
    )
    pairs = [
        (f"{one}/bar", f"{other}/{link}")
        for one, other in (("left", "right"), ("right", "left"))
        for link in ("link_5", "link_6")
    ]
    return *robots, planner.SceneObject("bar", [bar], Pose(first.translation, first.rotation)), pairs


@pytest.mark.parametrize("skew", [0.0, pytest.param(0.05, marks=pytest.mark.large_only)])
def test_an_object_goes_from_robot_to_robot_and_touches_nothing_but_them(skew: float) -> None:
    left, right, bar, pairs = handing_over()
    cell = planner.plan_cell(
        [left, right],
        scene=planner.Scene([bar]),
        margin=MARGIN,
        skew=skew,
        meetings=["handover"],
        allowed_pairs=pairs,
    )
    (met,) = cell.meetings
    taken, given = cell.plans[0].trajectory.departures[1:3]
    got, put = cell.plans[1].trajectory.departures[1:3]
    assert min(given, got) >= met.time - 1e-9
    assert cell.plans[1].trajectory.arrivals[1] + 0.5 <= met.time + 1e-9, "the dwell of the other robot counts, too"
    robots = [left.problem.robot, right.problem.robot]
    paths = [own.trajectory for own in cell.plans]
    grips = [
        tool_pose(robots[0], ASIDE).inverse() * se3(bar.pose),
        tool_pose(robots[1], REACH).inverse() * tool_pose(robots[0], REACH)
        * tool_pose(robots[0], ASIDE).inverse() * se3(bar.pose),
    ]  # fmt: skip

    def held(k: int, time: float) -> pin.SE3:
        at = paths[k].evaluate(min(max(time, 0.0), paths[k].duration), [0])[0]
        return tool_pose(robots[k], at) * grips[k]

    def bars(time: float, shifted: float) -> Placed:
        """Return the bar where the robots have it: in the hands of one of them."""
        pose = (
            se3(bar.pose)
            if time < taken
            else held(0, min(time, given))
            if shifted < got
            else held(1, min(shifted, put))
        )
        return [(bar.shapes[0], pose)]

    worlds = [robot_world(robot, path) for robot, path in zip(robots, paths, strict=True)]
    least = np.inf
    for shift in np.linspace(-skew, skew, 3) if skew else [0.0]:
        for time in np.linspace(0.0, cell.duration, 80):
            a, b, thing = worlds[0](time), worlds[1](time + shift), bars(time, time + shift)
            least = min(least, distance(a, b), distance(thing, a[:-2]), distance(thing, b[:-2]))
    assert least > MARGIN - 2e-5
    ends = held(1, put).translation, se3(bar.pose).translation
    assert np.linalg.norm(ends[0] - ends[1]) > 0.5, "the other robot takes the bar away"
    start = cell.plans[1].problem.scene
    assert start is not None
    arrived = {thing.id: thing.pose for thing in start.objects}
    assert np.allclose(arrived["bar"].position, held(0, given).translation)
    assert np.allclose(arrived["bar before it is taken"].position, bar.pose.position)


def test_a_handover_without_allowed_pairs_is_refused() -> None:
    left, right, bar, pairs = handing_over()
    with pytest.raises(planner.Collision, match="bar"):
        planner.plan_cell([left, right], scene=planner.Scene([bar]), meetings=["handover"], allowed_pairs=pairs[:3])


def changed(robot: planner.CellRobot, index: int, **fields: Any) -> planner.CellRobot:
    waypoints = list(robot.problem.waypoints)
    waypoints[index] = replace(waypoints[index], **fields)
    return replace(robot, problem=replace(robot.problem, waypoints=waypoints))


def test_faults_of_meetings_and_handovers_name_their_fields() -> None:
    left, right, bar, pairs = handing_over()
    names = changed(left, 1, name="first"), changed(right, 2, name="first")
    through_there = changed(right, 1, transition=planner.ThroughTransition())
    away = planner.JointWaypoint(tuple(AWAY))
    back = [away, right.problem.waypoints[1], replace(away, name="back", detach=["bar"]), away]
    again = [*left.problem.waypoints[:3], replace(away, name="back", attach=[planner.Attach("bar")]), away]
    circle = (
        replace(left, problem=replace(left.problem, waypoints=again)),
        replace(right, problem=replace(right.problem, waypoints=back)),
    )
    ends = replace(right, problem=replace(right.problem, waypoints=right.problem.waypoints[:2]))
    third = replace(right, name="third")
    cases: list[tuple[tuple[planner.CellRobot, ...], list[str], str]] = [
        ((left, right), ["nowhere"], r"meetings\[0\]: must be the name of a waypoint of two robots or more; no robot"),
        ((changed(left, 2, name="x"), right), ["x"], r"meetings\[0\]: must be .* 'left' has one"),
        ((left, right), ["handover", "handover"], r"meetings\[1\]: must differ from meeting 0"),
        (names, ["first", "handover"], r"robots\[1\].waypoints\[1\].name: must come after waypoint 2"),
        ((changed(left, 0, name="handover"), right), ["handover"], r"robots\[0\].waypoints\[2\].name: must differ"),
        ((left, through_there), ["handover"], r"robots\[1\].waypoints\[1\].transition: must be a stop"),
        ((left, right), [], r"robots\[1\].waypoints\[1\].attach\[0\].id: must be an object that no other robot takes"),
        ((left, ends), ["handover"], r"robots\[1\].waypoints\[1\]: must not be the last waypoint: 'bar'"),
        ((changed(left, 3, attach=[planner.Attach("bar")]), right), ["handover"], r"robots\[0\].waypoints\[3\]: must"),
        ((left, changed(right, 0, detach=["bar"])), ["handover"], r"robots\[1\].waypoints\[0\]: must not handle 'bar'"),
        ((left, right, third), ["handover"], r"meetings: must have one robot that takes 'bar'; robots 'right' and"),
        (circle, ["handover", "back"], r"meetings: objects must not go in a circle"),
    ]
    for robots, meetings, fault in cases:
        with pytest.raises(planner.InvalidProblem, match=fault):
            planner.plan_cell(robots, scene=planner.Scene([bar]), meetings=meetings, allowed_pairs=pairs)
    pairs_with_faults = {
        ("left/bar", "right"): r"allowed_pairs\[0\]: must have names `robot/link`",
        ("left/bar", "left/link_1"): r"allowed_pairs\[0\]: must have names of two robots",
    }
    for pair, fault in pairs_with_faults.items():
        with pytest.raises(planner.InvalidProblem, match=fault):
            planner.plan_cell([left, right], scene=planner.Scene([bar]), meetings=["handover"], allowed_pairs=[pair])
