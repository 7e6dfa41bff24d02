"""The service itself: its caps, and whether it is alive and ready. The server answers these without a worker."""

from __future__ import annotations

from api.schemas import service
from api.tasks.operation import Operation

OPERATIONS = (
    Operation(
        id="get_limits",
        method="GET",
        path="/v1/limits",
        tag="service",
        summary="The caps of the service.",
        description="How large requests may be, how many wait, and how long they may take.",
        answer=service.ServiceLimits,
    ),
    Operation(
        id="get_liveness",
        method="GET",
        path="/livez",
        tag="service",
        scope=None,
        summary="Whether the process answers.",
        description="It is answered by the server itself, whatever the workers do.",
        answer=service.Liveness,
    ),
    Operation(
        id="get_readiness",
        method="GET",
        path="/readyz",
        tag="service",
        scope=None,
        summary="Whether the workers are warm: each has planned once with every back end.",
        description="Load balancers send requests to a service that is ready.",
        answer=service.Readiness,
        also={503: "Not yet."},
    ),
    Operation(
        id="get_metrics",
        method="GET",
        path="/metrics",
        tag="service",
        scope="admin",
        summary="What the service counts and measures, in Prometheus' text format.",
        description="Requests, latencies, refusals, workers, what waits for them, and batches.",
        answer=str,
        codes=("database_unavailable",),
        media_type="text/plain",
    ),
)
"""What there is about the service itself."""
