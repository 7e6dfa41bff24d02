"""Routes under /v1/dynamics."""

from fastapi import Request, Response

from api.contract import dynamics as schemas
from api.http.dependencies import PlannedBody
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["dynamics"])


@router.post(
    "/v1/dynamics/inverse",
    summary="Compute the joint torques of states of motion.",
    description="The torques include gravity, inertia and Coriolis forces of the arm and its payload, by "
    "recursive Newton-Euler, and the friction and rotor inertia of the joints. A joint at rest has no friction.",
    responses=returns(
        schemas.InverseDynamicsAnswer, codes=(*BODY_CODES, "unknown_robot", "missing_dynamics"), shared=True
    ),
    openapi_extra=takes(schemas.InverseDynamicsRequest),
)
async def inverse_dynamics(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/dynamics/inverse."""
    return respond(await get_reply(request, "inverse_dynamics", body, shared=True))
