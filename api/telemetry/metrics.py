"""The counters and measurements of the service, as Prometheus reads them."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Literal

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from prometheus_client.metrics import MetricWrapperBase
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.registry import Collector
from typing_extensions import override

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from prometheus_client import Metric

    from api.base.byte_budget import Traffic
    from api.pool.messages import PlanFigures
    from api.pool.pool import WorkerPool

MEDIA_TYPE = CONTENT_TYPE_PLAIN_0_0_4
"""The media type of the answer: Prometheus' text format."""

SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
"""The bounds between which durations are counted, s: from an answer without a worker to the longest deadline."""

RATIOS = (0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0)
"""The bounds between which shares of limits are counted, without unit: 1 is all of a limit, more would be a fault."""


class Metrics:
    """The metrics of one service."""

    def __init__(self) -> None:
        registry = self._registry = CollectorRegistry()
        self._requests = Counter(
            "planner_requests", "Requests that were answered.", ["operation", "status"], registry=registry
        )
        self._durations = Histogram(
            "planner_request_duration_seconds",
            "Time from the head of a request to the end of its answer.",
            ["operation"],
            buckets=SECONDS,
            registry=registry,
        )
        self._stages = Histogram(
            "planner_stage_duration_seconds",
            "Time that a plan took in each stage, as in the header Server-Timing.",
            ["stage", "backend"],
            buckets=SECONDS,
            registry=registry,
        )
        self._refusals = Counter(
            "planner_refusals", "Problem documents, by their code.", ["operation", "code"], registry=registry
        )
        self._ratios = Histogram(
            "planner_certificate_ratio",
            "Largest share of an enforced limit that a plan uses, by quantity.",
            ["quantity", "backend"],
            buckets=RATIOS,
            registry=registry,
        )
        self._shared = Counter(
            "planner_shared_answers",
            "Answers that needed no computing: one was kept, joined under way, or not modified.",
            ["how"],
            registry=registry,
        )
        self._items = Counter(
            "planner_batch_items", "Requests of batches that this service has answered.", ["outcome"], registry=registry
        )
        self._labelled = cache(MetricWrapperBase.labels)  # to look one up takes as long as to count in it
        self._running = Gauge("planner_batches_running", "Batches with requests left to plan.", registry=registry)
        self._waiting = Gauge("planner_batch_items_waiting", "Requests of batches left to plan.", registry=registry)

    def watch(self, pool: WorkerPool, traffic: Traffic) -> None:
        """Tell of the workers and of what waits for them, too."""
        self._registry.register(_Workers(pool, traffic))

    def count_request(self, operation: str, status: int, seconds: float, code: str | None) -> None:
        """Count a request that was answered, with a problem of this code if there is one."""
        self._labelled(self._requests, operation, str(status)).inc()
        self._labelled(self._durations, operation).observe(seconds)
        if code is not None:
            self._refusals.labels(operation, code).inc()

    def count_refused_connection(self, code: str) -> None:
        """Count a connection that was refused before there was a request."""
        self._refusals.labels("connection", code).inc()

    def count_plan(self, plan: PlanFigures, timings: Mapping[str, float]) -> None:
        """Count a plan, its stages (s) and the shares of limits that it uses."""
        for stage, seconds in timings.items():
            self._labelled(self._stages, stage, plan.backend).observe(seconds)
        for quantity, ratio in plan.ratios.items():
            self._labelled(self._ratios, quantity, plan.backend).observe(ratio)

    def count_shared(self, how: Literal["kept", "joined", "not_modified"]) -> None:
        """Count an answer that needed no computing."""
        self._shared.labels(how).inc()

    def count_item(self, outcome: str) -> None:
        """Count a request of a batch, by what came of it."""
        self._items.labels(outcome).inc()

    def set_batches(self, running: int, waiting: int) -> None:
        """Note how many batches have work left, and how many requests that is."""
        self._running.set(running)
        self._waiting.set(waiting)

    def as_text(self) -> bytes:
        """Write all metrics."""
        return generate_latest(self._registry)


class _Workers(Collector):
    """Values that are looked up when Prometheus reads them."""

    def __init__(self, pool: WorkerPool, traffic: Traffic) -> None:
        self._pool = pool
        self._traffic = traffic

    @override
    def collect(self) -> Iterator[Metric]:
        """Look it up."""
        workers = GaugeMetricFamily("planner_workers", "Worker processes, by what they do.", labels=["lane", "state"])
        for (lane, state), count in sorted(self._pool.states().items()):
            workers.add_metric([lane, state], count)
        yield workers
        ended = CounterMetricFamily("planner_workers_ended", "Worker processes that ended and were replaced.")
        ended.add_metric([], self._pool.ended)
        yield ended
        waiting = GaugeMetricFamily("planner_queue_jobs", "What waits for a worker.", labels=["lane"])
        for lane, count in self._pool.waiting().items():
            waiting.add_metric([lane], count)
        yield waiting
        yield GaugeMetricFamily("planner_bytes_in_flight", "Bodies and answers in memory.", self._traffic.held)
