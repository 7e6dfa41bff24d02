"""Routes under /v1/paths: paths in files."""

from fastapi import Request, Response

from api.contract.path_files import PathFileAnswer, PathFileRequest
from api.http.dependencies import PlannedBody
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["trajectories"])


@router.post(
    "/v1/paths/read",
    summary="Read the path in a CSV, G-code or DXF file as waypoints.",
    description="The waypoints are those of a body of POST /v1/trajectories: lines, circles and polylines of the tool, "
    "or joint positions. The notes name everything that is left out.",
    responses=returns(PathFileAnswer, codes=(*BODY_CODES, "unknown_robot"), shared=True),
    openapi_extra=takes(PathFileRequest),
)
async def read_path(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/paths/read."""
    return respond(await get_reply(request, "read_path", body, shared=True))
