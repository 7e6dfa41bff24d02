"""Scenes: the tasks of workers about scenes that the server keeps (`api/store/`)."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, TypeVar

import planner
from api.base.errors import invalid, invalid_at
from api.contract import stored_scenes as schemas
from api.contract.parts.scenes import MOST_ATTACHED, MOST_OBJECTS, AttachedObject, Scene, SceneObject
from api.pool.messages import Reply
from api.store.contents.digests import canonical, sha256
from api.store.contents.roadmaps import RoadmapContent
from api.store.contents.scenes import SceneContent
from api.work.conversion.problems import frames_in_world, mounted, to_vector, with_tool
from api.work.conversion.scenes import kept_roadmap, to_scene
from api.work.tasks.context import JSON, scene_of, task, to_json
from planner.errors import InvalidProblem
from planner.scene import HERE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.work.tasks.context import TaskContext
    from planner import FieldPath, Pose

T = TypeVar("T", SceneObject, AttachedObject)

KINDS = ("objects", "attached")
"""The fields of a scene with its objects and attached objects."""

EMPTY = b"{}"
"""The definition of a scene in which nothing stands."""


@task("add_scene")
def add_scene(context: TaskContext) -> Reply:
    """Answer POST /v1/scenes. The server keeps the content that comes back in `result`."""
    with context.stage("validate"):
        named: schemas.SceneToKeep = context.request(schemas.SceneToKeep)
        content = _content(named, named)
    scene_id = named.id or "scene_" + content.digest.removeprefix("sha256:")[:16]
    headers = {"Location": f"/v1/scenes/{scene_id}"}
    result = scene_id, named.visibility, content
    return Reply(201, JSON, content.described_as(scene_id), context.timings, headers, result)


@task("change_scene")
def change_scene(context: TaskContext) -> Reply:
    """Answer PATCH /v1/scenes/{id}; the argument `kept` is the definition of the scene as it is.

    The server keeps the content that comes back in `result`.
    """
    with context.stage("validate"):
        change: schemas.SceneChange = context.request(schemas.SceneChange)
        content = _content(_changed(scene_of(context.arguments.get("kept", EMPTY)), change), change)
    body = content.described_as(context.arguments.get("id", ""))
    return Reply(200, JSON, body, context.timings, result=content)


@task("build_roadmap")
def build_roadmap(context: TaskContext) -> Reply:
    """Answer POST /v1/scenes/{id}/roadmap; the argument `kept` is the definition of the scene.

    The argument `earlier` has the bytes of an earlier roadmap, whose motions are proved again only against changed
    objects. The server keeps the content that comes back in `result`.
    """
    with context.stage("validate"):
        request: schemas.RoadmapRequest = context.request(schemas.RoadmapRequest)
        robot = mounted(with_tool(context.robot(request), request.tool), request.mounting)
        scene = _placed(scene_of(context.arguments.get("kept", EMPTY)), frames_in_world(robot, request.frames))
        earlier = kept_roadmap(context.arguments.get("earlier"))
    with context.stage("plan"):
        roadmap = planner.build_roadmap(
            robot,
            scene,
            samples=request.samples,
            positions=[to_vector(row, robot.dof, ("positions", i)) for i, row in enumerate(request.positions)],
            self_collision=request.self_collision,
            earlier=earlier,
        )
    definition, content = context.arguments.get("definition"), roadmap.to_bytes()
    summary = {
        "robot": request.robot,
        "created": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "digest": sha256(content),
        "number_of_nodes": len(roadmap.positions),
        "number_of_motions": len(roadmap.edges),
        "number_of_paths": len(roadmap.ways),
        "number_of_checks": roadmap.checked,
        "bytes": len(content),
    }
    of_robot = "" if definition is None else sha256(definition)
    result = RoadmapContent(request.robot, of_robot, canonical(request), content, to_json(summary))
    headers = {"Location": f"/v1/scenes/{context.arguments.get('id', '')}/roadmap"}
    return Reply(201, JSON, result.described_as(is_current=True), context.timings, headers, result)


def _placed(scene: Scene, frames: Mapping[str, Pose]) -> planner.Scene:
    """Place the objects of a stored scene in the frames of a request.

    Raises:
        InvalidRequest: An object stands in another frame.
    """
    for thing in scene.objects:
        if thing.frame not in frames:
            raise invalid_at(
                "/frames", f"must have the frame {thing.frame!r}, in which {thing.id!r} of the scene stands"
            )
    return to_scene(scene, frames, ())


def _content(scene: Scene, requested: Scene | schemas.SceneChange) -> SceneContent:
    """Make the stored content of a scene.

    Args:
        scene: The scene.
        requested: The request, for the pointers of faults.

    Raises:
        InvalidRequest: Two things have the same name.
        InvalidProblem: A shape cannot be used.
    """

    def requested_at(kind: Any, index: Any, *field: str | int) -> FieldPath:
        return kind, places.get((kind, getattr(scene, kind)[index].id), index), *field

    places = {(kind, thing.id): i for kind in KINDS for i, thing in enumerate(getattr(requested, kind))}
    names = [thing.id for kind in KINDS for thing in getattr(scene, kind)]
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        kind = next(kind for kind in reversed(KINDS) if (kind, twice) in places)
        pointer = f"/{kind}/{places[kind, twice]}/id"
        raise invalid_at(pointer, f"must be unique; the scene has another object {twice!r}")
    try:
        to_scene(scene, {thing.frame: HERE for thing in scene.objects}, ())
    except InvalidProblem as error:
        raise InvalidProblem([(requested_at(*fault.field), fault.message) for fault in error.faults]) from None
    definition = canonical(scene, exclude={"id", "visibility"})
    digest = sha256(definition)
    summary = {
        "content": digest,
        "number_of_objects": len(scene.objects),
        "number_of_attached": len(scene.attached),
        "margin": scene.margin,
    }
    return SceneContent(digest, definition, to_json(summary))


def _changed(scene: Scene, change: schemas.SceneChange) -> Scene:
    """Change a scene.

    Raises:
        InvalidRequest: An object to remove does not exist, a new one has no shape, or there are too many.
    """
    known = {thing.id for thing in scene.objects} | {held.id for held in scene.attached}
    faults = [
        {"pointer": f"/remove/{i}", "message": f"must be the id of an object of the scene; got {name!r}"}
        for i, name in enumerate(change.remove)
        if name not in known
    ]
    objects: list[SceneObject] = _merged(SceneObject, scene.objects, change, "objects", faults)
    attached: list[AttachedObject] = _merged(AttachedObject, scene.attached, change, "attached", faults)
    faults += [
        {"pointer": f"/{kind}", "message": f"must be at most {most} in the whole scene; got {count}"}
        for kind, count, most in (
            ("objects", len(objects), MOST_OBJECTS),
            ("attached", len(attached), MOST_ATTACHED),
        )
        if count > most
    ]
    if faults:
        raise invalid(faults)
    gone = set(change.remove) - {thing.id for thing in objects} - {held.id for held in attached}
    pairs = [pair for pair in scene.allowed_pairs if gone.isdisjoint(pair)]
    return Scene.model_construct(
        objects=objects,
        attached=attached,
        allowed_pairs=pairs if change.allowed_pairs is None else change.allowed_pairs,
        margin=scene.margin if change.margin is None else change.margin,
    )


def _merged(
    kind: type[T],
    before: Sequence[T],
    change: schemas.SceneChange,
    name: str,
    faults: list[dict[str, str]],
) -> list[T]:
    """Change and add objects of one kind; what lacks a shape is added to the faults."""
    things = {thing.id: thing for thing in before if thing.id not in change.remove}
    for i, changed in enumerate(getattr(change, name)):
        requested = _asked(changed)
        if changed.id in things:
            things[changed.id] = things[changed.id].model_copy(update=requested)
        elif "shape" in requested:
            things[changed.id] = kind(**requested)
        else:
            message = f"must be given for a new object; the scene has no object {changed.id!r}"
            faults.append({"pointer": f"/{name}/{i}/shape", "message": message})
    return list(things.values())


def _asked(changed: schemas.ObjectChange | schemas.AttachedChange) -> Mapping[str, Any]:
    """Return the given fields; null is a value of nullable fields, and means no touch links."""
    requested = {name: getattr(changed, name) for name in changed.model_fields_set}
    left_out = [name for name in ("shape", "frame") if requested.get(name, "") is None]
    if requested.get("touch_links", "") is None:
        requested["touch_links"] = []
    return {name: value for name, value in requested.items() if name not in left_out}
