"""Tasks with different tools: when the robot changes them, and where their points go."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planner
from tests.planner.tasks.brute_force import Choice, Positions, shortest
from tests.planner.tasks.parts import DOWN, HOME, LIMITS, ROBOT, joint_waypoint, over_table, random_position
from tests.sizes import SIZE

CASES = max(2, SIZE.examples // 20)
"""Seeds of random tasks: 2, and 100 before a release."""

LONG, SHORT = planner.Pose([0.0, 0.0, 0.2], np.eye(3)), planner.Pose([0.03, 0.0, 0.08], np.eye(3))


def held(name: str, point: planner.Pose, positions: Positions) -> planner.ChangeableTool:
    way = [joint_waypoint(q) for q in positions]
    return planner.ChangeableTool(name, point, planner.Task(way), planner.Task(way[::-1]))


def near_home(*offsets: float) -> tuple[tuple[float, ...], ...]:
    return tuple((HOME[0] + offset, *HOME[1:]) for offset in offsets)


HOLDERS = {"drill": near_home(-1.2, -1.3), "mill": near_home(-1.5)}
TOOLS = [held("drill", LONG, HOLDERS["drill"]), held("mill", SHORT, HOLDERS["mill"])]


@pytest.mark.sized
@pytest.mark.parametrize("seed", range(CASES))
def test_order_of_8_tasks_with_tools_is_as_short_as_the_shortest_of_all_orders(seed: int) -> None:
    random = np.random.default_rng(seed)
    changeable = {name: tuple(random_position(random) for _ in range(count)) for name, count in (("a", 1), ("b", 2))}
    tasks, choices = [], []
    for k in range(8):
        positions = tuple(random_position(random) for _ in range(int(random.integers(1, 3))))
        tool = (None, "a", "b")[int(random.integers(3))]
        after = tuple(other for other in range(k) if random.random() < 0.1)
        choices.append(Choice((positions,), after, tool=tool))
        waypoints = [joint_waypoint(q) for q in positions]
        tasks.append(planner.Task(waypoints, name=str(k), after=[str(other) for other in after], tool=tool))
    end = random_position(random) if seed % 2 else None
    problem = planner.PlanningProblem(ROBOT, [joint_waypoint(q) for q in (HOME, end) if q is not None])
    tools = [held(name, LONG, positions) for name, positions in changeable.items()]
    found = planner.order_tasks(problem, tasks, "trapezoidal", tools=tools)
    optimum = shortest(HOME, choices, end, LIMITS, changeable)
    assert found.estimate == pytest.approx(optimum, rel=1e-9)
    assert found.plan.trajectory.duration == pytest.approx(optimum, rel=1e-6)
    assert found.bound <= optimum * (1.0 + 1e-9)


def test_each_tool_is_taken_once_and_its_own_point_goes_to_the_poses() -> None:
    points = [(0.4, -0.3), (0.5, -0.3), (0.4, 0.3), (0.5, 0.3)]
    tools = ["drill", "mill", "mill", "drill"]
    tasks = [
        planner.Task([planner.PoseWaypoint(over_table(*point), dwell=0.5)], tool=tool)
        for point, tool in zip(points, tools, strict=True)
    ]
    found = planner.order_tasks(planner.PlanningProblem(ROBOT, ["home", "home"]), tasks, "trapezoidal", tools=TOOLS)
    changes = [(TOOLS[origin.tool].name, origin.change) for origin in found.origins if origin.tool is not None]
    assert sorted(set(changes)) == [(name, way) for name in ("drill", "mill") for way in ("put_back", "take")]
    assert len(changes) == 6  # the drill is taken at two waypoints
    own = {"drill": LONG, "mill": SHORT}
    for k, origin in enumerate(found.origins):
        position = found.plan.path.positions[k]
        if origin.task is not None:
            tool = own[tools[origin.task]]
            flange = planner.forward_kinematics(ROBOT, position)
            reached = flange.position + flange.rotation @ tool.position
            assert reached == pytest.approx([*points[origin.task], 0.1], abs=1e-5)
            assert flange.rotation == pytest.approx(DOWN, abs=1e-5)
    assert found.plan.certificate.satisfied


def test_tool_at_the_start_is_used_first_and_is_back_at_the_end() -> None:
    tasks = [
        planner.Task([planner.PoseWaypoint(over_table(0.4, y))], tool=tool)
        for y, tool in ((0.2, "mill"), (0.1, "drill"))
    ]
    there = joint_waypoint(HOME)
    first = [("drill", "put_back"), ("drill", "put_back"), ("mill", "take")]
    for ends, expected in (
        ([there], first),
        ([there, there], [*first, ("mill", "put_back"), ("drill", "take"), ("drill", "take")]),
    ):
        problem = planner.PlanningProblem(ROBOT, ends)
        found = planner.order_tasks(problem, tasks, "trapezoidal", tools=TOOLS, mounted="drill")
        changes = [(TOOLS[origin.tool].name, origin.change) for origin in found.origins if origin.tool is not None]
        assert changes == expected
        assert found.problem.robots[0].tool_in_tip.translation == pytest.approx(LONG.position)


def test_payload_and_outputs_of_a_change_are_in_the_plan() -> None:
    (taken,) = planner.Task([joint_waypoint(HOLDERS["mill"][0])]).waypoints
    put_back = replace(taken, put_down=True)
    taken = replace(taken, dwell=2.0, payload=planner.Payload(3.0))
    clamp = [planner.SetOutput(planner.AtWaypoint(0), "clamp", value) for value in (True, False)]
    mill = planner.ChangeableTool(
        "mill", SHORT, planner.Task([taken], actions=clamp[:1]), planner.Task([put_back], actions=clamp[1:])
    )
    tasks = [planner.Task([planner.PoseWaypoint(over_table(0.4, 0.2))], tool="mill")]
    found = planner.order_tasks(planner.PlanningProblem(ROBOT, ["home", "home"]), tasks, "cubic", tools=[mill])
    masses = [0.0 if payload is None else payload.mass for payload in found.problem.payloads]
    assert masses == [0.0, 3.0, 3.0, 0.0, 0.0]
    arrivals, departures = found.plan.trajectory.arrivals, found.plan.trajectory.departures
    assert departures[1] - arrivals[1] == pytest.approx(2.0)
    assert [action.at.waypoint for action in found.problem.actions] == [1, 3]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("fields", "given", "field"),
    [
        ({"tool": "saw"}, {}, ("tasks", 0, "tool")),
        ({}, {"mounted": "saw"}, ("mounted",)),
        ({}, {"tools": [TOOLS[0], TOOLS[0]]}, ("tools", 1, "name")),
        (
            {},
            {"tools": [replace(TOOLS[0], take=planner.Task([joint_waypoint(HOME)], reversible=True))]},
            ("tools", 0, "take"),
        ),
        ({}, {"tools": [replace(TOOLS[0], put_back=planner.Task([]))]}, ("tools", 0, "put_back", "waypoints")),
        (
            {"tool": "drill"},
            {"tools": [replace(TOOLS[0], take=planner.Task([planner.JointWaypoint([0.0])]))]},
            ("tools", 0, "take", "waypoints", 0, "position"),
        ),
        (
            {"waypoints": [replace(joint_waypoint(HOME), transition=planner.BlendTransition(0.01))]},
            {},
            ("tasks", 0, "waypoints", 0, "transition"),
        ),
    ],
)
def test_fault_names_its_field(fields: dict[str, Any], given: dict[str, Any], field: tuple[str | int, ...]) -> None:
    task = planner.Task(**{"waypoints": [joint_waypoint(HOME)]} | fields)
    problem = planner.PlanningProblem(ROBOT, ["home", "home"])
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.order_tasks(problem, [task], **{"tools": TOOLS} | given)
    assert field in [fault.field for fault in refused.value.faults]


def test_tool_centre_point_at_the_start_is_refused() -> None:
    start = replace(joint_waypoint(HOME), tool=LONG)
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.order_tasks(planner.PlanningProblem(ROBOT, [start]), [planner.Task([joint_waypoint(HOME)])])
    assert refused.value.faults[0].field == ("waypoints", 0, "tool")


def test_holder_out_of_reach_is_named() -> None:
    far = planner.Task([planner.PoseWaypoint(over_table(3.0, 0.0))])
    tools = [replace(TOOLS[1], take=far)]
    tasks = [planner.Task([joint_waypoint(HOME)], tool="mill")]
    with pytest.raises(planner.UnreachableWaypoint, match="waypoint 0 where tool 'mill' is taken"):
        planner.order_tasks(planner.PlanningProblem(ROBOT, ["home"]), tasks, tools=tools)
