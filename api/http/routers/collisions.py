"""Routes under /v1/collisions."""

from fastapi import Request, Response

from api.contract import collisions as schemas
from api.http.dependencies import PlannedBody, needs
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["collisions"])


@router.post(
    "/v1/collisions/check",
    summary="Prove that postures, or a trajectory of any origin, keep clear.",
    description="Postures are looked at one by one; a trajectory, as samples with the interpolation that the "
    "controller runs or as polynomials, at all times. Each is `free`, with its clearance for certain, or the pair "
    "that is too near is named. `speed_zones` say when a trajectory is near to objects, and how fast it is there.",
    dependencies=[needs("plan")],
    responses=returns(schemas.CollisionCheckAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(schemas.CollisionCheckRequest),
)
async def check_collisions(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/collisions/check."""
    return respond(await get_reply(request, "check_collisions", body, shared=True))
