"""Free motions that make way for the other robots of a cell, where waits alone do not keep them apart.

The robots whose motions are free are planned again, around the places where others rest at their start and end. Then
one robot can always go after the other, and the search for waits does better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.cells.movers import Mover, Rules
from planner.cells.robots import CellRobot
from planner.plans.result import Plan
from planner.problems.any_of import AnyOf, waypoints_of
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import PlanningProblem
from planner.scene import Scene, SceneObject
from planner.spatial import FloatArray, Pose


class Obstacles(NamedTuple):
    """Bodies of other robots where they rest.

    Attributes:
        objects: The bodies.
        pairs: The pairs of names that may touch.
    """

    objects: tuple[SceneObject, ...]
    pairs: tuple[tuple[str, str], ...]

    def around(self, problem: PlanningProblem) -> PlanningProblem:
        """Return a robot's problem with these obstacles."""
        scene = problem.scene or Scene()
        objects, pairs = (*scene.objects, *self.objects), (*scene.allowed_pairs, *self.pairs)
        return replace(problem, scene=replace(scene, objects=objects, allowed_pairs=pairs))


Replan = Callable[[int, Obstacles], Plan | None]
"""A function that plans a robot again, by its index, around obstacles; None: there is no plan."""


def making_way(
    robots: Sequence[CellRobot], plans: Sequence[Plan], free: Sequence[int], rules: Rules, replan: Replan
) -> list[Plan] | None:
    """Return other plans of robots, whose free motions make way for other robots; None: no motion does.

    Args:
        robots: The robots.
        plans: The plan of each without the others.
        free: Indices of the robots that are planned again.
        rules: What each pair keeps.
        replan: Plans one of them again.
    """
    movers = [Mover.of_plan(robot.name, plan) for robot, plan in zip(robots, plans, strict=True)]
    made = list(plans)
    for k in free:
        others = [mover for j, mover in enumerate(movers) if j != k]
        for starts, ends in ((True, True), (False, True), (True, False)):  # its own waypoints may be at one of them
            found = replan(k, _obstacles(robots[k], others, rules, starts, ends))
            if found is not None:
                made[k] = found
                break
    return None if all(one is other for one, other in zip(made, plans, strict=True)) else made


def has_free_motion(problem: PlanningProblem) -> bool:
    """Return whether a motion of a robot, or one of its options, is free."""
    waypoints = [
        each
        for waypoint in problem.waypoints
        for option in (waypoint.options if isinstance(waypoint, AnyOf) else (waypoint,))
        for each in waypoints_of(option)
    ]
    return any(isinstance(waypoint.motion, FreeMotion) for waypoint in waypoints)


def _obstacles(robot: CellRobot, others: Sequence[Mover], rules: Rules, starts: bool, ends: bool) -> Obstacles:
    """Return the bodies of other robots where they start or end, as obstacles of a robot."""
    objects, pairs = [], []
    links = {shape.link for shape in robot.problem.robot.collision_shapes}
    for mover in others:
        for event, is_there, time in (("start", starts, -np.inf), ("end", ends, np.inf)):
            for name, thing in _bodies(mover, time, event, rules.margin) if is_there else ():
                objects.append(thing)
                pairs += [(link, thing.id) for link in links if {name, f"{robot.name}/{link}"} in rules.allowed_pairs]
    return Obstacles(tuple(objects), tuple(pairs))


def _bodies(mover: Mover, time: float, event: str, margin: float) -> Iterator[tuple[str, SceneObject]]:
    """Yield the bodies of a mover before or after its motion, with a margin, m, each with its name `mover/body`."""
    phase = mover.phases[0 if time < 0.0 else -1]
    at = min(max(time, phase.start), phase.stop)
    position: FloatArray = phase.between(at, at).coefficients[0, :, 0]
    rotations, origins = phase.bodies.frames(position[None])
    for k, piece in enumerate(phase.bodies.pieces):
        turn, origin = rotations[0, piece.joint], origins[0, piece.joint]
        pose = Pose(origin + turn @ piece.translation, turn @ piece.rotation)
        name = f"{mover.name}/{piece.name}"
        yield name, SceneObject(f"{name} at the {event} ({k})", [piece.shape], pose, margin + phase.displacements[k])
