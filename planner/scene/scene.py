"""The scene: static objects and attached objects, as immutable values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.scene.point_cloud import PointCloud
from planner.shapes import Shape
from planner.shapes.meshes.mesh import Mesh
from planner.spatial import Pose, convert_poses

HERE = Pose(np.zeros(3), np.eye(3))
"""The identity pose."""


@dataclass(frozen=True, eq=False)
class SceneObject:
    """A static object.

    Attributes:
        id: Name of the object, which no other object, attached object or link has.
        shapes: The shapes that it is made of, in its own frame.
        pose: Pose of the object in the world; without a rotation, it has the axes of the world.
        margin: Least distance that the robot keeps from it, m; None: that of the scene.
        mesh: The mesh in its frame, of which `shapes` are convex pieces. A refusal tells where the pieces are coarser.
            None: the shapes are the object.

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

    def __post_init__(self) -> None:
        """Convert other types of poses; keep the shapes in a tuple, which cannot change."""
        convert_poses(self, "pose")
        object.__setattr__(self, "shapes", tuple(self.shapes))


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


@dataclass(frozen=True)
class Handling:
    """The objects of a scene that a robot takes and puts down at a waypoint.

    Attributes:
        taken: The objects taken.
        put_down: Names of the objects put down.
    """

    taken: Sequence[Attach] = ()
    put_down: Sequence[str] = ()

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
        objects: The static objects.
        attached: The objects that move with the robot.
        allowed_pairs: Pairs of names, of links, objects or attached objects, that may touch.
        margin: Least distance of the robot and its carried objects from static objects, m.
        pair_margins: Least distances of single pairs instead, m: name of the moving link or object, name of the static
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

    def __post_init__(self) -> None:
        """Keep lists in tuples, which cannot change."""
        for name in ("objects", "attached"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "allowed_pairs", tuple((first, second) for first, second in self.allowed_pairs))
        object.__setattr__(self, "pair_margins", tuple((moving, other, m) for moving, other, m in self.pair_margins))
