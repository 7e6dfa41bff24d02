"""The scene: objects and attached objects, as immutable values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.robots import Robot
from planner.scene.motions import ObjectMotion
from planner.scene.point_cloud import PointCloud
from planner.shapes import Shape
from planner.shapes.meshes.mesh import Mesh
from planner.spatial import Pose, convert_poses, is_rotation, rotations_from_vectors

HERE = Pose(np.zeros(3), np.eye(3))
"""The identity pose."""


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object that stands still, or moves on a known trajectory.

    Attributes:
        id: Name of the object, which no other object, attached object or link has.
        shapes: The shapes that it is made of, in its own frame.
        pose: Pose of the object in the world, at time 0 if it moves; without a rotation, it has the axes of the world.
        margin: Least distance that the robot keeps from it, m; None: that of the scene.
        mesh: The mesh in its frame, of which `shapes` are convex pieces. A refusal tells where the pieces are coarser.
            None: the shapes are the object.
        motion: Its motion, on the clock of the robot's trajectory; None: it stands still.

    Examples:
        >>> import planner
        >>> floor = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0])], margin=0.02)
        >>> floor.margin
        0.02
    """

    id: str
    shapes: Sequence[Shape | PointCloud]
    pose: Pose = HERE
    margin: float | None = None
    mesh: Mesh | None = None
    motion: ObjectMotion | None = None

    def __post_init__(self) -> None:
        """Convert other types of poses; keep the shapes in a tuple, which cannot change."""
        convert_poses(self, "pose")
        object.__setattr__(self, "shapes", tuple(self.shapes))

    def pose_at(self, time: float) -> Pose:
        """Return its pose in the world at a time from 0 on, s."""
        if self.motion is None:
            return self.pose
        leg = next(leg for leg in self.motion.legs(self.pose) if time < leg.end)
        (turn,) = rotations_from_vectors((time - leg.begin) * leg.spin[None])
        return Pose(leg.position + (time - leg.begin) * leg.velocity, turn @ leg.rotation)

    @property
    def stopped(self) -> SceneObject:
        """The static object where it stops; the same object if it has no motion, or one without end."""
        if self.motion is None or self.motion.stop is None:
            return self
        *_, last = self.motion.legs(self.pose)
        return replace(self, pose=Pose(last.position, last.rotation), motion=None)

    @property
    def moves(self) -> bool:
        """Whether it moves: an object whose motion leads nowhere stands still."""
        return self.motion is not None and any(
            leg.velocity.any() or leg.spin.any() for leg in self.motion.legs(self.pose)
        )


@dataclass(frozen=True, eq=False)
class AttachedObject:
    """An object that moves with a link of the robot: a gripper, or a workpiece that it holds.

    Attributes:
        id: Name of the object, which no other object, attached object or link has.
        shapes: The shapes that it is made of, in its own frame.
        pose: Pose of the object in the frame of its link, or in that of the tool.
        link: Name of the link that it moves with; None: it is attached to the tool.
        touch_links: Names of links that it may touch, besides the link that it moves with.
        margin: Least distance that it keeps from objects, m; None: that of the object or the scene.

    Examples:
        >>> import planner
        >>> part = planner.AttachedObject("part", [planner.Box([0.1, 0.1, 0.2])], planner.Pose([0.0, 0.0, 0.1]))
        >>> part.link is None
        True
    """

    id: str
    shapes: Sequence[Shape]
    pose: Pose = HERE
    link: str | None = None
    touch_links: Sequence[str] = ()
    margin: float | None = None

    def __post_init__(self) -> None:
        """Convert other types of poses; keep lists in tuples, which cannot change."""
        convert_poses(self, "pose")
        object.__setattr__(self, "shapes", tuple(self.shapes))
        object.__setattr__(self, "touch_links", tuple(self.touch_links))


@dataclass(frozen=True)
class Attach:
    """The taking of an object at a waypoint: afterwards it moves with a link of the robot.

    Attributes:
        id: Name of the object of the scene.
        link: Name of the link that it moves with; None: it is attached to the tool.
        touch_links: Names of links and attached objects that may touch it, besides everything that moves with the same
            joint as that link.

    Examples:
        >>> import planner
        >>> planner.Attach("date").link is None
        True
    """

    id: str
    link: str | None = None
    touch_links: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Keep the names in a tuple, which cannot change."""
        object.__setattr__(self, "touch_links", tuple(self.touch_links))


class Carrier(NamedTuple):
    """An object at constant velocity with which the robot moves along where it puts down others.

    Attributes:
        thing: The object.
        time: When the robot puts them down, s.
    """

    thing: SceneObject
    time: float

    @property
    def standing(self) -> SceneObject:
        """The object as if it stood still where it is at that time."""
        return replace(self.thing, pose=self.thing.pose_at(self.time), motion=None)

    def moving_along(self, other: SceneObject) -> SceneObject:
        """Return an object that stands still as it moves along from that time on; before it, the motion is none."""
        gone = self.thing.pose_at(self.time).position - self.thing.pose.position
        return replace(other, pose=replace(other.pose, position=other.pose.position - gone), motion=self.thing.motion)


@dataclass(frozen=True)
class Handling:
    """The objects of a scene that a robot takes and puts down at a waypoint.

    Attributes:
        taken: The objects taken.
        put_down: Names of the objects put down.
        carrier: The object with which those put down move along; None: they stay where they are.
    """

    taken: Sequence[Attach] = ()
    put_down: Sequence[str] = ()
    carrier: Carrier | None = None

    def __post_init__(self) -> None:
        """Keep lists in tuples, which cannot change."""
        object.__setattr__(self, "taken", tuple(self.taken))
        object.__setattr__(self, "put_down", tuple(self.put_down))

    @property
    def is_none(self) -> bool:
        """Whether it does nothing."""
        return not self.taken and not self.put_down


@dataclass(frozen=True, eq=False)
class Scene:
    """The surroundings of a robot.

    Attributes:
        objects: The objects, which stand still or move on known trajectories.
        attached: The objects that move with the robot.
        allowed_pairs: Pairs of names, of links, objects or attached objects, that may touch.
        margin: Least distance of the robot and its carried objects from objects, m.
        pair_margins: Least distances of single pairs instead, m: name of the link or carried object, name of the
            object.

    Examples:
        >>> import planner
        >>> table = planner.SceneObject("table", [planner.Box([1.2, 0.8, 0.05])], planner.Pose([0.9, 0.0, 0.4]))
        >>> scene = planner.Scene([table], margin=0.01)
        >>> scene.objects[0].id
        'table'
    """

    objects: Sequence[SceneObject] = ()
    attached: Sequence[AttachedObject] = ()
    allowed_pairs: Sequence[tuple[str, str]] = field(default_factory=tuple)
    margin: float = 0.0
    pair_margins: Sequence[tuple[str, str, float]] = ()

    @property
    def moving(self) -> tuple[SceneObject, ...]:
        """The objects that move on trajectories of their own."""
        return tuple(thing for thing in self.objects if thing.moves)

    def __post_init__(self) -> None:
        """Keep lists in tuples, which cannot change."""
        for name in ("objects", "attached"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "allowed_pairs", tuple((first, second) for first, second in self.allowed_pairs))
        object.__setattr__(self, "pair_margins", tuple((moving, other, m) for moving, other, m in self.pair_margins))


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
        if held.link is None and robot.holds_workpiece:
            yield ("scene", "attached", i, "link"), _no_link(robot, held.id)
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
    for i, thing in enumerate(scene.objects):
        yield from ((("scene", "objects", i, *field), message) for field, message in _motion_faults(thing))
    yield from _thing_faults(scene.objects, "objects")
    yield from _thing_faults(scene.attached, "attached")


def _no_link(robot: Robot, name: str) -> str:
    """Return the fault of an object without a link, which would be carried by a fixed tool."""
    return f"must name the link that carries {name!r}, such as 'workpiece': the tool of {robot.id} stands in the cell"


def _motion_faults(thing: SceneObject) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of the motion of an object, and shapes that cannot move."""
    if thing.motion is None:
        return
    yield from ((("motion", *field), message) for field, message in thing.motion.faults())
    for k, shape in enumerate(thing.shapes):
        if not _has_end(shape):
            yield ("shapes", k), "must be a bounded solid: a half space or a point cloud cannot have a `motion`"


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


def handling_faults(
    robot: Robot, scene: Scene, handling: Sequence[Handling], riding: Sequence[str | None] = ()
) -> Iterator[tuple[FieldPath, str]]:
    """Find what cannot be taken or put down at the waypoints of a robot, in their order.

    Args:
        robot: The arm.
        scene: The objects.
        handling: The objects that the robot takes and puts down at each waypoint.
        riding: Name of the object that the robot moves along with at each waypoint; None: none. It may take that object
            there.
    """
    shapes = {thing.id: thing.shapes for thing in scene.objects} | {held.id: held.shapes for held in scene.attached}
    endless = {thing.id for thing in scene.objects if thing.motion is not None and thing.motion.stop is None}
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
            elif take.id in endless and (i >= len(riding) or take.id != riding[i]):
                text = f"must be an object that stops: {take.id!r} has a `motion` without end"
                yield (*field, "id"), f"{text}. Take it at a waypoint `on` it"
            if take.link is None and robot.holds_workpiece:
                yield (*field, "link"), _no_link(robot, take.id)
            if take.link is not None and take.link not in links:
                yield (*field, "link"), f"{robot.id} has no link called {take.link!r}"
            for j, name in enumerate(take.touch_links):
                if name not in links | shapes.keys():
                    yield (*field, "touch_links", j), f"nothing is called {name!r}"
            carried.add(take.id)


def _has_end(shape: Shape | PointCloud) -> bool:
    return not isinstance(shape, PointCloud) and shape.bounding_capsule is not None
