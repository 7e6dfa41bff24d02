"""Routes under /v1/trajectories: plan, export, compare, validate, and operations on trajectories."""

from typing import Annotated

from fastapi import Query, Request, Response

from api.contract import answers, requests
from api.contract import trajectory_operations as operations
from api.contract.comparisons import ComparisonAnswer
from api.http.comparison import compare
from api.http.cost_keys import by_plan
from api.http.dependencies import Form, PlannedBody, needs
from api.http.described import BODY_CODES, NOT_MODIFIED, WORKER_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router

router = Router(tags=["trajectories"])

PLAN_CODES = (
    *BODY_CODES,
    "unknown_robot",
    "unknown_scene",
    "not_acceptable",
    "unreachable_waypoint",
    "configuration_change",
    "singular_path",
    "joint_position_limit",
    "missing_dynamics",
    "unsupported_format",
    "infeasible_duration",
    "limits_unsatisfiable",
    "start_in_collision",
    "collision",
    "clearance_unproved",
    "no_path_found",
)
"""Codes of the problem documents that may be the answer in place of a plan."""

OPERATION_CODES = (
    *BODY_CODES,
    "unknown_robot",
    "unknown_scene",
    "missing_dynamics",
    "limits_unsatisfiable",
    "start_in_collision",
    "collision",
    "clearance_unproved",
)
"""Codes of the problem documents that may be the answer to an operation instead."""


@router.post(
    "/v1/trajectories",
    summary="Plan a certified joint trajectory through waypoints.",
    description="The answer is certified to keep every limit that the back end promises to keep, or a problem "
    "document says what to change. The other forms of the answer are had by `Accept`, by `?format=`, or "
    "as a file from `export_trajectory`.",
    dependencies=[needs("plan")],
    responses=returns(answers.PlanAnswer, codes=PLAN_CODES, shared=True),
    openapi_extra=takes(requests.PlanRequest),
)
async def plan_trajectory(request: Request, body: PlannedBody, form: Form) -> Response:
    """Answer POST /v1/trajectories."""
    return respond(await get_reply(request, "plan_trajectory", body, shared=True, cost_key=by_plan, **form))


@router.post(
    "/v1/trajectories/export",
    summary="Plan as `plan_trajectory` does, and answer with a file in the form that `format` names.",
    description="Tables, messages, arrays and programs of robots. What a form cannot carry is refused with "
    "`unsupported_format`, or said in the file.",
    dependencies=[needs("plan")],
    responses=returns(bytes, codes=PLAN_CODES, shared=True, file=True, media_type="application/octet-stream"),
    openapi_extra=takes(requests.PlanRequest),
)
async def export_trajectory(
    request: Request,
    body: PlannedBody,
    form: Form,
    _format: Annotated[str, Query(alias="format", description="Form of the file.")],
) -> Response:
    """Answer POST /v1/trajectories/export."""
    return respond(await get_reply(request, "export_trajectory", body, shared=True, cost_key=by_plan, **form))


@router.post(
    "/v1/trajectories/compare",
    summary="Plan the same waypoints with several back ends, side by side.",
    description="Each back end plans by itself; one that has no plan says why in its `problem`, beside the "
    "figures of the others.",
    dependencies=[needs("plan")],
    responses=returns(ComparisonAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(requests.CompareRequest),
)
async def compare_backends(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/compare."""
    return await compare(request, body)


@router.post(
    "/v1/trajectories/validate",
    summary="Hold a trajectory of any origin against limits.",
    description="Samples are checked as a controller runs them, between the samples, too; polynomials are checked "
    "exactly.",
    dependencies=[needs("plan")],
    responses=returns(
        answers.InterpolationCertificate, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True
    ),
    openapi_extra=takes(requests.ValidateRequest),
)
async def validate_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/validate."""
    return respond(await get_reply(request, "validate_trajectory", body, shared=True))


@router.get(
    "/v1/backends",
    summary="Every back end, its options and what it guarantees.",
    description="What a back end guarantees of a quantity is a `hard` limit, one that is only `reported`, or `none`.",
    dependencies=[needs("plan")],
    responses=returns(answers.BackendsAnswer, codes=WORKER_CODES, shared=True) | NOT_MODIFIED,
)
async def list_backends(request: Request) -> Response:
    """Answer GET /v1/backends."""
    return respond(await get_reply(request, "list_backends", shared=True))


@router.post(
    "/v1/trajectories/retime",
    summary="Put time on a dense list of joint positions, smoothed within a tolerance.",
    description="The points may come from any planner; the answer says how far a joint goes from them, and runs "
    "from rest to rest. In `speed_zones` it is slowed.",
    dependencies=[needs("plan")],
    responses=returns(
        operations.RetimeAnswer, codes=(*OPERATION_CODES, "joint_position_limit", "infeasible_duration"), shared=True
    ),
    openapi_extra=takes(operations.RetimeRequest),
)
async def retime_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/retime."""
    return respond(await get_reply(request, "retime_trajectory", body, shared=True, cost_key=by_plan))


@router.post(
    "/v1/trajectories/stop",
    summary="Stop a motion as fast as the limits let it, on its path or off it.",
    description="The fastest stop within all limits of a trajectory at a time, or of a state of the joints. Where "
    "a joint cannot stop before a limit, the problem names it.",
    dependencies=[needs("plan")],
    responses=returns(operations.OperationAnswer, codes=(*OPERATION_CODES, "joint_position_limit"), shared=True),
    openapi_extra=takes(operations.StopRequest),
)
async def stop_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/stop."""
    return respond(await get_reply(request, "stop_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/reverse",
    summary="Run a trajectory backwards, with the same timing.",
    description="Positions are those of the trajectory from its end to its start, velocities have the opposite sign.",
    dependencies=[needs("plan")],
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.ReverseRequest),
)
async def reverse_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/reverse."""
    return respond(await get_reply(request, "reverse_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/slice",
    summary="Cut out the part of a trajectory between two times.",
    description="Its polynomials stay exact. A part that begins or ends in motion says so in `initial`, `final` "
    "and a warning.",
    dependencies=[needs("plan")],
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.SliceRequest),
)
async def slice_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/slice."""
    return respond(await get_reply(request, "slice_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/join",
    summary="Run trajectories one after the other, which have to meet.",
    description="Each begins where the one before ends, in position and velocity; where they do not meet, the "
    "problem says by how much.",
    dependencies=[needs("plan")],
    responses=returns(operations.JoinAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.JoinRequest),
)
async def join_trajectories(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/join."""
    return respond(await get_reply(request, "join_trajectories", body, shared=True))


@router.post(
    "/v1/trajectories/resample",
    summary="Sample a trajectory again, with its derivatives, as the controller runs it.",
    description="At another period, or at times of your own.",
    dependencies=[needs("plan")],
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.ResampleRequest),
)
async def resample_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/resample."""
    return respond(await get_reply(request, "resample_trajectory", body, shared=True))
