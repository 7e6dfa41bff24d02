"""From the scenes of requests to the library's values."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from api.contract.parts import scenes
from api.work.conversion.poses import to_pose, with_axes
from planner.errors import InvalidProblem
from planner.roadmap import Roadmap
from planner.scene import AttachedObject, ConstantVelocity, PointCloud, Scene, SceneObject, TimedPoses
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, InvalidShape, Shape, Sphere
from planner.shapes.meshes import InvalidMesh, Mesh, tight_mesh_pieces
from planner.spatial import Pose
from planner.speed_zones import SpeedZone

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.contract.parts import common
    from planner import FieldPath
    from planner.scene import ObjectMotion


def to_scene(requested: scenes.Scene | str, in_world: Mapping[str, Pose], field: FieldPath = ("scene",)) -> Scene:
    """Make a scene.

    Args:
        requested: The scene of a request, as `api.work.tasks.context.in_scene` leaves it.
        in_world: The frames that its objects may name, in the world.
        field: Where the request holds it.

    Raises:
        InvalidProblem: There is no frame of a name, or no shape has such numbers.
    """
    if isinstance(requested, str):
        raise TypeError("the scene has to be in the place of its id")
    faults: list[tuple[FieldPath, str]] = []
    objects, attached = [], []
    for i, thing in enumerate(requested.objects):
        at: FieldPath = (*field, "objects", i)
        if thing.frame not in in_world:
            faults.append(((*at, "frame"), f"must be one of {', '.join(in_world)}; got {thing.frame!r}"))
            continue
        pose = _to_pose(thing.pose).from_frame(with_axes(in_world[thing.frame]))
        shapes = _shapes(thing.shape, at, faults)
        mesh = _mesh(thing.shape) if isinstance(thing.shape, scenes.MeshShape) and len(shapes) else None
        motion = None if thing.motion is None else _motion(thing, in_world[thing.frame], at, faults)
        objects.append(SceneObject(thing.id, shapes, pose, thing.margin, mesh, motion))
    for i, held in enumerate(requested.attached):
        shapes = _shapes(held.shape, (*field, "attached", i), faults)
        solid = tuple(shape for shape in shapes if isinstance(shape, Shape))
        attached.append(AttachedObject(held.id, solid, _to_pose(held.pose), held.link, held.touch_links, held.margin))
    if faults:
        raise InvalidProblem(faults)
    pairs = tuple((first, second) for first, second in requested.allowed_pairs)
    return Scene(tuple(objects), tuple(attached), pairs, requested.margin)


def _motion(
    thing: scenes.SceneObject, frame: Pose, field: FieldPath, faults: list[tuple[FieldPath, str]]
) -> ObjectMotion | None:
    """Make the motion of an object in a frame, and add its faults to the list."""
    if isinstance(thing.shape, scenes.HalfSpace | scenes.PointCloudShape):
        message = f"must be a bounded solid, since the object has a `motion`; got {thing.shape.kind!r}"
        faults.append(((*field, "shape", "kind"), message))
        return None
    axes = with_axes(frame)
    if isinstance(thing.motion, scenes.LinearObjectMotion):
        velocity = Pose(np.array(thing.motion.velocity)).from_frame(replace(axes, position=np.zeros(3))).position
        return ConstantVelocity(velocity, thing.motion.end)
    if not isinstance(thing.motion, scenes.TimedObjectMotion):
        return None
    poses = thing.motion.poses
    for k, (before, after) in enumerate(pairwise(poses), 1):
        if after.time <= before.time:
            message = f"must be after the time before, {before.time:g} s; got {after.time:g} s"
            faults.append(((*field, "motion", "poses", k, "time"), message))
            return None
    return TimedPoses([one.time for one in poses], [to_pose(one.pose).from_frame(axes) for one in poses])


def refuse_motions(scene: Scene | None) -> None:
    """Refuse moving objects in a check without a time.

    Raises:
        InvalidProblem: The scene has one.
    """
    moving = [i for i, thing in enumerate(() if scene is None else scene.objects) if thing.motion is not None]
    if moving:
        message = "must be left out: `positions` have no time. Give a trajectory, or the object without its motion."
        raise InvalidProblem([(("scene", "objects", i, "motion"), message) for i in moving])


def to_speed_zones(requested: Sequence[scenes.SpeedZone]) -> list[SpeedZone]:
    """Make speed zones."""
    return [SpeedZone(zone.clearance, zone.speed, zone.objects) for zone in requested]


def _to_pose(pose: common.Pose | None) -> Pose:
    return with_axes(Pose(np.zeros(3)) if pose is None else to_pose(pose))


def _shapes(
    requested: scenes.SceneShape | scenes.SolidShape, field: FieldPath, faults: list[tuple[FieldPath, str]]
) -> tuple[Shape | PointCloud, ...]:
    """Make the convex pieces of a shape, and add its faults to the list."""
    try:
        return _pieces(requested)
    except InvalidShape as error:
        faults.append(((*field, "shape", error.field), str(error)))
        return ()
    except InvalidMesh as error:
        faults.append(((*field, "shape", "triangles"), str(error)))
        return ()


def _pieces(requested: scenes.SceneShape | scenes.SolidShape) -> tuple[Shape | PointCloud, ...]:
    match requested:
        case scenes.Box():
            return (Box(requested.size),)
        case scenes.Sphere():
            return (Sphere(requested.radius),)
        case scenes.Cylinder():
            return (Cylinder(requested.radius, requested.length),)
        case scenes.Capsule():
            return (Capsule(requested.radius, requested.length),)
        case scenes.HalfSpace():
            return (HalfSpace(requested.normal, requested.offset),)
        case scenes.Convex():
            return (ConvexHull(requested.vertices),)
        case scenes.MeshShape():
            return tight_mesh_pieces(_mesh(requested))
        case scenes.PointCloudShape():
            return (PointCloud(requested.points, requested.radius, requested.voxel),)
        case _:
            raise TypeError(f"{requested} is no shape")


def _mesh(requested: scenes.MeshShape) -> Mesh:
    corners, triangles = np.array(requested.vertices), np.array(requested.triangles)
    if triangles.max() >= len(corners):
        raise InvalidShape("triangles", f"must name vertices below {len(corners)}, their number; got {triangles.max()}")
    return Mesh.checked(corners[triangles])


def kept_roadmap(content: bytes | None) -> Roadmap | None:
    """Read the bytes of a kept roadmap; None: there are none, or another version wrote them."""
    try:
        return None if content is None else Roadmap.from_bytes(content)
    except InvalidProblem:
        return None
