"""Trace contexts (W3C), and spans of requests and their stages for an OpenTelemetry collector."""

from __future__ import annotations

import re
import secrets
import time
from http import HTTPStatus
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from opentelemetry.trace import Span

TRACEPARENT = re.compile(r"(?!ff)[0-9a-f]{2}-(?!0{32})([0-9a-f]{32})-(?!0{16})([0-9a-f]{16})-([0-9a-f]{2})(-.*)?")
"""The header by which a caller says what its request is a part of: version, trace, parent and flags."""

NANOSECONDS = 1e9
"""The nanoseconds of a second."""

SENDING_TIMEOUT = 5_000
"""The time for which the last spans are still sent when the service stops, ms."""


class TraceContext(NamedTuple):
    """The trace that a request belongs to.

    Attributes:
        trace_id: The id of the trace, 32 hexadecimal digits.
        parent_id: The id of the caller's span, 16 hexadecimal digits; None: the trace begins here.
        flags: Whether the caller records the trace (1) or not (0).
    """

    trace_id: str
    parent_id: str | None = None
    flags: int = 1


class Outcome(NamedTuple):
    """What came of a request.

    Attributes:
        method: Its HTTP method.
        route: Its path with parameters in braces; None: there is no such path.
        status: The HTTP status of the answer.
        code: The code of the problem document; None: there is none.
        submitted: The time from its arrival until a worker got it, s; None: none did.
        stages: The seconds that each stage took, one after the other from then on.
    """

    method: str
    route: str | None
    status: int
    code: str | None
    submitted: float | None
    stages: Mapping[str, float]


def trace_context(traceparent: str | None) -> TraceContext:
    """Read the header `traceparent`, or begin a trace."""
    found = TRACEPARENT.fullmatch(traceparent or "")
    if found is None:
        return TraceContext(secrets.token_hex(16))
    return TraceContext(found[1], found[2], int(found[3], 16) & 1)


class Traces:
    """Sends a span for each request, with one for each of its stages, to a collector.

    Args:
        endpoint: Where the collector takes OTLP over HTTP, as in `http://127.0.0.1:4318`.

    Raises:
        ImportError: The extra `otel` is not installed.
    """

    def __init__(self, endpoint: str) -> None:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor

        self._provider = TracerProvider(resource=Resource.create({"service.name": "trajectory-planner"}))
        self._provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(f"{endpoint.rstrip('/')}/v1/traces")))
        self._tracer = self._provider.get_tracer("planner")

    def begin(self, context: TraceContext) -> tuple[Span, TraceContext]:
        """Begin the span of a request, and give the context that it is in now."""
        from opentelemetry import trace
        from opentelemetry.context import Context

        parent = Context()
        if context.parent_id is not None:
            flags = trace.TraceFlags(context.flags)
            caller = trace.SpanContext(int(context.trace_id, 16), int(context.parent_id, 16), True, flags)
            parent = trace.set_span_in_context(trace.NonRecordingSpan(caller))
        span = self._tracer.start_span("request", parent, trace.SpanKind.SERVER)
        return span, context._replace(trace_id=f"{span.get_span_context().trace_id:032x}")

    def end(self, span: Span, outcome: Outcome, seconds: float) -> None:
        """End the span of a request that took so long, s."""
        from opentelemetry import trace

        ended = time.time_ns()
        span.update_name(f"{outcome.method} {outcome.route or ''}".strip())
        span.set_attribute("http.request.method", outcome.method)
        span.set_attribute("http.response.status_code", outcome.status)
        if outcome.route is not None:
            span.set_attribute("http.route", outcome.route)
        if outcome.code is not None:
            span.set_attribute("error.type", outcome.code)
        if outcome.status >= HTTPStatus.INTERNAL_SERVER_ERROR:
            span.set_status(trace.StatusCode.ERROR)
        begun = ended - int(NANOSECONDS * (seconds - (outcome.submitted or 0.0)))
        for name, stage_seconds in outcome.stages.items():
            stage = self._tracer.start_span(name, trace.set_span_in_context(span), start_time=begun)
            begun += int(NANOSECONDS * stage_seconds)
            stage.end(begun)
        span.end(ended)

    def close(self) -> None:
        """Send the spans that were not sent yet."""
        self._provider.force_flush(SENDING_TIMEOUT)
        self._provider.shutdown()
