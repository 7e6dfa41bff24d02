"""Scenes: what workers do with those that the server keeps (`api/database/`)."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, TypeVar

from api.content.digests import canonical, sha256
from api.content.scenes import SceneContent
from api.errors import invalid
from api.pool.messages import Reply
from api.schemas import stored_scenes as schemas
from api.schemas.scenes import MOST_ATTACHED, MOST_OBJECTS, AttachedObject, Scene, SceneObject
from api.tasks.collisions import TABLE
from api.tasks.operation import BODY_CODES, DATABASE_CODES, Operation
from api.tasks.work import JSON, scene_of, to_json

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.tasks.work import Work
    from planner.fields import FieldPath

T = TypeVar("T", SceneObject, AttachedObject)

KINDS = ("objects", "attached")
"""The fields of a scene that have what stands in it."""

EMPTY = b"{}"
"""The definition of a scene in which nothing stands."""


def add_scene(work: Work) -> Reply:
    """Answer POST /v1/scenes. The server keeps the content that comes back in `result`."""
    with work.stage("validate"):
        named: schemas.SceneToKeep = work.request(schemas.SceneToKeep)
        content = _content(named, named)
    scene_id = named.id or "scene_" + content.digest.removeprefix("sha256:")[:16]
    headers = {"Location": f"/v1/scenes/{scene_id}"}
    result = scene_id, named.visibility, content
    return Reply(201, JSON, content.described_as(scene_id), work.timings, headers, result)


def change_scene(work: Work) -> Reply:
    """Answer PATCH /v1/scenes/{id}; the argument `kept` is the definition of the scene as it is.

    The server keeps the content that comes back in `result`.
    """
    with work.stage("validate"):
        change: schemas.SceneChange = work.request(schemas.SceneChange)
        content = _content(_changed(scene_of(work.arguments.get("kept", EMPTY)), change), change)
    body = content.described_as(work.arguments.get("id", ""))
    return Reply(200, JSON, body, work.timings, result=content)


def _content(scene: Scene, asked: Scene | schemas.SceneChange) -> SceneContent:
    """Make a scene what is kept of it.

    Args:
        scene: The scene.
        asked: The request, which says where what is wrong with an object stands.

    Raises:
        InvalidRequest: Two things have the same name.
        InvalidProblem: A shape cannot be used.
    """
    from api.conversion.scenes import to_scene
    from planner.errors import InvalidProblem
    from planner.scene.scene import HERE

    def asked_at(kind: Any, index: Any, *field: str | int) -> FieldPath:
        return kind, places.get((kind, getattr(scene, kind)[index].id), index), *field

    places = {(kind, thing.id): i for kind in KINDS for i, thing in enumerate(getattr(asked, kind))}
    names = [thing.id for kind in KINDS for thing in getattr(scene, kind)]
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        kind = next(kind for kind in reversed(KINDS) if (kind, twice) in places)
        pointer = f"/{kind}/{places[kind, twice]}/id"
        raise invalid([{"pointer": pointer, "message": f"there is an object called {twice!r} already"}])
    try:
        to_scene(scene, {thing.frame: HERE for thing in scene.objects}, ())
    except InvalidProblem as error:
        raise InvalidProblem([(asked_at(*fault.field), fault.message) for fault in error.faults]) from None
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
        InvalidRequest: What is to go is not there, what comes has no shape, or there is too much.
    """
    known = {thing.id for thing in scene.objects} | {held.id for held in scene.attached}
    faults = [
        {"pointer": f"/remove/{i}", "message": f"nothing in the scene is called {name!r}"}
        for i, name in enumerate(change.remove)
        if name not in known
    ]
    objects: list[SceneObject] = _merged(SceneObject, scene.objects, change, "objects", faults)
    attached: list[AttachedObject] = _merged(AttachedObject, scene.attached, change, "attached", faults)
    faults += [
        {"pointer": f"/{kind}", "message": f"{count} are more than the {most} that a scene may have"}
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
        asked = _asked(changed)
        if changed.id in things:
            things[changed.id] = things[changed.id].model_copy(update=asked)
        elif "shape" in asked:
            things[changed.id] = kind(**asked)
        else:
            message = f"nothing in the scene is called {changed.id!r}, and a new object needs a shape"
            faults.append({"pointer": f"/{name}/{i}/shape", "message": message})
    return list(things.values())


def _asked(changed: schemas.ObjectChange | schemas.AttachedChange) -> Mapping[str, Any]:
    """Return the fields that are given; null is a value of those that may be null, and no touch links."""
    asked = {name: getattr(changed, name) for name in changed.model_fields_set}
    left_out = [name for name in ("shape", "frame") if asked.get(name, "") is None]
    if asked.get("touch_links", "") is None:
        asked["touch_links"] = []
    return {name: value for name, value in asked.items() if name not in left_out}


CELL = {
    "id": "cell_4",
    "objects": [TABLE, {"id": "floor", "shape": {"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": -0.01}}],
    "allowed_pairs": [["table", "base_link"]],
    "margin": 0.02,
}
"""The scene of the examples."""

OPERATIONS = (
    Operation(
        id="list_scenes",
        method="GET",
        path="/v1/scenes",
        tag="scenes",
        summary="The scenes that are kept, in pages.",
        description="Summaries; `get_scene` has the objects.",
        answer=schemas.ScenesAnswer,
        codes=("invalid_request", *DATABASE_CODES),
        pages=True,
    ),
    Operation(
        id="get_scene",
        method="GET",
        path="/v1/scenes/{id}",
        tag="scenes",
        summary="One scene.",
        description="With its objects, as they were added and changed.",
        answer=schemas.StoredScene,
        shared=True,
        codes=("unknown_scene", *DATABASE_CODES),
    ),
    Operation(
        id="add_scene",
        method="POST",
        path="/v1/scenes",
        tag="scenes",
        scope="scenes:write",
        summary="Keep a scene, for requests that name it by its id.",
        description="What stands around a robot and what it carries. A request with `scene`: `cell_4` is answered as "
        "one that has all that in it, as it is then. Where keys are asked for, only who sends the same key sees the "
        "scene, or everybody with `visibility`: `public`.",
        run=add_scene,
        request=schemas.SceneToKeep,
        answer=schemas.StoredScene,
        status=201,
        leads_to=("get_scene", "change_scene", "delete_scene"),
        also={200: "The same scene was there already."},
        codes=(*BODY_CODES, "scene_exists", "too_many_scenes"),
        examples={"a_table_on_a_floor": CELL},
    ),
    Operation(
        id="change_scene",
        method="PATCH",
        path="/v1/scenes/{id}",
        tag="scenes",
        scope="scenes:write",
        summary="Move, change, add and remove single objects of a scene.",
        description="What is given of an object replaces that of the object with this id, field by field; a new id "
        "adds an object. All changes are made together, or none; where another request has changed the scene at the "
        "same time, the answer is `conflict`.",
        run=change_scene,
        request=schemas.SceneChange,
        answer=schemas.StoredScene,
        codes=(*BODY_CODES, "unknown_scene", "scene_of_another", "too_many_scenes", "conflict"),
        examples={
            "a_crate_comes": {
                "objects": [
                    {
                        "id": "crate",
                        "shape": {"kind": "box", "size": [0.4, 0.3, 0.2]},
                        "pose": {"position": [1.3, 0.2, 0.43]},
                        "margin": 0.05,
                    },
                ],
            },
            "it_goes_and_the_table_moves": {
                "remove": ["crate"],
                "objects": [{"id": "table", "pose": {"position": [1.4, 0.0, 0.3]}}],
            },
        },
    ),
    Operation(
        id="delete_scene",
        method="DELETE",
        path="/v1/scenes/{id}",
        tag="scenes",
        scope="scenes:write",
        summary="Forget a scene.",
        description="Scenes that another client added stay. Batches that name it keep what it was.",
        answer=None,
        status=204,
        codes=("unknown_scene", "scene_of_another", *DATABASE_CODES),
    ),
)
"""What there is about scenes."""
