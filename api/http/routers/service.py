"""Routes about the service itself."""

from __future__ import annotations

import base64
import hashlib
import re
from importlib.resources import files
from typing import Any

import orjson
from fastapi import Request, Response
from fastapi.openapi.docs import get_swagger_ui_html

from api.base.content_policies import DOCUMENTATION
from api.base.errors import NotFound
from api.base.settings import Settings
from api.contract import service
from api.contract.parts.common import DEFAULT_DEADLINE
from api.contract.service import ServiceLimits
from api.http.dependencies import needs, service_of
from api.http.described import returns
from api.http.openapi import document_of, guide_of
from api.http.router import Router
from api.http.transport.shedding import ALIVE
from api.store.batches import left_to_plan
from api.telemetry.metrics import MEDIA_TYPE

router = Router(tags=["service"])

documentation = Router(include_in_schema=False)
"""The routes of the documentation, which are no part of it."""

SWAGGER_FILES = {
    "swagger-ui-bundle.js": "text/javascript",
    "swagger-ui.css": "text/css",
    "favicon-32x32.png": "image/png",
}
"""Files of Swagger UI and their media types, from the package `fastapi-swagger`: the page needs no other host."""


@router.get(
    "/v1/limits",
    summary="Get the limits of the service.",
    description="The limits bound the size of requests, the queue and the deadline.",
    dependencies=[needs("plan")],
    responses=returns(service.ServiceLimits),
)
async def get_limits(request: Request) -> Response:
    """Answer GET /v1/limits."""
    settings = service_of(request).settings
    caps = {name: getattr(settings, name) for name in ServiceLimits.model_fields if name in Settings.model_fields}
    return _json(caps | {"default_deadline": DEFAULT_DEADLINE})


@router.get(
    "/livez",
    summary="Check that the server process answers.",
    description="The server itself answers, independent of its workers.",
    responses=returns(service.Liveness, open_to_all=True),
)
async def get_liveness(request: Request) -> Response:
    """Answer GET /livez."""
    return Response(ALIVE, media_type="application/json")


@router.get(
    "/readyz",
    summary="Check that the workers are warm: each has planned once with every back end.",
    description="Load balancers send requests to a ready service.",
    responses=returns(service.Readiness, also={503: "Not yet."}, open_to_all=True),
)
async def get_readiness(request: Request) -> Response:
    """Answer GET /readyz."""
    service = service_of(request)
    status = "starting"
    if service.pool.ready:
        status = "ready" if await service.database.is_readable() else "database_unavailable"
    answer = {
        "status": status,
        "workers": service.pool.size,
        "warm_workers": service.pool.warm_workers,
    }
    return _json(answer, 200 if status == "ready" else 503)


@router.get(
    "/metrics",
    summary="Get the metrics of the service, in Prometheus' text format.",
    description="The metrics cover requests, latencies, refusals, workers, their queue, and batches.",
    dependencies=[needs("admin")],
    responses=returns(str, codes=("database_unavailable",), media_type="text/plain"),
)
async def get_metrics(request: Request) -> Response:
    """Answer GET /metrics."""
    service = service_of(request)
    service.metrics.set_batches(*await service.database.read(left_to_plan))
    return Response(service.metrics.as_text(), media_type=MEDIA_TYPE)


@documentation.get("/openapi.json")
async def openapi(request: Request) -> Response:
    """Answer GET /openapi.json."""
    return await document_of(request)


@documentation.get("/llms.txt")
async def guide(request: Request) -> Response:
    """Answer GET /llms.txt: the operations for language models, in the form of llmstxt.org."""
    return Response(guide_of(request), media_type="text/plain")


@documentation.get("/docs")
async def docs_page(request: Request) -> Response:
    """Answer GET /docs."""
    page = get_swagger_ui_html(
        openapi_url="openapi.json",
        title="Trajectory planner",
        swagger_js_url="docs/swagger-ui-bundle.js",
        swagger_css_url="docs/swagger-ui.css",
        swagger_favicon_url="docs/favicon-32x32.png",
    )
    [script] = re.findall(rb"<script>(.*?)</script>", bytes(page.body), flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script).digest()).decode()
    page.headers["Content-Security-Policy"] = DOCUMENTATION.format(digest=digest)
    return page


@documentation.get("/docs/{name}")
async def docs_file(name: str) -> Response:
    """Answer GET /docs/{name}."""
    if name not in SWAGGER_FILES:
        raise NotFound("No file has this path.")
    content = files("fastapi_swagger").joinpath("resources", name).read_bytes()
    return Response(content, media_type=SWAGGER_FILES[name], headers={"Cache-Control": "max-age=86400"})


def _json(value: Any, status: int = 200) -> Response:
    return Response(orjson.dumps(value), status, media_type="application/json")
