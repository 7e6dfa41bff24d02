"""Cells with moving objects: every robot is clear of them at dense samples, with its waits and after its end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planner
from planner.spatial import Pose
from tests.planner.cells.arms import AWAY, MARGIN, REACH
from tests.planner.cells.brute_force import facing_capsule_arms
from tests.planner.certificate.belts import least_distance


def crate(position: Any, velocity: Any) -> planner.SceneObject:
    """Return a box that moves at constant velocity."""
    motion = planner.ConstantVelocity(velocity)
    return planner.SceneObject("crate", [planner.Box([0.1] * 3)], Pose(position), motion=motion)


def cell_with(thing: planner.SceneObject, *, skew: float = 0.0, **fields: Any) -> planner.CellPlan:
    """Plan two arms that both reach between them and back, beside an object."""
    goals = [planner.JointWaypoint(position) for position in (AWAY, REACH, AWAY)]
    goals[1] = replace(goals[1], **fields)
    robots = [
        planner.CellRobot(name, planner.PlanningProblem(robot, goals, self_collision=False))
        for name, robot in zip("ab", facing_capsule_arms(1.3), strict=True)
    ]
    return planner.plan_cell(robots, scene=planner.Scene([thing], margin=0.005), margin=MARGIN, skew=skew)


def test_robots_of_a_cell_keep_clear_of_a_passing_object_with_their_waits() -> None:
    thing = crate([0.65, -0.1, 0.4], [0.0, 1.2, 0.0])
    cell = cell_with(thing)
    assert sum(map(sum, cell.waits)) > 0.5, "one robot waits for the other"
    for own in cell.plans:
        least = least_distance(own, thing, np.linspace(0.0, own.trajectory.duration, 100))
        assert own.certificate.clearance is not None and own.certificate.clearance.scene is not None
        assert 0.005 - 2e-5 <= own.certificate.clearance.scene.lower <= least + 1e-9


def test_an_object_in_the_way_is_refused_with_the_robot() -> None:
    with pytest.raises(planner.Collision, match=r"robot 'a': .* of crate, which moves") as refusal:
        cell_with(crate([0.65, -0.8, 0.4], [0.0, 1.0, 0.0]))
    assert refusal.value.robot == 0


def test_a_robot_at_rest_at_its_end_keeps_clear_until_the_last_one_ends() -> None:
    thing = crate([1.3, -1.68, 0.4], [0.0, 0.8, 0.0])  # at the base of the second robot after its end
    with pytest.raises(planner.Collision, match=r"robot 'b' at rest at its end, until 2\.4") as refusal:
        cell_with(thing)
    assert refusal.value.robot == 1
    assert refusal.value.time is not None
    assert 1.69 < refusal.value.time < 2.42


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"skew": 0.05}, ("skew",)),
        (
            {"attach": [planner.Attach("crate")], "earliest_arrival": 9.0},
            ("robots", 0, "waypoints", 1, "attach", 0, "id"),
        ),
    ],
)
def test_cells_refuse_a_skew_and_taken_objects_that_move(more: dict[str, Any], field: tuple[Any, ...]) -> None:
    thing = crate([0.65, -3.0, 0.4], [0.0, 0.5, 0.0])
    with pytest.raises(planner.InvalidProblem) as refusal:
        cell_with(thing, **more)
    assert field in [fault.field for fault in refusal.value.faults]


def test_cells_refuse_waypoints_on_moving_objects() -> None:
    first, second = facing_capsule_arms(1.3)
    on = planner.PoseWaypoint(Pose([0.0, 0.0, 0.1], np.eye(3)), on="crate")
    robots = [
        planner.CellRobot("a", planner.PlanningProblem(first, [AWAY, on, AWAY])),
        planner.CellRobot("b", planner.PlanningProblem(second, [AWAY, REACH])),
    ]
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan_cell(robots, scene=planner.Scene([crate([0.65, -3.0, 0.4], [0.0, 0.5, 0.0])]))
    assert [fault.field for fault in refusal.value.faults] == [("robots", 0, "waypoints", 1, "on")]
