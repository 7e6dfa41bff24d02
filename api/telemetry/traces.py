"""Traces (W3C, OpenTelemetry): FastAPI makes a span of each request, and the service one of each of its stages."""

from __future__ import annotations

import secrets
import time
from typing import TYPE_CHECKING

from opentelemetry import trace
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fastapi.telemetry import TelemetryConfig
    from opentelemetry.sdk.trace import TracerProvider

NANOSECONDS = 1e9
"""The nanoseconds of a second."""

SENDING_TIMEOUT = 5_000
"""The time for which the last spans are still sent when the service stops, ms."""

W3C = TraceContextTextMapPropagator()
"""What reads the header `traceparent`."""


def trace_id_of(traceparent: str) -> str:
    """Find the trace of a request, 32 hexadecimal digits: of its span or its header, or a new one."""
    context = trace.get_current_span().get_span_context()
    if traceparent and not context.is_valid:
        context = trace.get_current_span(W3C.extract({"traceparent": traceparent})).get_span_context()
    return f"{context.trace_id:032x}" if context.is_valid else secrets.token_hex(16)


class Traces:
    """Sends a span for each request, with one for each of its stages, to a collector.

    Args:
        endpoint: Where the collector takes OTLP over HTTP, as in `http://127.0.0.1:4318`; None: there is none.

    Raises:
        ImportError: The extra `otel` is not installed.
    """

    def __init__(self, endpoint: str | None) -> None:
        self._provider = None if endpoint is None else _provider(endpoint)

    @property
    def of_fastapi(self) -> TelemetryConfig:
        """The configuration by which FastAPI makes the spans of requests, and nothing else."""
        own = self._provider
        return {
            "tracer_provider": own,
            "tracing": own is not None,
            "operation_spans": False,
            "metrics": False,
            "logs": False,
        }

    def note(self, code: str | None, stages: Mapping[str, float], seconds: float) -> None:
        """Add to the span of the request what came of it, before the answer is sent.

        Args:
            code: The code of the problem document; None: there is none.
            stages: The seconds that each stage took, one after the other.
            seconds: The time since the first stage began, s.
        """
        if self._provider is None:
            return
        if code is not None:
            trace.get_current_span().set_attribute("planner.code", code)
        begun, tracer = time.time_ns() - int(NANOSECONDS * seconds), self._provider.get_tracer("planner")
        for name, stage_seconds in stages.items():
            stage = tracer.start_span(name, start_time=begun)
            begun += int(NANOSECONDS * stage_seconds)
            stage.end(begun)

    def close(self) -> None:
        """Send the spans that were not sent yet."""
        if self._provider is not None:
            self._provider.force_flush(SENDING_TIMEOUT)
            self._provider.shutdown()


def _provider(endpoint: str) -> TracerProvider:
    """Make what sends spans to a collector."""
    from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
    from opentelemetry.sdk.resources import Resource
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.sdk.trace.export import BatchSpanProcessor

    provider = TracerProvider(resource=Resource.create({"service.name": "trajectory-planner"}))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(f"{endpoint.rstrip('/')}/v1/traces")))
    return provider
