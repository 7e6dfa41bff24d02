"""Uploaded robots are kept here, in the store; what the store does not have is the workers'."""

from __future__ import annotations

from dataclasses import replace

from fastapi import Request, Response

from api.errors import RobotExists, TooManyRobots
from api.routes.ordinary import respond, run, run_with_body, service_of


async def list_robots(request: Request) -> Response:
    """Answer GET /v1/robots."""
    added = [content.described_as(robot_id) for robot_id, content in service_of(request).robots.all()]
    return respond(await run(request, "list_robots", added=added))


async def get_robot(request: Request) -> Response:
    """Answer GET /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    content = service_of(request).robots.get(robot_id)
    if content is None:
        return respond(await run(request, "get_robot", id=robot_id))
    return Response(content.described_as(robot_id), media_type="application/json")


async def add_robot(request: Request) -> Response:
    """Answer POST /v1/robots. The same robot again is answered with 200, not 201."""
    reply = await run_with_body(request, "add_robot")
    if reply.result is None:
        return respond(reply)
    robot_id, content = reply.result
    match service_of(request).robots.add(robot_id, content):
        case "exists":
            raise RobotExists(f"{robot_id} is another robot; choose another id, or delete that one first")
        case "full":
            raise TooManyRobots("the service keeps no more robots; delete one first")
        case "same":
            reply = replace(reply, status=200)
    return respond(reply)


async def delete_robot(request: Request) -> Response:
    """Answer DELETE /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    if service_of(request).robots.delete(robot_id):
        return Response(status_code=204)
    return respond(await run(request, "delete_robot", id=robot_id))
