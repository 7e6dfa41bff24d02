"""Scenes of requests, and the clearance of the robot in answers."""

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
ObjectSpeed = Annotated[float, Field(ge=-100.0, le=100.0)]
MotionTime = Annotated[float, Field(ge=1e-3, le=1e5)]
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
    """A sphere about the origin of its frame."""

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
    """A point cloud of a sensor; each point stands for a sphere."""

    kind: Literal["point_cloud"]
    """The kind of shape: a point cloud."""
    points: Annotated[list[Point], Field(min_length=1, max_length=200_000, fail_fast=True)]
    """The points, shape (points, 3), m."""
    radius: Annotated[float, Field(ge=1e-4, le=10.0)]
    """The radius of the sphere at each point, m: half the spacing of the points, or more."""
    voxel: Annotated[float, Field(ge=1e-3, le=10.0)] | None = None
    """The size of the voxels whose points become one sphere, m; omitted: the radius."""


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


class LinearObjectMotion(Schema):
    """A motion on a straight line from time 0 on, such as that of a part on a belt."""

    kind: Literal["linear"]
    """The kind of motion: a straight line at constant velocity."""
    velocity: Annotated[list[ObjectSpeed], Field(min_length=3, max_length=3)]
    """The velocity along the axes of the object's frame, shape (3,), m/s."""
    end: MotionTime | None = None
    """The time at which the object stops, s; omitted: it moves on without end."""


class TimedPose(Schema):
    """A pose of an object at a time."""

    time: MotionTime
    """The time from the start of the trajectory, s."""
    pose: Pose
    """The pose in the frame of the object (m); without an orientation, it keeps the one before."""


class TimedObjectMotion(Schema):
    """A motion through poses at given times, such as that of a door. After the last pose the object rests."""

    kind: Literal["timed_poses"]
    """The kind of motion: from pose to pose, with constant velocities between two of them."""
    poses: Annotated[list[TimedPose], Field(min_length=1, max_length=1000)]
    """The poses after the start, with strictly ascending times. The object turns by the shortest rotations."""


ObjectMotion = TypeAliasType(
    "ObjectMotion",
    Annotated[
        LinearObjectMotion | TimedObjectMotion,
        Field(discriminator="kind", description="The motion of an object, from its pose at time 0 on."),
    ],
)


class SceneObject(Schema):
    """A static object, or with `motion` a moving object."""

    id: Name
    """Its name, which no other object, attached object or link has."""
    shape: SceneShape
    """Its shapes."""
    pose: Pose | None = None
    """Its pose in its frame (m), of a moving object at time 0. Without an orientation it has the axes of the frame.
    Omitted: the origin."""
    frame: FrameName = "world"
    """The frame of the pose: one of the request's `frames`, `base` or `world`."""
    margin: Margin | None = None
    """The margin: the least distance of the robot from it, m; omitted: the margin of the scene."""
    motion: ObjectMotion | None = None
    """Its motion in the time of the trajectory, whose start is time 0; omitted: it is static. A moving object has a
    bounded shape. Checks without a time, such as solutions of a pose, leave it out."""


class AttachedObject(Schema):
    """An attached object that moves with a link of the robot: a gripper, or a workpiece in it."""

    id: Name
    """Its name, which no other object, attached object or link has."""
    shape: SolidShape
    """Its shapes."""
    pose: Pose | None = None
    """Its pose in the frame of its link or of the tool (m); omitted: the origin."""
    link: Name | None = None
    """The name of the link that it moves with; omitted: the tool."""
    touch_links: Annotated[list[Name], Field(max_length=64)] = Field(default_factory=list)
    """The names of links and attached objects that may touch it; its own link always may."""
    margin: Margin | None = None
    """Its margin to objects, m; omitted: the margin of the object or the scene. The larger of the object's and its own
    margin counts."""


class Scene(Schema):
    """The objects around a robot, its attached objects, and allowed contacts."""

    objects: Annotated[list[SceneObject], Field(max_length=MOST_OBJECTS)] = Field(default_factory=list)
    """The static and moving objects."""
    attached: Annotated[list[AttachedObject], Field(max_length=MOST_ATTACHED)] = Field(default_factory=list)
    """The attached objects."""
    allowed_pairs: AllowedPairs = Field(default_factory=list)
    """Pairs of links, objects or attached objects that may touch, by name; shape (pairs, 2), without unit."""
    margin: Margin = 0.0
    """The margin: the least distance of the robot and its attached objects from objects, m."""
    id: SceneId | None = Field(default=None, exclude=True)
    """Not read: a scene from GET /v1/scenes/{id} has it, and may be sent as it is."""
    content: Annotated[str, Field(max_length=100)] | None = Field(default=None, exclude=True)
    """Not read, likewise."""


class SpeedZone(Schema):
    """A speed limit for every point of the robot near objects. It is not a safety function."""

    clearance: Annotated[float, Field(ge=1e-3, le=10.0)]
    """The extent of the zone: the distance of the robot and its attached objects from the objects is below this, m."""
    speed: Annotated[float, Field(ge=1e-3, le=100.0)]
    """The speed limit of every point of the robot, its attached objects, and the tool centre point, m/s."""
    objects: Annotated[list[Name], Field(min_length=1, max_length=MOST_OBJECTS)] | None = None
    """The ids of the objects with this zone; omitted: all, if all are static."""


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
    """The proved clearance of a pair."""

    lower: float
    """The lower bound of the distance of every pair, m: proved for all times, rounding included; negative by rounding
    only."""
    upper: float | None
    """The least measured distance, m; null: not measured, as in plans without a scene."""
    time: float | None
    """The time of that distance, s."""
    pair: Annotated[list[str], Field(min_length=2, max_length=2)] | None
    """The names of the links or objects."""
    method: Literal["certified"]
    """The method: the bounds hold at all times, also between samples."""
    shapes: Literal["model", "estimate"]
    """The source of the links' shapes: all from the robot's `model`, or at least one an `estimate`."""
    uncertainty: float
    """The uncertainty of estimated shapes, m: a margin of this size covers it; 0: no shape is an estimate."""


class SpeedZoneAnswer(Answer):
    """The proved speed of the robot in a speed zone."""

    clearance: float
    """The extent of the zone: the distance from its objects, m."""
    objects: list[str] | None
    """The ids of its objects; null: all."""
    peak: float
    """The upper bound of the speed of every point of the robot in the zone, m/s, proved for all times. It is 0 if the
    robot never enters the zone."""
    limit: float
    """The speed limit, m/s."""
    ratio: float
    """The used share of the limit, without unit."""
    satisfied: bool
    """Whether the speed limit is kept."""
    time: float | None
    """The time of about that speed, s; null: it never enters the zone."""
    lower: float
    """The speed of a point of the robot at this time, m/s: the highest speed is between this and `peak`."""
    link: str | None
    """The name of the link or attached object of this point; `tool`: the tool centre point; null: the robot never
    moves in the zone."""
    intervals: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    """The times in the zone, shape (intervals, 2), from and to, s; at all other times the robot is proved to be
    outside."""
    exceeded: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    """The times of possible violations, shape (intervals, 2), from and to, s; at all other times there is none. Empty:
    the speed limit is kept."""
    method: Literal["certified"]
    """The method: the bounds hold at all times, also between samples."""


class ClearancesAnswer(Answer):
    """The clearance of the robot to itself and to the scene."""

    itself: ClearanceAnswer | None
    """Between links and attached objects; null: not checked."""
    scene: ClearanceAnswer | None
    """Between these and objects; null: not checked. A pair that may touch, because an object is picked up or put down,
    is excluded on the motions to and from that waypoint."""
    contacts: ClearanceAnswer | None
    """Between the excluded pairs on these motions; null: none."""


class CollisionAnswer(Answer):
    """A pair that violates its margin, or whose margin could not be proved."""

    code: Literal["start_in_collision", "collision", "clearance_unproved"]
    """The code; for single joint positions `start_in_collision`, too."""
    pair: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The names of the links or objects."""
    time: float | None
    """The time of the first violation, s."""
    depth: float | None
    """The violation of the margin, m; null: the margin could not be proved."""
    point: list[float] | None
    """A point of the first of the two at that time, x, y, z in the base frame, m; null: unknown."""
    detail: str
    """The description, for a person."""
