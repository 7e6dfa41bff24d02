"""Scenes are kept in the database; workers look at what comes into it."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING

import orjson
from fastapi import Request, Response

from api.access.access import audit
from api.database.named_contents import FOR_ALL, SCENES, Bounds
from api.errors import Conflict, PayloadTooLarge, SceneExists, SceneOfAnother, TooManyScenes, UnknownScene
from api.pages import first_page
from api.routes.ordinary import (
    client,
    is_known,
    look_at_body,
    not_modified,
    page_limit,
    respond,
    run,
    run_with_body,
    service_of,
)
from api.server.traffic import Answer

if TYPE_CHECKING:
    from api.content.scenes import SceneContent
    from api.settings import Settings


async def list_scenes(request: Request) -> Response:
    """Answer GET /v1/scenes: a page."""
    limit, cursor = page_limit(request), request.query_params.get("cursor", "")
    found = await service_of(request).database.read(SCENES.behind, client(request).namespace, cursor, limit + 1)
    page, has_more = first_page(found, limit)
    answer = {
        "scenes": [orjson.Fragment(summary) for _, summary in page],
        "next_cursor": page[-1][0] if has_more else None,
    }
    return Answer([orjson.dumps(answer)], HTTPStatus.OK, "application/json", {})


async def get_scene(request: Request) -> Response:
    """Answer GET /v1/scenes/{id}."""
    scene_id, content = await _found(request)
    tag = service_of(request).answers.tag("get_scene", b"", {"id": scene_id, "content": content.digest})
    if is_known(request, tag):
        return respond(not_modified(tag))
    return Answer([content.described_as(scene_id)], HTTPStatus.OK, "application/json", {"ETag": tag})


async def add_scene(request: Request) -> Response:
    """Answer POST /v1/scenes. The same scene again is answered with 200, not 201."""
    reply = await run_with_body(request, "add_scene")
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
            raise SceneExists(f"{scene_id} is another scene; change that one, delete it first, or choose another id")
        case "same":
            reply = replace(reply, status=HTTPStatus.OK)
        case lacking:
            raise _no_room(lacking)
    return respond(reply)


async def change_scene(request: Request) -> Response:
    """Answer PATCH /v1/scenes/{id}."""
    asked = await look_at_body(request)
    scene_id, before = await _found(request)
    reply = await run(request, "change_scene", asked, kept=before.definition, id=scene_id)
    if reply.result is None:
        return respond(reply)
    service, sender, content = service_of(request), client(request), reply.result
    if content.size > service.settings.max_body_bytes:
        raise PayloadTooLarge(f"the scene would be larger than the {service.settings.max_body_bytes} bytes of a body")
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
            message = "another request has changed the scene at the same time; send this one again"
            raise Conflict(message, headers={"Retry-After": "1"})
        case "unknown":
            raise _unknown()
        case "of_another":
            raise _of_another()
        case lacking:
            raise _no_room(lacking)
    return respond(reply)


async def delete_scene(request: Request) -> Response:
    """Answer DELETE /v1/scenes/{id}."""
    scene_id, sender = request.path_params["id"], client(request)
    match await service_of(request).database.write(SCENES.delete, sender.namespace, scene_id, sender.changes_of):
        case "deleted":
            audit(request, "scene_deleted", scene_id)
            return Response(status_code=HTTPStatus.NO_CONTENT)
        case "of_another":
            raise _of_another()
        case _:
            raise _unknown()


async def _found(request: Request) -> tuple[str, SceneContent]:
    """Find the scene of the path, with its id."""
    scene_id = request.path_params["id"]
    content = await service_of(request).database.read(SCENES.find, client(request).namespace, scene_id)
    if content is None:
        raise _unknown()
    return scene_id, content


def _bounds(settings: Settings) -> Bounds:
    """Find out how much is kept of scenes."""
    return Bounds(
        settings.max_scenes,
        settings.max_scenes_per_client,
        settings.max_scenes_bytes,
        settings.max_scenes_bytes_per_client,
    )


def _unknown() -> UnknownScene:
    return UnknownScene("no scene has this id; GET /v1/scenes lists those that there are")


def _of_another() -> SceneOfAnother:
    return SceneOfAnother("only who added the scene may change or delete it: by the same key, or from the same address")


def _no_room(lacking: str) -> TooManyScenes:
    if lacking == "full":
        return TooManyScenes("the service keeps no more scenes; delete one first")
    return TooManyScenes("the service keeps no more scenes of yours, or none as large; delete one first")
