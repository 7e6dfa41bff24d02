"""Routes under /v1/trajectories: plan, export, compare, validate, and operations on trajectories."""

from typing import Annotated

from fastapi import Query, Request, Response

from api.contract import answers, requests, service
from api.contract import trajectory_operations as operations
from api.contract.comparisons import ComparisonAnswer
from api.http.comparison import compare
from api.http.cost_keys import by_plan
from api.http.dependencies import PlannedBody, form_of_answer, needs
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
    "payload_exceeded",
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
    "payload_exceeded",
    "limits_unsatisfiable",
    "start_in_collision",
    "collision",
    "clearance_unproved",
)
"""Codes of the problem documents that may be the answer to an operation instead."""


@router.post(
    "/v1/trajectories",
    summary="Plan a certified joint trajectory through waypoints.",
    description="The trajectory keeps every limit that the back end promises to keep; otherwise a problem "
    "document gives the reason and remedies. `Accept`, `?format=` or `export_trajectory` select "
    "other formats.",
    responses=returns(answers.PlanAnswer, codes=PLAN_CODES, shared=True),
    openapi_extra=takes(requests.PlanRequest),
)
async def plan_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories."""
    return respond(
        await get_reply(request, "plan_trajectory", body, shared=True, cost_key=by_plan, **form_of_answer(request))
    )


@router.post(
    "/v1/trajectories/export",
    summary="Plan as POST /v1/trajectories does, and answer with a file in the requested format.",
    description="Formats are tables, messages, arrays and robot programs. Content that a format cannot express "
    "is refused with `unsupported_format`, or noted in the file.",
    responses=returns(bytes, codes=PLAN_CODES, shared=True, file=True, media_type="application/octet-stream"),
    openapi_extra=takes(requests.PlanRequest),
)
async def export_trajectory(
    request: Request,
    body: PlannedBody,
    _format: Annotated[str, Query(alias="format", description="Form of the file.")],
) -> Response:
    """Answer POST /v1/trajectories/export."""
    return respond(
        await get_reply(request, "export_trajectory", body, shared=True, cost_key=by_plan, **form_of_answer(request))
    )


@router.post(
    "/v1/trajectories/compare",
    summary="Plan the same waypoints with several back ends.",
    description="Each back end plans independently; one without a plan has the reason in its `problem`.",
    responses=returns(ComparisonAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(requests.CompareRequest),
)
async def compare_backends(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/compare."""
    return await compare(request, body)


@router.post(
    "/v1/trajectories/validate",
    summary="Check a trajectory of any origin against limits.",
    description="Samples are checked as the controller interpolates them, also between samples; polynomials are "
    "checked exactly.",
    responses=returns(operations.ValidationAnswer, codes=(*BODY_CODES, "unknown_robot", "unknown_scene"), shared=True),
    openapi_extra=takes(requests.ValidateRequest),
)
async def validate_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/validate."""
    return respond(await get_reply(request, "validate_trajectory", body, shared=True))


@router.get(
    "/v1/backends",
    summary="List the back ends with their options and promises.",
    description="For each quantity, a limit is `hard`, only `reported`, or `none`.",
    dependencies=[needs("plan")],
    responses=returns(service.BackendsAnswer, codes=WORKER_CODES, shared=True) | NOT_MODIFIED,
)
async def list_backends(request: Request) -> Response:
    """Answer GET /v1/backends."""
    return respond(await get_reply(request, "list_backends", shared=True))


@router.post(
    "/v1/trajectories/retime",
    summary="Retime a dense list of joint positions, smoothed within a tolerance.",
    description="The points may come from any planner. The answer gives the largest deviation of a joint from "
    "them, and starts and ends at rest. `speed_zones` slow the trajectory.",
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
    summary="Stop a motion as fast as the limits allow, on its path or off it.",
    description="The answer is the fastest stop within all limits, from a time of a trajectory or a state of the "
    "joints. If a joint cannot stop before a limit, the problem names it.",
    responses=returns(operations.OperationAnswer, codes=(*OPERATION_CODES, "joint_position_limit"), shared=True),
    openapi_extra=takes(operations.StopRequest),
)
async def stop_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/stop."""
    return respond(await get_reply(request, "stop_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/reverse",
    summary="Reverse a trajectory with the same timing.",
    description="Positions run from the end of the trajectory to its start, and velocities have the opposite sign.",
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.ReverseRequest),
)
async def reverse_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/reverse."""
    return respond(await get_reply(request, "reverse_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/max_payload",
    summary="Find the heaviest payload of a trajectory.",
    description="The mass is the largest one with which the certificate finds the torque limits kept, at most the "
    "rated payload of the robot. A box about the center of mass makes it robust.",
    responses=returns(
        operations.MaxPayloadAnswer,
        codes=(*BODY_CODES, "unknown_robot", "missing_dynamics", "limits_unsatisfiable"),
        shared=True,
    ),
    openapi_extra=takes(operations.MaxPayloadRequest),
)
async def max_payload(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/max_payload."""
    return respond(await get_reply(request, "max_payload", body, shared=True))


@router.post(
    "/v1/trajectories/slice",
    summary="Cut out a part of a trajectory between two times.",
    description="Its polynomials stay exact. If the part begins or ends in motion, `initial`, `final` and a "
    "warning say so.",
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.SliceRequest),
)
async def slice_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/slice."""
    return respond(await get_reply(request, "slice_trajectory", body, shared=True))


@router.post(
    "/v1/trajectories/join",
    summary="Join trajectories that meet.",
    description="Each begins where the one before ends, in position and velocity; otherwise the problem gives "
    "the difference.",
    responses=returns(operations.JoinAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.JoinRequest),
)
async def join_trajectories(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/join."""
    return respond(await get_reply(request, "join_trajectories", body, shared=True))


@router.post(
    "/v1/trajectories/resample",
    summary="Resample a trajectory with its derivatives, as the controller interpolates it.",
    description="The answer has another sample period, or the requested times.",
    responses=returns(operations.OperationAnswer, codes=OPERATION_CODES, shared=True),
    openapi_extra=takes(operations.ResampleRequest),
)
async def resample_trajectory(request: Request, body: PlannedBody) -> Response:
    """Answer POST /v1/trajectories/resample."""
    return respond(await get_reply(request, "resample_trajectory", body, shared=True))
