"""Slow requests, and a batch long enough to be interrupted halfway, with its results without an interruption."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.api.conftest import RunningService, running_service, wait_until
from tests.api.requests import joint, plan_request
from tests.sizes import NAME

ITEMS = 2000 if NAME == "soak" else 1200
SLOW = {"robot": "kuka_kr16_2", "backend": {"kind": "min_effort"}, "deadline": 60.0}
"""Fields of a request that takes a second or more."""

BATCHES = "/v1/batches"


def slow_requests(count: int) -> list[dict[str, Any]]:
    """Return distinct requests that take a second or more each."""
    ends = [[0.5 + 0.01 * k, -1.0, 1.2, 0.3, 0.5, 0.1] for k in range(count)]
    return [SLOW | {"waypoints": [joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), joint(*end)]} for end in ends]


def requests(count: int) -> list[dict[str, Any]]:
    return [
        plan_request(
            waypoints=[joint(0.1, 0.2, 0.3), joint(0.3 + 1e-4 * k, 0.1, 0.5)],
            backend={"kind": ("cubic", "quintic", "ruckig")[k % 3]},
            sample_period=0.5,
        )
        for k in range(count)
    ]


def sent(service: RunningService, asked: list[dict[str, Any]]) -> str:
    made = service.post(BATCHES, {"requests": asked})
    assert made.status_code == 202, made.text
    location: str = made.headers["Location"]
    return location


def finished(service: RunningService, location: str) -> int:
    counts = service.client.get(location).json()["counts"]
    return int(counts["total"] - counts["waiting"])


def wait_for(service: RunningService, location: str, count: float) -> None:
    """Wait until a batch has more answers than a given number."""
    wait_until(lambda: finished(service, location) > count, 60.0)


def results(service: RunningService, location: str) -> list[Any]:
    """Return all results of a completed batch, each once and in the order of the requests."""
    wait_until(lambda: service.client.get(location).json()["status"] == "completed", 180.0)
    found = [json.loads(line) for line in service.client.get(f"{location}/results.ndjson").content.splitlines()]
    assert [result["index"] for result in found] == list(range(len(found)))
    return found


@cache
def undisturbed() -> list[Any]:
    """Return the results of the batch on the service's own workers without an interruption."""
    with TemporaryDirectory() as folder, running_service(Path(folder) / "log.jsonl") as service:
        return results(service, sent(service, requests(ITEMS)))
