"""Faults of scenes: names that are used twice, or that nothing has, and shapes without an end that would move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import InvalidProblem

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.fields import FieldPath
    from planner.robots import Robot
    from planner.scene.scene import Scene


def refuse_faults(robot: Robot, scene: Scene) -> None:
    """Refuse a scene that says nothing clear about a robot.

    Raises:
        InvalidProblem: With every fault found.
    """
    if faults := list(scene_faults(robot, scene)):
        raise InvalidProblem(faults)


def scene_faults(robot: Robot, scene: Scene) -> Iterator[tuple[FieldPath, str]]:
    """Find what is wrong with a scene around a robot."""
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
