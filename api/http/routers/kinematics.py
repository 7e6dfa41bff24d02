"""Routes under /v1/kinematics: forward, inverse, reachability, Jacobian, workspace."""

from fastapi import Request, Response

from api.contract import kinematics as schemas
from api.http.cost_keys import by_plan
from api.http.dependencies import PlannedBody, form_of_answer
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["kinematics"])


@router.post(
    "/v1/kinematics/forward",
    summary="Compute the poses of the tool at joint positions.",
    description="Poses are in the base frame, one for each joint position.",
    responses=returns(schemas.ForwardKinematicsAnswer, codes=(*BODY_CODES, "unknown_robot"), shared=True),
    openapi_extra=takes(schemas.ForwardKinematicsRequest),
)
async def forward_kinematics(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/forward."""
    return respond(await get_reply(request, "forward_kinematics", body, shared=True))


@router.post(
    "/v1/kinematics/inverse",
    summary="Compute joint positions that reach poses.",
    description="The answer has the best solution of each pose, or all solutions; an unreachable pose has the "
    "nearest reachable one. With a `scene`, collision-free solutions come first, and the others name "
    "the colliding pair.",
    responses=returns(
        schemas.InverseKinematicsAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True
    ),
    openapi_extra=takes(schemas.InverseKinematicsRequest),
)
async def inverse_kinematics(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/inverse."""
    return respond(await get_reply(request, "inverse_kinematics", body, shared=True))


@router.post(
    "/v1/kinematics/reachability",
    summary="Check the reachability of waypoints: configurations and distance from the limits; nothing is planned.",
    description="Each waypoint is checked alone, as far as the one before does not matter. With a `scene`, the "
    "answer also says which waypoints have collision-free solutions, and names the colliding pairs "
    "of the others.",
    responses=returns(schemas.ReachabilityAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(schemas.ReachabilityRequest),
)
async def reachability(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/reachability."""
    return respond(await get_reply(request, "reachability", body, shared=True, cost_key=by_plan))


@router.post(
    "/v1/kinematics/jacobian",
    summary="Compute the Jacobian of the tool at a joint position, and its distance from a singularity.",
    description="The rows are linear, then angular velocity in the base frame; the columns are the joints.",
    responses=returns(schemas.JacobianAnswer, codes=(*BODY_CODES, "unknown_robot"), shared=True),
    openapi_extra=takes(schemas.JacobianRequest),
)
async def jacobian(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/jacobian."""
    return respond(await get_reply(request, "jacobian", body, shared=True))


@router.post(
    "/v1/kinematics/workspace",
    summary="Compute the workspace within the position limits: its extremes and a cloud of points.",
    description="Random joint positions within the limits give the points; the same seed gives the same points. "
    "`Accept` or `?format=` selects a picture of them: `svg`, `png`.",
    responses=returns(schemas.WorkspaceAnswer, codes=(*BODY_CODES, "unknown_robot", "not_acceptable"), shared=True),
    openapi_extra=takes(schemas.WorkspaceRequest),
)
async def workspace(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/workspace."""
    return respond(await get_reply(request, "workspace", body, shared=True, **form_of_answer(request)))
