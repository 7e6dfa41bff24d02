"""Paths in files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from api.base.errors import invalid_at
from api.contract.path_files import PathFileRequest
from api.work.conversion.path_files import to_request_waypoint
from api.work.conversion.task_orders import at_field
from api.work.tasks.context import task
from planner import read_path

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext
    from planner import FieldPath


def in_request(field: FieldPath) -> FieldPath:
    """Return the field of the request for an argument of `read_path`."""
    return ("text",) if field[0] == "path" else field


@task("read_path")
def read(context: TaskContext) -> Reply:
    """Answer POST /v1/paths/read."""
    with context.stage("validate"):
        request = context.request(PathFileRequest)
        robot = context.robot(request)
    with context.stage("plan"), at_field(in_request):
        found = read_path(
            Path(request.name),
            content=request.text.encode(),
            robot=robot,
            units=request.units,
            angle=request.angle,
            tool_axis=request.tool_axis,
            blend=request.blend,
            lift=request.lift,
        )
    most = context.caps.max_waypoints
    if len(found.waypoints) > most:
        raise invalid_at("/text", f"must have at most {most} waypoints; got {len(found.waypoints)}. Split the file.")
    waypoints = [to_request_waypoint(waypoint, request.frame) for waypoint in found.waypoints]
    return context.reply({"waypoints": waypoints, "notes": list(found.notes)})
