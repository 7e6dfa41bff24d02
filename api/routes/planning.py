"""Trajectories, kinematics and dynamics: all the work is a worker's."""

from __future__ import annotations

from fastapi import Request, Response  # noqa: TC002 - FastAPI evaluates the annotations

from api.negotiation import requested_format
from api.routes.work import compare_with_body, respond, run_with_body


async def plan_trajectory(request: Request) -> Response:
    """POST /v1/trajectories."""
    return respond(await run_with_body(request, "plan_trajectory", format=requested_format(request)))


async def compare_backends(request: Request) -> Response:
    """POST /v1/trajectories/compare."""
    return await compare_with_body(request)


async def validate_trajectory(request: Request) -> Response:
    """POST /v1/trajectories/validate."""
    return respond(await run_with_body(request, "validate_trajectory"))


async def forward_kinematics(request: Request) -> Response:
    """POST /v1/kinematics/forward."""
    return respond(await run_with_body(request, "forward_kinematics"))


async def inverse_kinematics(request: Request) -> Response:
    """POST /v1/kinematics/inverse."""
    return respond(await run_with_body(request, "inverse_kinematics"))


async def reachability(request: Request) -> Response:
    """POST /v1/kinematics/reachability."""
    return respond(await run_with_body(request, "reachability"))


async def jacobian(request: Request) -> Response:
    """POST /v1/kinematics/jacobian."""
    return respond(await run_with_body(request, "jacobian"))


async def workspace(request: Request) -> Response:
    """POST /v1/kinematics/workspace."""
    return respond(await run_with_body(request, "workspace"))


async def inverse_dynamics(request: Request) -> Response:
    """POST /v1/dynamics/inverse."""
    return respond(await run_with_body(request, "inverse_dynamics"))
