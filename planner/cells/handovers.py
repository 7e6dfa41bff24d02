"""Objects that go from one robot of a cell to another where both meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple

from planner.cells.meetings import Meeting
from planner.cells.robots import CellRobot, index_in_plan, taken_objects
from planner.certificate.clearance import segment_checkers
from planner.fields import FieldPath
from planner.plans.result import Plan
from planner.problems.problem import AnyWaypoint, PlanningProblem
from planner.scene import Scene, SceneObject
from planner.scene.carried import put_down

BEFORE_HANDOVER = "{} before it is taken"
"""The name of an object of the scene where it stands first, for the robots that get it from others."""


class Handover(NamedTuple):
    """An object that one robot puts down and another one takes at a meeting.

    Attributes:
        id: The name of the object.
        giver: Index of the robot that puts it down.
        at: The requested waypoint of the giver.
        taker: Index of the robot that takes it.
    """

    id: str
    giver: int
    at: int
    taker: int


def handovers_of(robots: Sequence[CellRobot], meetings: Sequence[Meeting]) -> tuple[Handover, ...]:
    """Return the handovers of a cell, in the order of its meetings."""
    return tuple(
        Handover(name, giver, at, taker)
        for meeting in meetings
        for giver, at in meeting.stops.items()
        for name in robots[giver].problem.waypoints[at].detach
        for taker, there in meeting.stops.items()
        if taker != giver and name in {take.id for take in robots[taker].problem.waypoints[there].attach}
    )


def order_of_plans(count: int, handovers: Sequence[Handover]) -> tuple[int, ...] | None:
    """Return an order in which givers of objects come before their takers; None: there is none."""
    sorter = TopologicalSorter({k: sorted({h.giver for h in handovers if h.taker == k}) for k in range(count)})
    try:
        return tuple(sorter.static_order())
    except CycleError:
        return None


def faults_of_handovers(robots: Sequence[CellRobot], meetings: Sequence[Meeting]) -> Iterator[tuple[FieldPath, str]]:
    """Find objects that two robots take without a handover, and handovers that contradict themselves."""
    handovers = handovers_of(robots, meetings)
    given = {(handover.id, handover.taker) for handover in handovers}
    takers: dict[str, str] = {}
    for k, robot in enumerate(robots):
        taken = [pair for i, waypoint in enumerate(robot.problem.waypoints) for pair in taken_objects(waypoint, i)]
        for field, name in taken:
            if (name, k) not in given and name in takers:
                other = f"robot {takers[name]!r} takes {name!r}, too"
                message = f"must be an object that no other robot takes, or puts down where both meet; {other}"
                yield ("robots", k, *field), message
        takers |= {name: robot.name for _, name in taken if name not in takers and (name, k) not in given}
    for i, handover in enumerate(handovers):
        yield from _faults_of(handover, robots, meetings)
        for earlier in handovers[:i]:
            if earlier[:3] == handover[:3]:
                both = f"robots {robots[earlier.taker].name!r} and {robots[handover.taker].name!r}"
                yield ("meetings",), f"must have one robot that takes {handover.id!r}; {both} do so where they meet"
    if order_of_plans(len(robots), handovers) is None:
        yield ("meetings",), "objects must not go in a circle: no robot may give one to a robot from which it gets one"


def _faults_of(
    handover: Handover, robots: Sequence[CellRobot], meetings: Sequence[Meeting]
) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of one handover."""
    name, giver, taker = handover.id, handover.giver, handover.taker
    there = next(m.stops[taker] for m in meetings if m.stops.get(giver) == handover.at and taker in m.stops)
    for k, stop in ((giver, handover.at), (taker, there)):
        if stop == len(robots[k].problem.waypoints) - 1:
            yield ("robots", k, "waypoints", stop), f"must not be the last waypoint: {name!r} changes hands here"
    own = robots[taker].problem.scene or Scene()
    for i, held in enumerate(own.attached):
        if held.id == name:
            yield ("robots", taker, "scene", "attached", i, "id"), f"must differ from {name!r}, which the robot gets"
    for i, waypoint in enumerate(robots[giver].problem.waypoints):
        if (i > handover.at and _handles(waypoint, name)) or (i < handover.at and name in waypoint.detach):
            message = f"must not handle {name!r}, which the robot gives away at waypoint {handover.at}"
            yield ("robots", giver, "waypoints", i), message
    for i, waypoint in enumerate(robots[taker].problem.waypoints[:there]):
        if _handles(waypoint, name):
            yield (
                ("robots", taker, "waypoints", i),
                f"must not handle {name!r}, which the robot gets at waypoint {there}",
            )


def _handles(waypoint: AnyWaypoint, name: str) -> bool:
    return name in waypoint.detach or any(taken == name for _, taken in taken_objects(waypoint, 0))


def in_scene(problem: PlanningProblem, scene: Scene | None, arrived: Sequence[SceneObject]) -> PlanningProblem:
    """Return a robot's problem with the objects around all robots, and the larger margin.

    Args:
        problem: The problem.
        scene: The objects around all robots; None: there are none.
        arrived: The objects that the robot gets from others, where they are put down.
    """
    if scene is None and not arrived:
        return problem
    own, common = problem.scene or Scene(), scene or Scene()
    names = {thing.id for thing in arrived}
    objects = [
        replace(thing, id=BEFORE_HANDOVER.format(thing.id)) if thing.id in names else thing for thing in common.objects
    ]
    return replace(problem, scene=replace(own, objects=(*objects, *arrived), margin=max(own.margin, common.margin)))


def handed_over(handover: Handover, plan: Plan) -> SceneObject:
    """Return the object of a handover where the plan of its giver puts it down."""
    waypoint = index_in_plan(plan, handover.at)
    checkers = segment_checkers(plan.problem, plan.path.positions)
    scene = checkers[waypoint - 1].scene if waypoint else plan.problem.scene or Scene()
    held = next(thing for thing in scene.attached if thing.id == handover.id)
    return put_down(plan.problem.robot, held, plan.path.positions[waypoint])
