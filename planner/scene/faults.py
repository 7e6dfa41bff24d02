"""Faults of scenes: names used twice or that nothing has, margins and poses that are none, endless shapes that move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.robots import Robot
from planner.scene.point_cloud import PointCloud
from planner.scene.scene import AttachedObject, Handling, Scene, SceneObject
from planner.shapes import Shape
from planner.spatial import is_rotation

NO_MARGIN = "a margin is 0 or more, and has an end"
"""The message of a fault where a margin is none."""


def refuse_faults(robot: Robot, scene: Scene) -> None:
    """Refuse a scene that says nothing clear about a robot.

    Raises:
        InvalidProblem: With every fault found.
    """
    if faults := list(scene_faults(robot, scene)):
        raise InvalidProblem(faults)


def scene_faults(robot: Robot, scene: Scene) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of a scene around a robot."""
    links = {frame.name for frame in robot.model.frames} | {shape.link for shape in robot.collision_shapes}
    seen = set(links)
    names = [("objects", i, thing.id) for i, thing in enumerate(scene.objects)]
    names += [("attached", i, held.id) for i, held in enumerate(scene.attached)]
    for kind, i, name in names:
        if name in seen:
            yield ("scene", kind, i, "id"), f"there is a link or an object called {name!r} already"
        seen.add(name)
    for i, held in enumerate(scene.attached):
        for k, shape in enumerate(held.shapes):
            if shape.bounding_capsule is None:
                yield ("scene", "attached", i, "shapes", k), "what moves with a robot has an end"
        if held.link is not None and not robot.model.existFrame(held.link):
            yield ("scene", "attached", i, "link"), f"{robot.id} has no link called {held.link!r}"
        for k, name in enumerate(held.touch_links):
            if name not in seen:
                yield ("scene", "attached", i, "touch_links", k), f"nothing is called {name!r}"
    for i, pair in enumerate(scene.allowed_pairs):
        for name in pair:
            if name not in seen:
                yield ("scene", "allowed_pairs", i), f"nothing is called {name!r}"
    if not 0.0 <= scene.margin < np.inf:
        yield ("scene", "margin"), NO_MARGIN
    for i, (_, _, least) in enumerate(scene.pair_margins):
        if not np.isfinite(least):
            yield ("scene", "pair_margins", i), "the least distance of a pair is a number"
    yield from _thing_faults(scene.objects, "objects")
    yield from _thing_faults(scene.attached, "attached")


def _thing_faults(things: Sequence[SceneObject | AttachedObject], kind: str) -> Iterator[tuple[FieldPath, str]]:
    """Find margins and poses that are none."""
    for i, thing in enumerate(things):
        if thing.margin is not None and not 0.0 <= thing.margin < np.inf:
            yield ("scene", kind, i, "margin"), NO_MARGIN
    positions = np.array([thing.pose.position for thing in things]).reshape(-1, 3)
    upright = np.eye(3)
    rotations = [upright if thing.pose.rotation is None else thing.pose.rotation for thing in things]
    is_pose = np.isfinite(positions).all(axis=1) & is_rotation(np.array(rotations).reshape(-1, 3, 3))
    for i in np.flatnonzero(~is_pose).tolist():
        yield ("scene", kind, i, "pose"), "a pose is made of numbers and a rotation"


def handling_faults(robot: Robot, scene: Scene, handling: Sequence[Handling]) -> Iterator[tuple[FieldPath, str]]:
    """Find what cannot be taken or put down at the waypoints of a robot, in their order."""
    shapes = {thing.id: thing.shapes for thing in scene.objects} | {held.id: held.shapes for held in scene.attached}
    links = {frame.name for frame in robot.model.frames}
    carried = {held.id for held in scene.attached}
    for i, done in enumerate(handling):
        for k, name in enumerate(done.put_down):
            if name not in carried:
                yield ("waypoints", i, "detach", k), f"the robot does not carry {name!r} here"
            carried.discard(name)
        for k, take in enumerate(done.taken):
            field = ("waypoints", i, "attach", k)
            if take.id not in shapes:
                yield (*field, "id"), f"nothing in the scene is called {take.id!r}"
            elif take.id in carried:
                yield (*field, "id"), f"the robot carries {take.id!r} already"
            elif not all(map(_has_end, shapes[take.id])):
                yield (*field, "id"), f"{take.id!r} cannot be carried: it is no solid with an end"
            if take.link is not None and take.link not in links:
                yield (*field, "link"), f"{robot.id} has no link called {take.link!r}"
            for j, name in enumerate(take.touch_links):
                if name not in links | shapes.keys():
                    yield (*field, "touch_links", j), f"nothing is called {name!r}"
            carried.add(take.id)


def _has_end(shape: Shape | PointCloud) -> bool:
    return not isinstance(shape, PointCloud) and shape.bounding_capsule is not None
