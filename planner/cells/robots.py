"""The robots of a cell, and what contradicts itself in a cell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.backends.base import BackEnd
from planner.backends.splines.cubic import Cubic
from planner.fields import FieldPath
from planner.plans.result import Plan
from planner.problems.any_of import AnyOf, WaypointSequence
from planner.problems.problem import AnyWaypoint, PlanningProblem
from planner.problems.rides import unplanned_faults
from planner.scene import Scene

MOST_ROBOTS = 4
"""The largest number of robots of a cell."""


@dataclass(frozen=True, eq=False)
class CellRobot:
    """A robot of a cell with its problem.

    Attributes:
        name: Its name in the cell.
        problem: Its waypoints and limits. The mounting of its robot is its base in the world. Its scene has its
            attached objects and allowed pairs, and no objects.
        backend: The back end that puts time on its path, or its kind.
    """

    name: str
    problem: PlanningProblem
    backend: BackEnd | str = Cubic()


def faults_of_robots(
    robots: Sequence[CellRobot], scene: Scene, margin: float, skew: float
) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of the robots of a cell and of their scenes."""
    if not 2 <= len(robots) <= MOST_ROBOTS:
        yield ("robots",), f"a cell must have 2 to {MOST_ROBOTS} robots; got {len(robots)}"
    for name, value in (("margin", margin), ("skew", skew)):
        if not 0.0 <= value < np.inf:
            yield (name,), f"must be finite and 0 or more; got {value:g}"
    seen: dict[str, int] = {}
    for k, robot in enumerate(robots):
        if robot.name in seen:
            yield ("robots", k, "name"), f"must differ from the name of robot {seen[robot.name]}; got {robot.name!r}"
        seen.setdefault(robot.name, k)
    for name in ("attached", "allowed_pairs", "pair_margins"):
        if getattr(scene, name):
            yield ("scene", name), "must be empty: each robot has its own"
    if scene.moving and skew > 0.0:
        yield ("skew",), "must be 0 with moving objects in the scene: they move on the clock of every robot"
    moving = {thing.id for thing in scene.moving}
    for k, robot in enumerate(robots):
        for field, text in unplanned_faults(robot.problem.waypoints):
            yield ("robots", k, *field), text
        for i, waypoint in enumerate(robot.problem.waypoints) if moving else ():
            for field, name in taken_objects(waypoint, i):
                if name in moving:
                    yield ("robots", k, *field), f"must be a static object of a cell: {name!r} has a `motion`"
    for k, robot in enumerate(robots):
        if robot.problem.scene is not None and robot.problem.scene.objects:
            yield ("robots", k, "scene", "objects"), "must be empty: the scene of the cell has the objects"


def faults_of_pairs(
    robots: Sequence[CellRobot], scene: Scene, pairs: Sequence[Sequence[str]]
) -> Iterator[tuple[FieldPath, str]]:
    """Find faults of pairs of names `robot/body` that may touch."""
    objects = {thing.id for thing in scene.objects}
    objects |= {held.id for robot in robots if robot.problem.scene for held in robot.problem.scene.attached}
    names = {
        f"{robot.name}/{body}": robot.name
        for robot in robots
        for body in {shape.link for shape in robot.problem.robot.collision_shapes} | objects
    }
    for i, pair in enumerate(pairs):
        for name in pair:
            if name not in names:
                yield ("allowed_pairs", i), f"must have names `robot/link` or `robot/object`; got {name!r}"
        if len({names[name] for name in pair if name in names}) == 1 and all(name in names for name in pair):
            yield ("allowed_pairs", i), f"must have names of two robots; got {pair[0]!r} and {pair[1]!r}"


def taken_objects(waypoint: AnyWaypoint | WaypointSequence, *steps: str | int) -> Iterator[tuple[FieldPath, str]]:
    """Yield the fields and the names of the objects that a robot takes at a waypoint, or at its options."""
    if isinstance(waypoint, AnyOf):
        for i, option in enumerate(waypoint.options):
            yield from taken_objects(option, *steps, "options", i)
    elif isinstance(waypoint, WaypointSequence):
        for i, inner in enumerate(waypoint.waypoints):
            yield from taken_objects(inner, *steps, "waypoints", i)
    else:
        yield from ((("waypoints", *steps, "attach", i, "id"), take.id) for i, take in enumerate(waypoint.attach))


def index_in_plan(plan: Plan, requested: int) -> int:
    """Return the index in a plan's problem of a requested waypoint; of a goal set, that of the goal."""
    numbers = plan.requested_indices
    return len(numbers) - 1 - numbers[::-1].index(requested)
