"""Routes under /v1/cells: several robots on one clock."""

from fastapi import Request, Response

from api.contract.cells import CellAnswer, CellRequest
from api.http.cost_keys import by_cell
from api.http.dependencies import PlannedBody
from api.http.described import returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router
from api.http.routers.trajectories import PLAN_CODES

router = Router(tags=["trajectories"])


@router.post(
    "/v1/cells/plan",
    summary="Plan two to four robots in one world on one clock.",
    description="Each robot has its own path and waits where it rests, so that all end as early as possible. Free "
    "motions make way where no waits keep the robots apart. The "
    "answer has one certified trajectory for each robot, and the proved clearance between each two robots for every "
    "start skew of their controllers.",
    responses=returns(CellAnswer, codes=PLAN_CODES, shared=True),
    openapi_extra=takes(CellRequest),
)
async def plan_cell(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/cells/plan."""
    return respond(await get_reply(request, "plan_cell", body, shared=True, cost_key=by_cell))
