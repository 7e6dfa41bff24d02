"""The scene on each segment, with objects that the robot takes and puts down."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner.robots import Robot
from planner.robots.derived.standing import placement_in_world
from planner.scene.checker import CollisionChecker, checker_of
from planner.scene.point_cloud import PointCloud
from planner.scene.scene import HERE, AttachedObject, Handling, Scene, SceneObject
from planner.spatial import FloatArray, Pose

DEEPEST_SUPPORT = 1e-3
"""Depth, m, of the allowed overlap of an object with its support where the robot takes it or puts it down.

It is the measuring accuracy of cells; a deeper overlap is a collision.
"""

ROOM_ON_THE_WAY = 1e-4
"""Distance, m, by which what touches where an object is taken or put down may come nearer on the way there or from
there: lines of the tool are kept as well as that."""

MOST_LISTS_KEPT = 2
"""Number of lists of waypoints whose checkers for all segments a process keeps.

The planner times, slows and certifies the motions of one list after the other, several times.
"""

MOST_SCENES_KEPT = 4
"""Number of scenes without handled objects that a process keeps."""


def segment_scenes(
    robot: Robot, scene: Scene, handling: Sequence[Handling], positions: FloatArray
) -> tuple[Scene, ...]:
    """Return the scene of each segment, the same object where nothing changes.

    An object moves with the robot from the waypoint where it is taken to the waypoint where it is put down. On the
    segments to and from such a waypoint, the gripper may be as close to the object as at the waypoint. The object may
    also be as close to its support as there. Everything else keeps its margin.

    Args:
        robot: The arm, with its tool and mounting.
        scene: The obstacles at the start.
        handling: The objects that it takes and puts down at each waypoint.
        positions: (waypoints, joints), where it does that, rad or m.
    """
    if all(done.is_none for done in handling):
        return (scene,) * max(1, len(handling) - 1)
    scenes = []
    for k in range(max(1, len(handling) - 1)):
        before = scene
        if not handling[k].is_none:
            scene = _changed(robot, scene, handling[k], positions[k])
        near = list(_near_after(robot, before, scene, handling[k], positions[k]))
        if k + 1 < len(handling):
            near += _near_before(robot, scene, handling[k + 1], positions[k + 1])
        scenes.append(replace(scene, pair_margins=(*scene.pair_margins, *near)) if near else scene)
    return tuple(scenes)


def checkers_of_segments(
    robot: Robot, scene: Scene, self_collision: bool | None, handling: Sequence[Handling], positions: FloatArray
) -> tuple[CollisionChecker, ...]:
    """Return the checker of each segment, the same object where nothing changes, from a cache.

    Args:
        robot: The arm, with its tool and mounting.
        scene: The obstacles at the start.
        self_collision: See `CollisionChecker`.
        handling: The objects that the robot takes and puts down at each waypoint.
        positions: (waypoints, joints), where it does that, rad or m.
    """
    where = [None if done.is_none else tuple(at) for done, at in zip(handling, positions.tolist(), strict=True)]
    return _checkers_of_segments(robot, scene, self_collision, tuple(handling), tuple(where))


@lru_cache(maxsize=MOST_LISTS_KEPT)
def _checkers_of_segments(
    robot: Robot,
    scene: Scene,
    self_collision: bool | None,
    handling: tuple[Handling, ...],
    where: tuple[tuple[float, ...] | None, ...],
) -> tuple[CollisionChecker, ...]:
    """Return the checker of each segment; positions only where the robot does something."""
    positions = np.array([at or (0.0,) * robot.dof for at in where])
    scenes = segment_scenes(robot, scene, handling, positions)
    return tuple(checker_of(robot, each, self_collision) for each in scenes)


@lru_cache(maxsize=MOST_SCENES_KEPT)
def without_objects(scene: Scene, handled: frozenset[str]) -> Scene:
    """Return a scene without objects of some names, the same for equal calls."""
    attached = [
        replace(thing, touch_links=[name for name in thing.touch_links if name not in handled])
        for thing in scene.attached
        if thing.id not in handled
    ]
    return replace(
        scene,
        objects=[thing for thing in scene.objects if thing.id not in handled],
        attached=attached,
        allowed_pairs=[pair for pair in scene.allowed_pairs if not handled & set(pair)],
        pair_margins=[pair for pair in scene.pair_margins if not handled & set(pair[:2])],
    )


def checker_at_waypoints(
    robot: Robot, scene: Scene | None, self_collision: bool | None, handling: Sequence[Handling]
) -> CollisionChecker | None:
    """Return the collision checker for joint positions of waypoints; None: no scene and no self-collision check.

    The checker leaves out objects that the robot takes or puts down.

    Args:
        robot: The arm, with its tool and mounting.
        scene: The obstacles at the start; None: none.
        self_collision: See `CollisionChecker`; without a scene only `True` counts.
        handling: The objects that the robot takes and puts down at each waypoint.
    """
    if scene is None and not self_collision:
        return None
    handled = frozenset(name for done in handling for name in (*(take.id for take in done.taken), *done.put_down))
    return checker_of(
        robot, without_objects(scene, handled) if scene is not None and handled else scene, self_collision
    )


def put_down(robot: Robot, held: AttachedObject, position: FloatArray) -> SceneObject:
    """Return the object that a robot puts down at a joint position (joints,)."""
    pose = _with_axes(held.pose).from_frame(_frame(robot, held.link, position))
    return SceneObject(held.id, held.shapes, pose.from_frame(_with_axes(robot.mounting or HERE)), held.margin)


def _changed(robot: Robot, scene: Scene, done: Handling, position: FloatArray) -> Scene:
    """Return a scene in which objects have been put down, and then others taken."""
    objects, attached = list(scene.objects), list(scene.attached)
    base = robot.mounting or HERE
    for name in done.put_down:
        (held,) = (thing for thing in attached if thing.id == name)
        attached.remove(held)
        there = put_down(robot, held, position)
        objects.append(there if done.carrier is None else done.carrier.moving_along(there))
    for take in done.taken:
        (thing,) = (thing for thing in objects if thing.id == take.id)
        objects.remove(thing)
        thing = thing.stopped
        pose = _with_axes(thing.pose).to_frame(_with_axes(base)).to_frame(_frame(robot, take.link, position))
        solid = [shape for shape in thing.shapes if not isinstance(shape, PointCloud)]
        attached.append(AttachedObject(thing.id, solid, pose, take.link, take.touch_links, thing.margin))
    return replace(scene, objects=objects, attached=attached)


def _near_after(
    robot: Robot, before: Scene, scene: Scene, done: Handling, position: FloatArray
) -> Iterator[tuple[str, str, float]]:
    """Yield the allowed distances after a waypoint, of objects taken and of objects put down there."""
    taken = {take.id for take in done.taken}
    yield from _near(robot, scene, position, taken, None, DEEPEST_SUPPORT)
    for held in (held for held in before.attached if held.id in done.put_down and held.id not in taken):
        there = put_down(robot, held, position)  # it may move from here on
        scene = replace(scene, objects=[there if thing.id == held.id else thing for thing in scene.objects])
        holders = _holders(robot, scene, held.link, held.touch_links)
        yield from _near(robot, scene, position, holders, held.id, np.inf)


def _near_before(robot: Robot, scene: Scene, done: Handling, position: FloatArray) -> Iterator[tuple[str, str, float]]:
    """Yield the allowed distances before a waypoint, of objects to take and to put down there."""
    taken = {take.id for take in done.taken}
    if any(thing.id in taken for thing in scene.moving):
        scene = replace(scene, objects=[thing.stopped if thing.id in taken else thing for thing in scene.objects])
    if done.put_down and done.carrier is not None:
        under = done.carrier
        scene = replace(scene, objects=[under.standing if o.id == under.thing.id else o for o in scene.objects])
    yield from _near(robot, scene, position, set(done.put_down), None, DEEPEST_SUPPORT)
    for take in done.taken:
        holders = _holders(robot, scene, take.link, take.touch_links)
        yield from _near(robot, scene, position, holders, take.id, np.inf)


def _holders(robot: Robot, scene: Scene, link: str | None, touch_links: Sequence[str]) -> set[str]:
    """Return the names that move with a link, and all others that may touch its object."""
    joint = _parent(robot, link)
    links = {shape.link for shape in robot.collision_shapes if shape.joint == joint}
    held = {thing.id for thing in scene.attached if _parent(robot, thing.link) == joint}
    return links | held | set(touch_links)


def _near(
    robot: Robot, scene: Scene, position: FloatArray, moving: Collection[str], standing: str | None, deepest: float
) -> Iterator[tuple[str, str, float]]:
    """Yield pairs closer than their margin at a joint position, and the distance allowed instead.

    `standing` names a static object; None: all. Pairs that overlap by more than `deepest`, m, keep their margin.
    """
    if not moving:
        return
    checker = checker_of(robot, scene, False)
    placements = checker.bodies.at(position[None])
    near: dict[tuple[str, str], float] = {}
    nearer = checker.near_items(position[None], np.zeros((1, robot.dof)), checker.margins, -np.inf)
    for pair in nearer.pairs.tolist():
        names = checker.names(pair)
        if names[0] in moving and standing in (None, names[1]):
            distance = checker.separate(placements, 0, pair).distance
            if distance < checker.margins_of(np.array([pair]))[0]:
                near[names] = min(near.get(names, np.inf), distance)
    yield from ((*names, distance - ROOM_ON_THE_WAY) for names, distance in near.items() if distance >= -deepest)


def _frame(robot: Robot, link: str | None, position: FloatArray) -> Pose:
    """Return the pose of a link, or (None) of the tool, at a joint position (joints,), in the standing frame."""
    frame = robot.model.frames[_frame_id(robot, link)]
    number, placement = placement_in_world(robot, int(frame.parentJoint), frame.placement)
    rotations, origins = checker_of(robot, None, False).bodies.frames(position[None])
    joint = Pose(origins[0, number], rotations[0, number])
    return Pose(placement.translation, placement.rotation).from_frame(joint)


def _frame_id(robot: Robot, link: str | None) -> int:
    return int(robot.tool_frame_id if link is None else robot.model.getFrameId(link))


def _parent(robot: Robot, link: str | None) -> int:
    return int(robot.model.frames[_frame_id(robot, link)].parentJoint)


def _with_axes(pose: Pose) -> Pose:
    """Return a pose with a rotation; without one, it gets the axes of its frame."""
    return pose if pose.rotation is not None else replace(pose, rotation=np.eye(3))
