"""Routes under /v1/kinematics: forward, inverse, reachability, Jacobian, workspace."""

from fastapi import Request, Response

from api.contract import kinematics as schemas
from api.http.cost_keys import by_plan
from api.http.dependencies import Form, PlannedBody, needs
from api.http.described import BODY_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["kinematics"])


@router.post(
    "/v1/kinematics/forward",
    summary="Poses of the tool at joint positions.",
    description="Poses are in the base frame, one for each joint position.",
    dependencies=[needs("plan")],
    responses=returns(schemas.ForwardKinematicsAnswer, codes=(*BODY_CODES, "unknown_robot"), shared=True),
    openapi_extra=takes(schemas.ForwardKinematicsRequest),
)
async def forward_kinematics(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/forward."""
    return respond(await get_reply(request, "forward_kinematics", body, shared=True))


@router.post(
    "/v1/kinematics/inverse",
    summary="Joint positions that bring the tool to poses.",
    description="The best solution of each pose, or all of them; a pose without any has the nearest that the arm "
    "comes to it. In a `scene` those at which the robot keeps clear go first, and each says what is in its way.",
    dependencies=[needs("plan")],
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
    summary="Which waypoints can be reached, in how many configurations, and by what margin; nothing is planned.",
    description="Each waypoint is looked at by itself, as far as the one before it does not matter. In a `scene` "
    "it is also said at which of them the robot can keep clear, and what is in the way at the others.",
    dependencies=[needs("plan")],
    responses=returns(schemas.ReachabilityAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(schemas.ReachabilityRequest),
)
async def reachability(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/reachability."""
    return respond(await get_reply(request, "reachability", body, shared=True, cost_key=by_plan))


@router.post(
    "/v1/kinematics/jacobian",
    summary="Jacobian of the tool at a joint position, and how far that is from singular.",
    description="Its rows are linear over angular velocity in the base frame, its columns are the joints.",
    dependencies=[needs("plan")],
    responses=returns(schemas.JacobianAnswer, codes=(*BODY_CODES, "unknown_robot"), shared=True),
    openapi_extra=takes(schemas.JacobianRequest),
)
async def jacobian(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/kinematics/jacobian."""
    return respond(await get_reply(request, "jacobian", body, shared=True))


@router.post(
    "/v1/kinematics/workspace",
    summary="How far the tool reaches within the position limits, and a cloud of points where it can be.",
    description="Joint positions are drawn at random from within the limits; the same seed gives the same points. "
    "`Accept` or `?format=` asks for a picture of them: `svg`, `png`.",
    dependencies=[needs("plan")],
    responses=returns(schemas.WorkspaceAnswer, codes=(*BODY_CODES, "unknown_robot", "not_acceptable"), shared=True),
    openapi_extra=takes(schemas.WorkspaceRequest),
)
async def workspace(request: Request, body: PlannedBody, form: Form) -> Response:
    """Answer POST /v1/kinematics/workspace."""
    return respond(await get_reply(request, "workspace", body, shared=True, **form))
