"""Robots: the catalogue's are read in the workers, the added ones are kept in the store."""

from __future__ import annotations

from dataclasses import replace

from fastapi import Request, Response

from api.errors import CatalogueRobot, RobotExists, TooManyRobots
from api.routes.work import respond, run, run_with_body, service_of
from planner.errors import UnknownRobot
from planner.robots import catalogue_ids

NO_SUCH_ROBOT = "no robot has this id; GET /v1/robots lists those that there are"


async def list_robots(request: Request) -> Response:
    """GET /v1/robots."""
    added = [content.described_as(robot_id) for robot_id, content in service_of(request).robots.all()]
    return respond(await run(request, "list_robots", added=added))


async def get_robot(request: Request) -> Response:
    """GET /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    content = service_of(request).robots.get(robot_id)
    if content is not None:
        return Response(content.described_as(robot_id), media_type="application/json")
    if robot_id not in catalogue_ids():
        raise UnknownRobot(NO_SUCH_ROBOT)
    return respond(await run(request, "get_robot", id=robot_id))


async def add_robot(request: Request) -> Response:
    """POST /v1/robots. The same robot again is answered with 200, not 201."""
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
    """DELETE /v1/robots/{id}."""
    robot_id = request.path_params["id"]
    if robot_id in catalogue_ids():
        raise CatalogueRobot(f"{robot_id} is a robot of the catalogue")
    if not service_of(request).robots.delete(robot_id):
        raise UnknownRobot(NO_SUCH_ROBOT)
    return Response(status_code=204)
