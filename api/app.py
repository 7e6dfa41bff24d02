"""The application: wiring only."""

from __future__ import annotations

from contextlib import asynccontextmanager
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import structlog
from fastapi import FastAPI, Response
from starlette.exceptions import HTTPException
from starlette.routing import Match, Route

from api.errors import MEDIA_TYPE, MethodNotAllowed, NotFound, ServiceError, problem
from api.middleware import RequestContext
from api.openapi import build_openapi, extra_of, responses_of
from api.operations import OPERATIONS
from api.routes import info
from api.service import Service
from api.settings import Settings
from api.store import InMemoryRobotStore
from api.workers import WorkerPool
from planner.errors import PlanningError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from starlette.requests import Request

DESCRIPTION = "Waypoints in, certified joint trajectory out. SI units everywhere; joint arrays follow `joint_names`."

log = structlog.get_logger()


def create_app(settings: Settings | None = None, pool: WorkerPool | None = None) -> FastAPI:
    """The service as an ASGI application.

    Args:
        settings: Default: from the environment.
        pool: Workers that have been started already; default: new ones. Stopped when the application ends.
    """
    settings = settings or Settings()
    workers = pool or WorkerPool(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        workers.attach()
        log.info("started", workers=settings.workers)
        yield
        await workers.detach()
        workers.stop()
        log.info("stopped")

    app = FastAPI(
        title="Trajectory planner",
        version=_version(),
        description=DESCRIPTION,
        license_info={"name": "MIT", "identifier": "MIT"},
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=lifespan,
    )
    app.state.service = Service(settings, workers, InMemoryRobotStore(settings.max_robots))
    for operation in OPERATIONS:
        app.add_api_route(
            operation.path,
            operation.endpoint,
            methods=[operation.method],
            operation_id=operation.id,
            summary=operation.summary,
            tags=[operation.tag],
            status_code=operation.status,
            response_class=Response,
            response_model=None,
            responses=responses_of(operation),
            openapi_extra=extra_of(operation),
        )
    app.add_route("/docs", info.docs_page, include_in_schema=False)
    app.add_route("/docs/{name}", info.docs_file, include_in_schema=False)
    app.openapi = lambda: build_openapi(app)  # type: ignore[method-assign] # FastAPI's own way to replace it
    app.add_exception_handler(PlanningError, _answer_with_problem)
    app.add_exception_handler(ServiceError, _answer_with_problem)
    app.add_exception_handler(HTTPException, _answer_http_exception)
    app.add_middleware(RequestContext)
    return app


def _version() -> str:
    try:
        return version("trajectory-planner")
    except PackageNotFoundError:  # run from a checkout
        return "0+checkout"


async def _answer_with_problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, PlanningError | ServiceError)  # noqa: S101 - registered for these
    status, body = problem(error, request.url.path)
    headers = error.headers if isinstance(error, ServiceError) else None
    return Response(body, status, headers, media_type=MEDIA_TYPE)


def _methods_at(request: Request) -> set[str]:
    """Methods of all routes at the path; the router itself looks no further than the first."""
    routes = (route for route in request.app.routes if isinstance(route, Route))
    return {m for route in routes if route.matches(request.scope)[0] != Match.NONE for m in route.methods or ()}


async def _answer_http_exception(request: Request, error: Exception) -> Response:
    """What the router raises: no such path, no such method."""
    assert isinstance(error, HTTPException)  # noqa: S101 - registered for it
    if error.status_code == 405:
        allowed = ", ".join(sorted(_methods_at(request)))
        refusal: ServiceError = MethodNotAllowed(f"this path has {allowed}", headers={"Allow": allowed})
    else:
        refusal = NotFound("see /docs for the paths")
    return await _answer_with_problem(request, refusal)
