"""Telemetry of the service: metrics, trace ids in the log, and traces sent to a collector."""

from __future__ import annotations

import gzip
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from prometheus_client.parser import text_string_to_metric_families

from api.telemetry.traces import trace_id_of
from tests.api.conftest import RunningService, wait_until
from tests.api.made_up_service import made_up_service
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

TRACE = "0af7651916cd43dd8448eb211c80319c"
CALLER = "b7ad6b7169203331"


def metrics_of(client: httpx.Client) -> dict[tuple[str, ...], float]:
    """Read every sample with Prometheus' own parser, by name and label values in the order of the label names."""
    answer = client.get("/metrics")
    assert answer.status_code == 200 and answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    families = text_string_to_metric_families(answer.text)
    return {
        (sample.name, *(value for _, value in sorted(sample.labels.items()))): sample.value
        for family in families
        for sample in family.samples
    }


def test_what_happens_is_counted() -> None:
    with made_up_service() as client:
        before = metrics_of(client)
        plan = client.post("/v1/trajectories", json=plan_request()).json()
        client.post("/v1/trajectories", json=plan_request(robot="nobody"))
        client.post("/v1/trajectories", content=b"{", headers={"Content-Type": "application/json"})
        client.get("/nowhere")
        made = client.post("/v1/batches", json={"requests": [plan_request(), plan_request(waypoints=[])]})
        wait_until(lambda: client.get(made.headers["Location"]).json()["status"] == "completed")
        after = metrics_of(client)

    def more(*name: str) -> float:
        return after[name] - before.get(name, 0.0)

    assert more("planner_requests_total", "plan_trajectory", "200") == 1
    assert more("planner_requests_total", "plan_trajectory", "404") == 1
    assert more("planner_requests_total", "plan_trajectory", "422") == 1
    assert more("planner_requests_total", "none", "404") == 1
    assert more("planner_refusals_total", "unknown_robot", "plan_trajectory") == 1
    assert more("planner_refusals_total", "invalid_request", "plan_trajectory") == 1
    assert more("planner_refusals_total", "not_found", "none") == 1
    assert more("planner_request_duration_seconds_count", "plan_trajectory") == 3
    assert more("planner_batch_items_total", "planned") == more("planner_batch_items_total", "invalid_request") == 1
    for stage in ("validate", "plan", "serialise"):
        assert more("planner_stage_duration_seconds_count", "cubic", stage) == 2  # a request's and an item's
    ratio = max(check["ratio"] for check in plan["certificate"]["checks"] if check["quantity"] == "velocity")
    assert more("planner_certificate_ratio_sum", "cubic", "velocity") == pytest.approx(2.0 * ratio)
    assert (after["planner_batches_running",], after["planner_batch_items_waiting",]) == (0, 0)


def test_workers_and_what_waits_for_them_are_told(service: RunningService) -> None:
    found = metrics_of(service.client)
    states = {name[2]: value for name, value in found.items() if name[0] == "planner_workers"}
    assert sum(states.values()) == 2 and states["idle"] >= 1
    assert found["planner_queue_jobs", "requests"] == found["planner_queue_jobs", "batches"] == 0
    assert found["planner_workers_ended_total",] >= 0


@pytest.mark.parametrize(
    ("header", "known"),
    [
        (f"00-{TRACE}-{CALLER}-01", True),
        (f"00-{TRACE}-{CALLER}-00", True),
        (f"01-{TRACE}-{CALLER}-01-what-comes-later", True),
        ("", False),
        (f"ff-{TRACE}-{CALLER}-01", False),
        (f"00-{'0' * 32}-{CALLER}-01", False),
        (f"00-{TRACE}-{'0' * 16}-01", False),
        (f"00-{TRACE.upper()}-{CALLER}-01", False),
        (f'00-{TRACE}-{CALLER}-01"\n', False),
    ],
)
def test_a_trace_goes_on_or_begins(header: str, known: bool) -> None:
    """The rules of https://www.w3.org/TR/trace-context/#traceparent-header."""
    trace_id = trace_id_of(header)
    assert (trace_id == TRACE) == known
    assert len(trace_id) == 32 and trace_id != "0" * 32


def test_lines_of_the_log_have_the_trace(service: RunningService) -> None:
    headers = {"traceparent": f"00-{TRACE}-{CALLER}-01", "X-Request-ID": "of-a-traced-request"}
    service.client.get("/v1/limits", headers=headers)
    service.client.get("/v1/limits", headers={"X-Request-ID": "of-another-request"})
    assert service.line_of("of-a-traced-request")["trace_id"] == TRACE
    another = service.line_of("of-another-request")["trace_id"]
    assert another not in (TRACE, "") and len(another) == 32


class Collector(ThreadingHTTPServer):
    """What takes OTLP over HTTP."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Receiver)
        self.spans: list[Any] = []


class Receiver(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        if self.headers.get("Content-Encoding") == "gzip":
            body = gzip.decompress(body)
        assert self.path == "/v1/traces"
        received = ExportTraceServiceRequest.FromString(body)
        assert isinstance(self.server, Collector)
        for resource in received.resource_spans:
            self.server.spans += [span for scope in resource.scope_spans for span in scope.spans]
        self.send_response(200)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None: ...


@pytest.fixture
def collector() -> Iterator[Collector]:
    with Collector() as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_a_collector_gets_a_trace_of_each_request(collector: Collector) -> None:
    """A real one would take the same bytes: they are read by the protocol's own schema."""
    with made_up_service(otlp_endpoint=f"http://127.0.0.1:{collector.server_port}") as client:
        client.post("/v1/trajectories", json=plan_request(), headers={"traceparent": f"00-{TRACE}-{CALLER}-01"})
        client.post("/v1/trajectories", json=plan_request(robot="nobody"))
        client.get("/livez", headers={"traceparent": f"00-{TRACE}-{CALLER}-00"})  # which its caller does not record
    by_name: dict[str, list[Any]] = {}
    for span in collector.spans:
        by_name.setdefault(span.name, []).append(span)
    planned, refused = sorted(by_name["POST /v1/trajectories"], key=lambda span: span.start_time_unix_nano)
    assert "GET /livez" not in by_name
    assert (planned.trace_id.hex(), planned.parent_span_id.hex()) == (TRACE, CALLER)
    assert refused.trace_id != planned.trace_id and not refused.parent_span_id
    told = {"http.request.method": "POST", "http.route": "/v1/trajectories", "http.response.status_code": "200"}
    assert told.items() <= attributes(planned).items()
    assert "planner.code" not in attributes(planned) and attributes(refused)["planner.code"] == "unknown_robot"
    stages = [span for name in ("queue", "validate", "plan", "serialise") for span in by_name[name]]
    of_the_plan = [span for span in stages if span.parent_span_id == planned.span_id]
    assert [span.name for span in of_the_plan] == ["queue", "validate", "plan", "serialise"]
    for before, after in pairwise(of_the_plan):
        assert before.end_time_unix_nano == after.start_time_unix_nano
    assert planned.start_time_unix_nano <= of_the_plan[0].start_time_unix_nano
    assert of_the_plan[-1].end_time_unix_nano <= planned.end_time_unix_nano


def attributes(span: Any) -> dict[str, str]:
    return {each.key: each.value.string_value or str(each.value.int_value) for each in span.attributes}


def test_every_metric_says_what_it_is() -> None:
    with made_up_service() as client:
        families = list(text_string_to_metric_families(client.get("/metrics").text))
    assert len(families) > 10
    assert not [family.name for family in families if not family.documentation.endswith(".")]
    assert all(family.name.startswith("planner_") for family in families)
