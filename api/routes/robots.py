"""Added robots are kept in the database; what it does not have is the workers'."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING

from fastapi import Request, Response

from api.access.access import audit
from api.database.named_contents import FOR_ALL, ROBOTS, Bounds
from api.errors import RobotExists, RobotOfAnother, TooManyRobots
from api.pages import first_page
from api.routes.ordinary import client, is_known, not_modified, page_limit, respond, run, run_with_body, service_of
from api.server.traffic import Answer

if TYPE_CHECKING:
    from api.settings import Settings

ADDED = "uploaded."
"""What the cursors of added robots begin with; those of the catalogue's come before."""


async def list_robots(request: Request) -> Response:
    """Answer GET /v1/robots: a page, of the catalogue's robots first, then of the added ones."""
    limit = page_limit(request)
    cursor = request.query_params.get("cursor", "")
    last = cursor.removeprefix(ADDED) if cursor.startswith(ADDED) else ""  # those of the catalogue come before
    kept = await service_of(request).database.read(ROBOTS.behind, client(request).namespace, last, limit + 1)
    page, has_more = first_page(((ADDED + robot_id, summary) for robot_id, summary in kept), limit)
    return respond(await run(request, "list_robots", limit=limit, cursor=cursor, added=page, has_more=has_more))


async def get_robot(request: Request) -> Response:
    """Answer GET /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    content = await service_of(request).database.read(ROBOTS.find, client(request).namespace, robot_id)
    if content is None:
        return respond(await run(request, "get_robot", id=robot_id))
    tag = service_of(request).answers.tag("get_robot", b"", {"id": robot_id, "content": content.digest})
    if is_known(request, tag):
        return respond(not_modified(tag))
    return Answer([content.described_as(robot_id)], HTTPStatus.OK, "application/json", {"ETag": tag})


async def get_robot_geometry(request: Request) -> Response:
    """Answer GET /v1/robots/{id}/geometry."""
    robot_id = request.path_params["id"]
    content = await service_of(request).database.read(ROBOTS.find, client(request).namespace, robot_id)
    definition = None if content is None else content.definition
    form, accept = request.query_params.get("format"), request.headers.get("accept", "*/*")
    asked = {"id": robot_id, "definition": definition, "format": form, "accept": accept}
    return respond(await run(request, "get_robot_geometry", **asked))


async def add_robot(request: Request) -> Response:
    """Answer POST /v1/robots. The same robot again is answered with 200, not 201."""
    reply = await run_with_body(request, "add_robot")
    if reply.result is None:
        return respond(reply)
    robot_id, visibility, content = reply.result
    service, sender = service_of(request), client(request)
    namespace = FOR_ALL if visibility == "public" else sender.namespace
    match await service.database.write(
        ROBOTS.add, namespace, robot_id, content, sender.name, _bounds(service.settings)
    ):
        case "added":
            audit(request, "robot_added", robot_id)
        case "exists":
            raise RobotExists(f"{robot_id} is another robot; choose another id, or delete that one first")
        case "full":
            raise TooManyRobots("the service keeps no more robots; delete one first")
        case "too_many":
            raise TooManyRobots("the service keeps no more robots of yours, or none as large; delete one first")
        case "same":
            reply = replace(reply, status=200)
    return respond(reply)


def _bounds(settings: Settings) -> Bounds:
    """Find out how much is kept of robots."""
    return Bounds(
        settings.max_robots,
        settings.max_robots_per_client,
        settings.max_robots_bytes,
        settings.max_robots_bytes_per_client,
    )


async def delete_robot(request: Request) -> Response:
    """Answer DELETE /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    sender = client(request)
    match await service_of(request).database.write(ROBOTS.delete, sender.namespace, robot_id, sender.changes_of):
        case "deleted":
            audit(request, "robot_deleted", robot_id)
            return Response(status_code=204)
        case "of_another":
            raise RobotOfAnother("only who added the robot may delete it: by the same key, or from the same address")
        case _:
            return respond(await run(request, "delete_robot", id=robot_id))
