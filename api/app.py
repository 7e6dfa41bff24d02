"""The application: wiring only."""

from __future__ import annotations

from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import structlog
from fastapi import FastAPI, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.routing import Match

from api.base.byte_budget import Traffic
from api.base.errors import MethodNotAllowed, NotFound, Overloaded, ServiceError, invalid, message_of
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.base.settings import Settings
from api.batches.arrival import Intake
from api.batches.cluster import ClusterPlanners
from api.batches.engine import Engine
from api.batches.looks import Looks
from api.batches.planners import PoolPlanners
from api.http.access.access import Access
from api.http.access.sites import Sites
from api.http.middleware import RequestContext
from api.http.router import Route
from api.http.routers import ROUTERS, page
from api.http.service import Service
from api.http.shared_answers import SharedAnswers
from api.http.transport.shedding import Shedding, leave_place
from api.pool.pool import WorkerPool
from api.store.database import Database, database_url
from api.telemetry.metrics import Metrics
from api.telemetry.traces import Traces
from api.work.entry import ENTRY

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from starlette.requests import Request

    from api.batches.planners import Planners

METHODS = ("DELETE", "GET", "PATCH", "POST", "PUT")
"""The methods of all operations."""

READ_HEADERS = (
    "Accept",
    "Authorization",
    "Cache-Control",
    "Content-Type",
    "Idempotency-Key",
    "If-Match",
    "If-None-Match",
    "Last-Event-ID",
    "X-Request-ID",
)
"""The headers that pages of other origins may send, where `cors_origins` lets them in."""

SENT_HEADERS = (
    "ETag",
    "Location",
    "RateLimit-Limit",
    "RateLimit-Remaining",
    "RateLimit-Reset",
    "Retry-After",
    "Server-Timing",
    "X-Request-ID",
)
"""The headers of answers that such pages may read."""

log = structlog.get_logger()


def create_app(settings: Settings | None = None, pool: WorkerPool | None = None) -> FastAPI:
    """Make the service as an ASGI application.

    Args:
        settings: The settings of the operator; None: read from the environment.
        pool: Workers that have been started already; None: new ones. They are stopped when the application ends.
    """
    settings = settings or Settings()
    workers = pool or WorkerPool(settings, ENTRY)
    database = Database(database_url(settings), settings.database_reading_threads)
    metrics, traffic = Metrics(), Traffic(settings.max_bytes_in_flight)
    metrics.watch(workers, traffic)
    traces = Traces(settings.otlp_endpoint)
    planners: Planners = PoolPlanners(workers, settings)
    if settings.scheduler is not None:
        planners = ClusterPlanners(settings.scheduler)
    engine = Engine(database, planners, settings, metrics)
    access = Access(settings, database)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        database.open()
        workers.attach()
        await engine.start()
        log.info("started", workers=settings.workers)
        page.warn_if_not_built()
        yield
        await engine.stop()
        await access.close()
        await workers.detach()
        workers.stop()
        database.close()
        traces.close()
        log.info("stopped")

    # `api/http/openapi.py` serves the document, as only workers know the schemas of the back ends.
    app = FastAPI(openapi_url=None, redirect_slashes=False, lifespan=lifespan, telemetry=traces.of_fastapi)
    answers = SharedAnswers(traffic, settings.answer_cache_bytes, metrics)
    shedding = Shedding(settings, metrics)
    app.state.service = Service(
        settings,
        workers,
        database,
        engine,
        Intake(settings, database, workers, engine),
        access,
        metrics,
        answers,
        Looks(database),
        shedding,
    )
    for router in ROUTERS:
        app.router.routes.extend(router.routes)  # FastAPI matches included routes twice as slowly
    app.add_exception_handler(ServiceError, _answer_with_problem_document)
    app.add_exception_handler(HTTPException, _answer_http_exception)
    app.add_exception_handler(RequestValidationError, _answer_invalid_parameters)
    app.add_middleware(RequestContext, sites=Sites(settings), traffic=traffic, metrics=metrics, traces=traces)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=METHODS,
            allow_headers=READ_HEADERS,
            expose_headers=SENT_HEADERS,
        )
    return app


async def _answer_with_problem_document(request: Request, error: Exception) -> Response:
    assert isinstance(error, ServiceError)  # noqa: S101 - registered for them
    request.state.code = error.code
    if isinstance(error, Overloaded):
        request.state.share.release()
        leave_place(request.scope)
        await request.app.state.service.shedding.wait()
    status, body = problem_document(error, request.url.path)
    return Response(body, status, error.headers, media_type=MEDIA_TYPE)


def _methods_at(request: Request) -> set[str]:
    """Collect the methods of all routes at the path; the router itself looks no further than the first."""
    routes = (route for route in request.app.routes if isinstance(route, Route))
    return {method for route in routes if route.matches(request.scope)[0] != Match.NONE for method in route.allowed}


async def _answer_invalid_parameters(request: Request, error: Exception) -> Response:
    """Answer where FastAPI finds that parameters of the path, the query or the headers are invalid."""
    assert isinstance(error, RequestValidationError)  # noqa: S101 - registered for it
    faults = [{"pointer": "", "message": _parameter_fault(fault)} for fault in error.errors()]
    return await _answer_with_problem_document(request, invalid(faults))


def _parameter_fault(fault: dict[str, Any]) -> str:
    """Describe the fault of a parameter."""
    return f"The parameter `{fault['loc'][-1]}` {message_of(fault)}."


async def _answer_http_exception(request: Request, error: Exception) -> Response:
    """Answer a path or a method that does not exist."""
    assert isinstance(error, HTTPException)  # noqa: S101 - registered for it
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        allowed = ", ".join(sorted(_methods_at(request)))
        refusal: ServiceError = MethodNotAllowed(f"The method must be one of {allowed}.", headers={"Allow": allowed})
    else:
        refusal = NotFound("Nothing has this path. See /docs for the paths.")
    return await _answer_with_problem_document(request, refusal)
