"""Routes under /v1/collisions."""

from fastapi import Request, Response

from api.contract import collisions as schemas
from api.http.dependencies import PlannedBody
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["collisions"])


@router.post(
    "/v1/collisions/check",
    summary="Check joint positions, or a trajectory of any origin, for collisions.",
    description="Joint positions are checked one by one. A trajectory, given as samples with the controller's "
    "interpolation or as polynomials, is checked at all times. Each answer is `free` with its proved "
    "clearance, or names the pair that violates its margin. `speed_zones` give the times near "
    "objects and the speeds there.",
    responses=returns(schemas.CollisionCheckAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(schemas.CollisionCheckRequest),
)
async def check_collisions(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/collisions/check."""
    return respond(await get_reply(request, "check_collisions", body, shared=True))
