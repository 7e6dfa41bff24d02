"""Routes under /v1/tasks: tasks in any order."""

from fastapi import Request, Response

from api.contract.tasks import OrderAnswer, OrderRequest
from api.http.cost_keys import by_plan
from api.http.dependencies import PlannedBody
from api.http.described import returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router
from api.http.routers.trajectories import PLAN_CODES

router = Router(tags=["trajectories"])


@router.post(
    "/v1/tasks/order",
    summary="Plan tasks in the order of the shortest duration that the search finds.",
    description="Points, lines, seams, closed contours and picks with their places. The order, directions, "
    "configurations and turns about the tool are chosen together. The answer has the certified plan, a lower bound and "
    "the gap.",
    responses=returns(OrderAnswer, codes=PLAN_CODES, shared=True),
    openapi_extra=takes(OrderRequest),
)
async def order_tasks(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/tasks/order."""
    return respond(await get_reply(request, "order_tasks", body, shared=True, cost_key=by_plan))
