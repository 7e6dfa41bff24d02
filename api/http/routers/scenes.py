"""Scenes are kept in the database; workers check each before."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING

import orjson
from fastapi import Request, Response

from api.base.errors import Conflict, PayloadTooLarge, SceneExists, SceneOfAnother, TooManyScenes, UnknownScene
from api.base.pages import DEFAULT_ENTRIES, first_page
from api.contract import stored_scenes as schemas
from api.http.access.access import audit
from api.http.dependencies import Cursor, Limit, SceneBody, SceneId, client, needs, service_of
from api.http.described import BODY_CODES, DATABASE_CODES, NOT_MODIFIED, returns, takes
from api.http.replies import get_reply, is_known, not_modified, respond
from api.http.router import Router
from api.http.transport.answer import Answer
from api.store.named_contents import FOR_ALL, SCENES, Bounds

if TYPE_CHECKING:
    from api.base.settings import Settings
    from api.store.contents.scenes import SceneContent


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
    "is `conflict`.",
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
        case "changed":
            message = "Another request has changed the scene at the same time. Send this one again."
            raise Conflict(message, headers={"Retry-After": "1"})
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
