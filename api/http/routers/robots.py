"""Robots: added ones are in the database, and the workers have the catalogue."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING

from fastapi import Request, Response

from api.base.errors import RobotExists, RobotOfAnother, TooManyRobots
from api.base.pages import DEFAULT_ENTRIES, first_page
from api.contract import robots as schemas
from api.contract.robot_geometry import RobotGeometry
from api.http.access.access import audit
from api.http.dependencies import Cursor, Limit, RobotBody, RobotId, client, form_of_answer, needs, service_of
from api.http.described import BODY_CODES, DATABASE_CODES, NOT_MODIFIED, returns, takes
from api.http.replies import get_reply, is_known, not_modified, respond
from api.http.router import Router
from api.http.transport.answer import Answer
from api.store.named_contents import FOR_ALL, ROBOTS, Bounds, find_visuals

if TYPE_CHECKING:
    from api.base.settings import Settings

router = Router(tags=["robots"])

ADDED = "uploaded."
"""The prefix of the cursors of added robots; robots of the catalogue come before them."""


@router.get(
    "/v1/robots",
    summary="List the robots of the catalogue and the added ones, in pages.",
    description="The list has summaries; `get_robot` has frames, groups, shapes and the rest.",
    dependencies=[needs("plan")],
    responses=returns(schemas.RobotsAnswer, codes=("invalid_request", *DATABASE_CODES)),
)
async def list_robots(request: Request, limit: Limit = DEFAULT_ENTRIES, cursor: Cursor = None) -> Response:
    """Answer GET /v1/robots: a page, of the catalogue's robots first, then of the added ones."""
    cursor = cursor or ""
    last = cursor.removeprefix(ADDED) if cursor.startswith(ADDED) else ""  # those of the catalogue come before
    kept = await service_of(request).database.read(ROBOTS.behind, client(request).namespace, last, limit + 1)
    page, has_more = first_page(((ADDED + robot_id, summary) for robot_id, summary in kept), limit)
    return respond(await get_reply(request, "list_robots", limit=limit, cursor=cursor, added=page, has_more=has_more))


@router.get(
    "/v1/robots/{id}",
    summary="Get a robot.",
    description="The answer has its joints, their limits and the source of each limit.",
    dependencies=[needs("plan")],
    responses=returns(schemas.RobotDescription, codes=("unknown_robot", *DATABASE_CODES), shared=True) | NOT_MODIFIED,
)
async def get_robot(request: Request, robot_id: RobotId) -> Response:
    """Answer GET /v1/robots/{id}."""
    content = await service_of(request).database.read(ROBOTS.find, client(request).namespace, robot_id)
    if content is None:
        return respond(await get_reply(request, "get_robot", shared=True, id=robot_id))
    tag = service_of(request).answers.tag("get_robot", b"", {"id": robot_id, "content": content.digest})
    if is_known(request, tag):
        return respond(not_modified(tag))
    return Answer([content.described_as(robot_id)], HTTPStatus.OK, "application/json", {"ETag": tag})


@router.get(
    "/v1/robots/{id}/geometry",
    summary="Get the collision shapes of a robot.",
    description="The answer has the convex shapes of the links with their placements and sources, and the pairs "
    "of links, with the reason for unchecked pairs. `Accept` (or `?format=gltf`, `glb`) selects glTF "
    "2.0 for viewers, with a node for each joint at position 0, or a picture of the arm as a stick "
    "model (`?format=svg`, `png`).",
    dependencies=[needs("plan")],
    responses=returns(RobotGeometry, codes=("unknown_robot", "not_acceptable", *DATABASE_CODES), shared=True)
    | NOT_MODIFIED,
)
async def get_robot_geometry(request: Request, robot_id: RobotId) -> Response:
    """Answer GET /v1/robots/{id}/geometry."""
    content = await service_of(request).database.read(ROBOTS.find, client(request).namespace, robot_id)
    definition = None if content is None else content.definition
    return respond(
        await get_reply(
            request, "get_robot_geometry", shared=True, id=robot_id, definition=definition, **form_of_answer(request)
        )
    )


@router.get(
    "/v1/robots/{id}/visuals",
    summary="Get the visual meshes of a robot as glTF.",
    description="The answer is a binary glTF 2.0 file for viewers, with the colours of the URDF's materials. It has a "
    "node for each joint at position 0, below it one for each link, and below that the meshes in the frame of the "
    "link. Proofs use the collision shapes of `get_robot_geometry` alone.",
    dependencies=[needs("plan")],
    responses=returns(
        bytes, codes=("unknown_robot", *DATABASE_CODES), shared=True, media_type="model/gltf-binary", file=True
    )
    | NOT_MODIFIED,
)
async def get_robot_visuals(request: Request, robot_id: RobotId) -> Response:
    """Answer GET /v1/robots/{id}/visuals."""
    service, namespace = service_of(request), client(request).namespace
    content = await service.database.read(ROBOTS.find, namespace, robot_id)
    if content is not None:
        tag = service.answers.tag("get_robot_visuals", b"", {"id": robot_id, "content": content.digest})
        if is_known(request, tag):
            return respond(not_modified(tag))
        visuals = await service.database.read(find_visuals, namespace, robot_id)
        if visuals:
            request.state.share.hold(len(visuals))
            return Answer([visuals], HTTPStatus.OK, "model/gltf-binary", {"ETag": tag} | _attached(robot_id))
    definition = None if content is None else content.definition
    reply = await get_reply(request, "get_robot_visuals", shared=True, id=robot_id, definition=definition)
    is_file = reply.status == HTTPStatus.OK
    return respond(replace(reply, headers={**reply.headers, **_attached(robot_id)}) if is_file else reply)


def _attached(robot_id: str) -> dict[str, str]:
    """Name the file of a robot."""
    return {"Content-Disposition": f'attachment; filename="{robot_id}.glb"'}


@router.post(
    "/v1/robots",
    summary="Add a robot from a URDF document, a Denavit-Hartenberg table, or another robot.",
    description="`findings` list what was read and what was filled in. Where the service requires keys, only the "
    "same key sees the robot, or everybody with `visibility`: `public`.",
    status_code=201,
    responses=returns(
        schemas.AddedRobot,
        codes=(
            *BODY_CODES,
            "invalid_robot_model",
            "unknown_robot",
            "robot_exists",
            "catalogue_robot",
            "too_many_robots",
        ),
        status=201,
        also={200: "The same robot was there already."},
        leads_to=("get_robot", "delete_robot"),
    ),
    openapi_extra=takes(schemas.RobotDefinition),
)
async def add_robot(request: Request, body: RobotBody) -> Response:
    """Answer POST /v1/robots. The same robot again is answered with 200, not 201."""
    reply = await get_reply(request, "add_robot", body)
    if reply.result is None:
        return respond(reply)
    robot_id, visibility, content = reply.result
    service, sender = service_of(request), client(request)
    if isinstance(base := body.document.get("from"), str):  # a derived robot has the links of the other one
        visuals = await service.database.read(find_visuals, sender.namespace, base)
        content = replace(content, visuals=visuals)
    namespace = FOR_ALL if visibility == "public" else sender.namespace
    match await service.database.write(
        ROBOTS.add, namespace, robot_id, content, sender.name, _bounds(service.settings)
    ):
        case "added":
            audit(request, "robot_added", robot_id)
        case "exists":
            raise RobotExists(f"Another robot has the id {robot_id}. Choose another id, or delete that robot first.")
        case "full":
            raise TooManyRobots("The service stores no more robots. Delete one first.")
        case "too_many":
            raise TooManyRobots("The service stores no more robots of this client, or none as large. Delete one first.")
        case "same":
            reply = replace(reply, status=200)
    return respond(reply)


def _bounds(settings: Settings) -> Bounds:
    """Find the bounds on added robots."""
    return Bounds(
        settings.max_robots,
        settings.max_robots_per_client,
        settings.max_robots_bytes,
        settings.max_robots_bytes_per_client,
    )


@router.delete(
    "/v1/robots/{id}",
    summary="Delete an added robot.",
    description="Robots of the catalogue and of other clients cannot be deleted.",
    status_code=204,
    dependencies=[needs("robots:write")],
    responses=returns(
        None, codes=("unknown_robot", "catalogue_robot", "robot_of_another", *DATABASE_CODES), status=204
    ),
)
async def delete_robot(request: Request, robot_id: RobotId) -> Response:
    """Answer DELETE /v1/robots/{id}."""
    sender = client(request)
    match await service_of(request).database.write(ROBOTS.delete, sender.namespace, robot_id, sender.changes_of):
        case "deleted":
            audit(request, "robot_deleted", robot_id)
            return Response(status_code=204)
        case "of_another":
            raise RobotOfAnother(
                "Only the client that added the robot may delete it: the same key, or the same address."
            )
        case _:
            return respond(await get_reply(request, "delete_robot", id=robot_id))
