"""Scenes are kept in the database; workers check each before."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING, Annotated

import orjson
import structlog
from fastapi import Query, Request, Response

from api.base.errors import (
    Conflict,
    PayloadTooLarge,
    SceneExists,
    SceneOfAnother,
    ServiceError,
    TooManyRoadmaps,
    TooManyScenes,
    UnknownRoadmap,
    UnknownScene,
)
from api.base.pages import DEFAULT_ENTRIES, first_page
from api.contract import stored_scenes as schemas
from api.http.access.access import audit
from api.http.cost_keys import by_roadmap
from api.http.dependencies import Body, Cursor, Limit, SceneBody, SceneId, body_of, client, needs, service_of
from api.http.described import BODY_CODES, DATABASE_CODES, NOT_MODIFIED, returns, takes
from api.http.replies import get_reply, is_known, not_modified, respond
from api.http.router import Router
from api.http.transport.answer import Answer
from api.pool.messages import Reply
from api.store import roadmaps
from api.store.named_contents import FOR_ALL, SCENES, Bounds

if TYPE_CHECKING:
    from api.base.settings import Settings
    from api.store.contents.scenes import SceneContent


log = structlog.get_logger()

router = Router(tags=["scenes"])


@router.get(
    "/v1/scenes",
    summary="List the stored scenes, in pages.",
    description="The list has summaries; `get_scene` has the objects.",
    dependencies=[needs("plan")],
    responses=returns(schemas.ScenesAnswer, codes=("invalid_request", *DATABASE_CODES)),
)
async def list_scenes(request: Request, limit: Limit = DEFAULT_ENTRIES, cursor: Cursor = None) -> Response:
    """Answer GET /v1/scenes: a page."""
    found = await service_of(request).database.read(SCENES.behind, client(request).namespace, cursor or "", limit + 1)
    page, has_more = first_page(found, limit)
    answer = {
        "scenes": [orjson.Fragment(summary) for _, summary in page],
        "next_cursor": page[-1][0] if has_more else None,
    }
    return Answer([orjson.dumps(answer)], HTTPStatus.OK, "application/json", {})


@router.get(
    "/v1/scenes/{id}",
    summary="Get a scene.",
    description="The answer has its objects, as they were added and changed.",
    dependencies=[needs("plan")],
    responses=returns(schemas.StoredScene, codes=("unknown_scene", *DATABASE_CODES), shared=True) | NOT_MODIFIED,
)
async def get_scene(request: Request, scene_id: SceneId) -> Response:
    """Answer GET /v1/scenes/{id}."""
    content = await _found(request, scene_id)
    tag = service_of(request).answers.tag("get_scene", b"", {"id": scene_id, "content": content.digest})
    if is_known(request, tag):
        return respond(not_modified(tag))
    return Answer([content.described_as(scene_id)], HTTPStatus.OK, "application/json", {"ETag": tag})


@router.post(
    "/v1/scenes",
    summary="Store a scene for requests that name it by its id.",
    description="The scene has objects and attached objects. A request with `scene`: `cell_4` is planned in the "
    "current state of that scene. Where the service requires keys, only the same key sees the scene, "
    "or everybody with `visibility`: `public`.",
    status_code=201,
    responses=returns(
        schemas.StoredScene,
        codes=(*BODY_CODES, "scene_exists", "too_many_scenes"),
        status=201,
        also={200: "The same scene was there already."},
        leads_to=("get_scene", "change_scene", "delete_scene"),
    ),
    openapi_extra=takes(schemas.SceneToKeep),
)
async def add_scene(request: Request, body: SceneBody) -> Response:
    """Answer POST /v1/scenes. The same scene again is answered with 200, not 201."""
    reply = await get_reply(request, "add_scene", body)
    if reply.result is None:
        return respond(reply)
    scene_id, visibility, content = reply.result
    service, sender = service_of(request), client(request)
    namespace = FOR_ALL if visibility == "public" else sender.namespace
    match await service.database.write(
        SCENES.add, namespace, scene_id, content, sender.name, _bounds(service.settings)
    ):
        case "added":
            audit(request, "scene_added", scene_id)
        case "exists":
            raise SceneExists(
                f"Another scene has the id {scene_id}. Change or delete that scene, or choose another id."
            )
        case "same":
            reply = replace(reply, status=HTTPStatus.OK)
        case lacking:
            raise _no_room(lacking)
    return respond(reply)


@router.patch(
    "/v1/scenes/{id}",
    summary="Move, change, add and remove single objects of a scene.",
    description="The given fields replace those of the object with this id; a new id adds an object. All changes "
    "are made together, or none. If another request changes the scene at the same time, the answer "
    "is `conflict`. Roadmaps of the scene are proved again against the changed objects.",
    responses=returns(
        schemas.StoredScene, codes=(*BODY_CODES, "unknown_scene", "scene_of_another", "too_many_scenes", "conflict")
    ),
    openapi_extra=takes(schemas.SceneChange),
)
async def change_scene(request: Request, scene_id: SceneId, body: SceneBody) -> Response:
    """Answer PATCH /v1/scenes/{id}."""
    before = await _found(request, scene_id)
    reply = await get_reply(request, "change_scene", body, kept=before.definition, id=scene_id)
    if reply.result is None:
        return respond(reply)
    service, sender, content = service_of(request), client(request), reply.result
    if content.size > service.settings.max_body_bytes:
        raise PayloadTooLarge(f"The changed scene must have at most {service.settings.max_body_bytes} bytes.")
    match await service.database.write(
        SCENES.replace,
        sender.namespace,
        scene_id,
        before.digest,
        content,
        sender.changes_of,
        _bounds(service.settings),
    ):
        case "replaced":
            audit(request, "scene_changed", scene_id)
            await _prove_again(request, scene_id)
        case "changed":
            raise _changed_meanwhile()
        case "unknown":
            raise _unknown()
        case "of_another":
            raise _of_another()
        case lacking:
            raise _no_room(lacking)
    return respond(reply)


@router.delete(
    "/v1/scenes/{id}",
    summary="Delete a scene.",
    description="Scenes of other clients cannot be deleted. Batches that name the scene keep the state that they "
    "started with.",
    status_code=204,
    dependencies=[needs("scenes:write")],
    responses=returns(None, codes=("unknown_scene", "scene_of_another", *DATABASE_CODES), status=204),
)
async def delete_scene(request: Request, scene_id: SceneId) -> Response:
    """Answer DELETE /v1/scenes/{id}."""
    sender = client(request)
    match await service_of(request).database.write(SCENES.delete, sender.namespace, scene_id, sender.changes_of):
        case "deleted":
            audit(request, "scene_deleted", scene_id)
            return Response(status_code=HTTPStatus.NO_CONTENT)
        case "of_another":
            raise _of_another()
        case _:
            raise _unknown()


@router.post(
    "/v1/scenes/{id}/roadmap",
    summary="Build a roadmap of a robot in a scene, and keep it with the scene.",
    description="A roadmap has collision-free joint positions and proved motions between them. Plan requests that name "
    "the scene and the robot search their free motions on it first. It replaces the robot's earlier roadmap, whose "
    "motions are proved again only against changed objects. It goes with its scene.",
    status_code=201,
    responses=returns(
        schemas.RoadmapDescription,
        codes=(*BODY_CODES, "unknown_robot", "unknown_scene", "scene_of_another", "too_many_roadmaps", "conflict"),
        status=201,
        also={200: "It replaces an earlier roadmap of the robot."},
    ),
    openapi_extra=takes(schemas.RoadmapRequest),
)
async def build_roadmap(request: Request, scene_id: SceneId, body: SceneBody) -> Response:
    """Answer POST /v1/scenes/{id}/roadmap."""
    sender = client(request)
    owned = await service_of(request).database.read(SCENES.owned, sender.namespace, scene_id, sender.changes_of)
    if owned == "of_another":
        raise _of_another()
    return respond(await _built(request, scene_id, body))


@router.get(
    "/v1/scenes/{id}/roadmap",
    summary="List the roadmaps of a scene.",
    description="There is at most one for each robot.",
    dependencies=[needs("plan")],
    responses=returns(schemas.RoadmapsAnswer, codes=("unknown_scene", *DATABASE_CODES)),
)
async def list_roadmaps(request: Request, scene_id: SceneId) -> Response:
    """Answer GET /v1/scenes/{id}/roadmap."""
    found = await service_of(request).database.read(roadmaps.roadmaps_of, client(request).namespace, scene_id)
    if found is None:
        raise _unknown()
    entries = [kept.roadmap.described_as(kept.is_of_robot and kept.is_of_scene) for kept in found[1]]
    return Answer([b'{"roadmaps":[%b]}' % b",".join(entries)], HTTPStatus.OK, "application/json", {})


@router.delete(
    "/v1/scenes/{id}/roadmap",
    summary="Delete the roadmap of a robot in a scene.",
    description="Only the client that added the scene may delete it.",
    status_code=204,
    dependencies=[needs("scenes:write")],
    responses=returns(
        None,
        codes=("invalid_request", "unknown_scene", "unknown_roadmap", "scene_of_another", *DATABASE_CODES),
        status=204,
    ),
)
async def delete_roadmap(
    request: Request, scene_id: SceneId, robot: Annotated[str, Query(min_length=1, description="Id of the robot.")]
) -> Response:
    """Answer DELETE /v1/scenes/{id}/roadmap."""
    sender = client(request)
    outcome = await service_of(request).database.write(
        roadmaps.delete_roadmap, sender.namespace, scene_id, robot, sender.changes_of
    )
    match outcome:
        case "deleted":
            audit(request, "roadmap_deleted", scene_id)
            return Response(status_code=HTTPStatus.NO_CONTENT)
        case "no_roadmap":
            raise UnknownRoadmap("The scene has no roadmap of this robot. GET /v1/scenes/{id}/roadmap lists them.")
        case "of_another":
            raise _of_another()
        case _:
            raise _unknown()


async def _prove_again(request: Request, scene_id: str) -> None:
    """Prove the roadmaps of a changed scene again, one after the other.

    A roadmap that is not proved in time stays as it is: no request uses it until it is built again.
    """
    found = await service_of(request).database.read(roadmaps.roadmaps_of, client(request).namespace, scene_id)
    for kept in [] if found is None else found[1]:
        if kept.is_of_robot and not kept.is_of_scene:
            body = await body_of(request, kept.roadmap.request, orjson.loads(kept.roadmap.request))
            try:
                code = (await _built(request, scene_id, body)).code
            except ServiceError as refusal:
                code = refusal.code
            if code is not None:
                log.warning("roadmap_not_proved_again", scene=scene_id, robot=kept.roadmap.robot, code=code)
                request.state.code = None  # the change itself is made


async def _built(request: Request, scene_id: str, body: Body) -> Reply:
    """Build a roadmap, from an earlier one of the robot if there is one, and keep it."""
    service, sender = service_of(request), client(request)
    found = await service.database.read(roadmaps.roadmaps_of, sender.namespace, scene_id)
    if found is None:
        raise _unknown()
    scene, others = found
    robot = body.document.get("robot")
    earlier = (kept.roadmap.content for kept in others if kept.is_of_robot and kept.roadmap.robot == robot)
    reply = await get_reply(
        request,
        "build_roadmap",
        body,
        cost_key=by_roadmap,
        kept=scene.definition,
        id=scene_id,
        earlier=next(earlier, None),
    )
    if reply.result is None:
        return reply
    settings = service.settings
    bounds = roadmaps.RoadmapBounds(settings.max_roadmaps_per_scene, settings.max_roadmaps_bytes_per_scene)
    match await service.database.write(
        roadmaps.keep_roadmap, sender.namespace, scene_id, scene.digest, reply.result, sender.changes_of, bounds
    ):
        case "added":
            audit(request, "roadmap_built", scene_id)
            return reply
        case "replaced":
            audit(request, "roadmap_built", scene_id)
            return replace(reply, status=HTTPStatus.OK)
        case "changed":
            raise _changed_meanwhile()
        case "unknown":
            raise _unknown()
        case "of_another":
            raise _of_another()
        case "too_many":
            raise TooManyRoadmaps(
                f"A scene may have at most {bounds.number} roadmaps. Delete the roadmap of another robot first."
            )
        case _:
            raise TooManyRoadmaps(
                f"The roadmaps of a scene may have at most {bounds.size} bytes; this one has {reply.result.size}. "
                "Lower `samples`, or delete the roadmap of another robot first."
            )


async def _found(request: Request, scene_id: str) -> SceneContent:
    """Find a scene that the client may see."""
    content = await service_of(request).database.read(SCENES.find, client(request).namespace, scene_id)
    if content is None:
        raise _unknown()
    return content


def _bounds(settings: Settings) -> Bounds:
    """Find the bounds on scenes."""
    return Bounds(
        settings.max_scenes,
        settings.max_scenes_per_client,
        settings.max_scenes_bytes,
        settings.max_scenes_bytes_per_client,
    )


def _changed_meanwhile() -> Conflict:
    message = "Another request has changed the scene at the same time. Send this one again."
    return Conflict(message, headers={"Retry-After": "1"})


def _unknown() -> UnknownScene:
    return UnknownScene("No stored scene has this id. GET /v1/scenes lists them.")


def _of_another() -> SceneOfAnother:
    return SceneOfAnother(
        "Only the client that added the scene may change or delete it: the same key, or the same address."
    )


def _no_room(lacking: str) -> TooManyScenes:
    if lacking == "full":
        return TooManyScenes("The service stores no more scenes. Delete one first.")
    return TooManyScenes("The service stores no more scenes of this client, or none as large. Delete one first.")
