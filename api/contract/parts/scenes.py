"""What stands around a robot and what it carries, as requests say it; and how near the robot comes to it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag
from typing_extensions import TypeAliasType

from api.contract.parts.common import (
    Answer,
    FrameName,
    Pose,
    Schema,
    Vector3,
)

MOST_OBJECTS = 5_000
"""The most objects of a scene."""

MOST_ATTACHED = 64
"""The most attached objects of a scene."""

MOST_SPEED_ZONES = 8
"""The most speed zones of a request."""

Size = Annotated[float, Field(ge=1e-6, le=1e3)]
Margin = Annotated[float, Field(ge=0.0, le=10.0)]
Name = Annotated[str, Field(min_length=1, max_length=200)]
Coordinate = Annotated[float, Field(ge=-1e3, le=1e3)]
Point = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
SceneId = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
AllowedPairs = Annotated[list[Annotated[list[Name], Field(min_length=2, max_length=2)]], Field(max_length=10_000)]
Triangle = Annotated[list[Annotated[int, Field(ge=0, lt=600_000)]], Field(min_length=3, max_length=3)]


class Box(Schema):
    """A cuboid, centred at the origin of its frame."""

    kind: Literal["box"]
    """The kind of shape: a box."""
    size: Annotated[list[Size], Field(min_length=3, max_length=3)]
    """The lengths of the sides along x, y and z, m."""


class Sphere(Schema):
    """A ball about the origin of its frame."""

    kind: Literal["sphere"]
    """The kind of shape: a ball."""
    radius: Size
    """The radius, m."""


class Cylinder(Schema):
    """A circular cylinder with flat ends along the z axis of its frame, centred at its origin."""

    kind: Literal["cylinder"]
    """The kind of shape: a cylinder."""
    radius: Size
    """The radius, m."""
    length: Size
    """The length, m."""


class Capsule(Schema):
    """A circular cylinder along the z axis of its frame with half balls at its ends, centred at its origin."""

    kind: Literal["capsule"]
    """The kind of shape: a capsule."""
    radius: Size
    """The radius, m."""
    length: Size
    """The length between the centers of the half balls, m."""


class HalfSpace(Schema):
    """All points x with normal · x <= offset: a floor, a wall, a ceiling."""

    kind: Literal["half_space"]
    """The kind of shape: a half space."""
    normal: Vector3
    """The direction out of it, of any length but 0; three numbers without unit."""
    offset: Coordinate = 0.0
    """The distance of its plane from the origin along the normal, m."""


class Convex(Schema):
    """The smallest convex shape around points."""

    kind: Literal["convex"]
    """The kind of shape: a convex hull."""
    vertices: Annotated[list[Point], Field(min_length=4, max_length=256, fail_fast=True)]
    """The points, shape (vertices, 3), m; points in one plane get a thickness of 0.1 mm."""
    faces: Annotated[list[Triangle], Field(max_length=1024, fail_fast=True)] | None = Field(default=None, exclude=True)
    """The triangles of the surface, shape (faces, 3), as indices of vertices, without unit; not read. The geometry of a
    robot has them."""


class MeshShape(Schema):
    """A mesh of triangles, which becomes a few convex pieces that cover it."""

    kind: Literal["mesh"]
    """The kind of shape: a mesh."""
    vertices: Annotated[list[Point], Field(min_length=3, max_length=100_000, fail_fast=True)]
    """The corners, shape (vertices, 3), m."""
    triangles: Annotated[list[Triangle], Field(min_length=1, max_length=100_000, fail_fast=True)]
    """The triangles, shape (triangles, 3), as indices of vertices, counted from 0; without unit."""


class PointCloudShape(Schema):
    """Points that a sensor saw, each of which stands for a ball around it."""

    kind: Literal["point_cloud"]
    """The kind of shape: a point cloud."""
    points: Annotated[list[Point], Field(min_length=1, max_length=200_000, fail_fast=True)]
    """The points, shape (points, 3), m."""
    radius: Annotated[float, Field(ge=1e-4, le=10.0)]
    """How far around each point there may be something, m: half the spacing of the points, or more."""
    voxel: Annotated[float, Field(ge=1e-3, le=10.0)] | None = None
    """The side of the voxels in which points become one ball, m; omitted: the radius."""


SolidShape = TypeAliasType(
    "SolidShape",
    Annotated[
        Box | Sphere | Cylinder | Capsule | Convex | MeshShape,
        Field(discriminator="kind", description="A shape that has an end, in a frame of its own."),
    ],
)
SceneShape = TypeAliasType(
    "SceneShape",
    Annotated[
        Box | Sphere | Cylinder | Capsule | HalfSpace | Convex | MeshShape | PointCloudShape,
        Field(discriminator="kind", description="A shape in a frame of its own."),
    ],
)


class SceneObject(Schema):
    """A thing that stands still."""

    id: Name
    """Its name, which no other object, attached object or link has."""
    shape: SceneShape
    """What it looks like."""
    pose: Pose | None = None
    """Where it stands, in its frame (m); without an orientation its axes are those of the frame. Omitted: at the
    origin."""
    frame: FrameName = "world"
    """The frame of the pose: one of the request's `frames`, `base` or `world`."""
    margin: Margin | None = None
    """The least distance that the robot keeps from it, m; omitted: that of the scene."""


class AttachedObject(Schema):
    """A thing that moves with a link of the robot: a gripper, or what it holds."""

    id: Name
    """Its name, which no other object, attached object or link has."""
    shape: SolidShape
    """What it looks like."""
    pose: Pose | None = None
    """Where it is, in the frame of its link or of the tool (m); omitted: at the origin."""
    link: Name | None = None
    """The name of the link that it moves with; omitted: it is held at the tool."""
    touch_links: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The names of links and objects carried that it may touch, besides the link that it moves with."""
    margin: Margin | None = None
    """The least distance that it keeps from objects, m; omitted: that of the object or the scene. The larger one of
    the object's and its own counts."""


class Scene(Schema):
    """What stands around a robot, what it carries, and what may touch what."""

    objects: Annotated[list[SceneObject], Field(max_length=MOST_OBJECTS)] = Field(default_factory=list)
    """What stands still."""
    attached: Annotated[list[AttachedObject], Field(max_length=MOST_ATTACHED)] = Field(default_factory=list)
    """What moves with the robot."""
    allowed_pairs: AllowedPairs = Field(default_factory=list)
    """Pairs of names, of links, objects or attached objects, that may touch; shape (pairs, 2), without unit."""
    margin: Margin = 0.0
    """The least distance that the robot and what it carries keep from objects, m."""
    id: SceneId | None = Field(default=None, exclude=True)
    """Not read: a scene from GET /v1/scenes/{id} has it, and may be sent as it is."""
    content: Annotated[str, Field(max_length=100)] | None = Field(default=None, exclude=True)
    """Not read, likewise."""


class SpeedZone(Schema):
    """A speed that no point of the robot exceeds while it is near to objects. It is no safety function."""

    clearance: Annotated[float, Field(ge=1e-3, le=10.0)]
    """The zone: where the distance of the robot, and of what it carries, from these objects may be less than this,
    m."""
    speed: Annotated[float, Field(ge=1e-3, le=100.0)]
    """The highest speed there of any point of the robot, of what it carries, and of its tool centre point, m/s."""
    objects: Annotated[list[Name], Field(min_length=1, max_length=MOST_OBJECTS)] | None = None
    """The ids of the objects of the scene that have this zone about them; omitted: all that stand still."""


SpeedZones = Annotated[list[SpeedZone], Field(max_length=MOST_SPEED_ZONES)]


def _form(scene: Any) -> str:
    """Tell whether a scene is there itself, or its id."""
    return "id" if isinstance(scene, str) else "scene"


SceneOrId = TypeAliasType(
    "SceneOrId",
    Annotated[
        Annotated[SceneId, Tag("id")] | Annotated[Scene, Tag("scene")],
        Field(
            discriminator=Discriminator(_form),
            description="What stands around a robot and what it carries; or the id of a scene of GET /v1/scenes.",
        ),
    ],
)


class ClearanceAnswer(Answer):
    """How near two things come to each other, for certain."""

    lower: float
    """No pair is ever nearer than this, m: proved for all times, rounding included; negative by rounding alone."""
    upper: float | None
    """The least distance that was seen, m; null: it was not measured, which plans without a scene leave out."""
    time: float | None
    """When that was, s."""
    pair: Annotated[list[str], Field(min_length=2, max_length=2)] | None
    """The names of the links or objects."""
    method: Literal["certified"]
    """How it is known: the bounds hold between all samples, too."""
    shapes: Literal["model", "estimate"]
    """The source of the links' shapes: all are those of the robot's `model`, or one is an `estimate`."""
    uncertainty: float
    """By how much the machine may be nearer than its estimated shapes, m: the margin that covers it; 0: no shape is an
    estimate."""


class SpeedZoneAnswer(Answer):
    """The highest speed of the robot in one of its speed zones, for certain."""

    clearance: float
    """The zone: where the robot may be nearer than this to its objects, m."""
    objects: list[str] | None
    """The ids of these objects; null: all that stand still."""
    peak: float
    """No point of the robot is ever faster in the zone, m/s: proved for all times; 0 where it never is in it."""
    limit: float
    """The speed allowed there, m/s."""
    ratio: float
    """The share of the limit that is used, without unit."""
    satisfied: bool
    """Whether the speed allowed is kept."""
    time: float | None
    """When the robot is about that fast, s; null: it never is in the zone."""
    lower: float
    """A point of the robot is that fast at this time, m/s: the highest speed is between this and `peak`."""
    link: str | None
    """The name of the link, or of the thing carried, that this is a point of; `tool`: the tool centre point; null: the
    robot never moves in the zone."""
    intervals: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    """When the robot is in the zone, shape (intervals, 2), from and to, s; at all other times it is proved to be
    further away."""
    exceeded: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    """When a point of the robot may be faster than is allowed, shape (intervals, 2), from and to, s; at all other times
    none is. Empty: the speed allowed is kept."""
    method: Literal["certified"]
    """How it is known: the bounds hold between all samples, too."""


class ClearancesAnswer(Answer):
    """How near the robot comes to itself and to what is around it."""

    itself: ClearanceAnswer | None
    """Between parts of the arm and what it carries; null: none are held against each other."""
    scene: ClearanceAnswer | None
    """Between those and objects; null: none are. On motions on which a pair may touch, since something is taken or put
    down at their ends, that pair is left out."""
    contacts: ClearanceAnswer | None
    """Between such pairs on such motions; null: there are none."""


class CollisionAnswer(Answer):
    """A pair that is nearer than its margin, or could not be proved not to be."""

    code: Literal["start_in_collision", "collision", "clearance_unproved"]
    """What it is; `start_in_collision` of single postures, too."""
    pair: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The names of the links or objects."""
    time: float | None
    """When it is first nearer, s."""
    depth: float | None
    """How much nearer than its margin it comes, m; null: that could not be proved."""
    point: list[float] | None
    """A point of the first of the two there, x, y, z in the base frame, m; null: unknown."""
    detail: str
    """What happens, for a person."""
