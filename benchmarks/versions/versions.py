"""Two versions side by side: the same requests to the service of another checkout and to that of this one.

The HTTP interface is the contract between versions, so each runs its whole service, with one worker. The requests go to
both by turns. Times are the processor time of the worker for a request, which depends little on other programs. The
time of a request is the median of its repetitions. The first one does not count, because it fills caches.
"""

from __future__ import annotations

import http.client
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np
import orjson
import psutil

from benchmarks.checkouts import HERE, NAMES, SLOWER, checkout_of
from benchmarks.machine import machine
from benchmarks.service.processes import workers_of
from benchmarks.versions.requests import kinds, uploads
from cli.local_service import local_service

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.versions.requests import Kind
    from planner.spatial import FloatArray

LEAST_ROUNDS = 3
"""The least number of times that each request of a kind is repeated."""

CHANGED = 1e-6
"""Relative difference of costs above which an answer counts as changed."""

HEADERS = {"Content-Type": "application/json", "Cache-Control": "no-cache"}


class Version:
    """The service of one checkout, with one worker."""

    def __init__(self, checkout: Path, log: Path, stack: ExitStack) -> None:
        url, service = stack.enter_context(local_service(log, workers=1, checkout=checkout))
        self._service = psutil.Process(service.pid)
        self._connection = http.client.HTTPConnection(urlsplit(url).netloc)
        for body in uploads():
            status, answer = self._post("/v1/robots", body)
            if status != 201:
                raise RuntimeError(f"the service of {checkout} answered {answer.decode()}")

    def ask(self, path: str, body: bytes) -> tuple[float, bytes | None]:
        """Send a request: the processor time that it took the worker, s, and the answer; None: it was refused."""
        workers = workers_of(self._service)  # one, and one for cheap requests
        clocks = [_clock_of(worker.pid) for worker in workers]
        start = sum(map(time.clock_gettime, clocks))
        status, answer = self._post(path, body)
        # A request that was killed at its deadline took the worker with it.
        alive = all(worker.is_running() for worker in workers)
        spent = sum(map(time.clock_gettime, clocks)) - start if alive else np.inf
        return spent, answer if status == 200 else None

    def _post(self, path: str, body: bytes) -> tuple[int, bytes]:
        """Send each request on its own connection: the service ends one that is idle while the other version works.

        Its answer is computed for every request.
        """
        with closing(self._connection):
            self._connection.request("POST", path, body, HEADERS)
            response = self._connection.getresponse()
            return response.status, response.read()


def measure(beside: str, seconds: float, only: Sequence[str] = ()) -> dict[str, Any]:
    """Return the ratios of times and costs of every kind of request.

    Args:
        beside: The other version: the folder of a checkout, or a commit.
        seconds: Time for repeating the requests of a kind; they are repeated at least three times.
        only: Words that a kind's name has to contain, all of them.
    """
    where = machine()
    chosen = [kind for kind in kinds() if all(word in kind.name for word in only)]
    with tempfile.TemporaryDirectory() as folder, checkout_of(beside) as other, ExitStack() as stack:
        versions = [
            Version(checkout, Path(folder, name), stack) for name, checkout in zip(NAMES, (other, HERE), strict=True)
        ]
        rows = [compare(kind, versions, seconds) for kind in chosen]
    slower = [row["name"] for row in rows if row["time"] is not None and row["time"]["p50"] > SLOWER]
    return {"machine": where, "slower": slower, "kinds": rows}


def compare(kind: Kind, versions: Sequence[Version], seconds: float) -> dict[str, Any]:
    """Return the figures of one kind: times in s, and now's as multiples of before's."""
    answers = [[version.ask(kind.path, body)[1] for version in versions] for body in kind.bodies]
    answered = [i for i, pair in enumerate(answers) if None not in pair]
    rounds: list[list[list[float]]] = []
    end = time.monotonic() + seconds
    while answered and (len(rounds) < LEAST_ROUNDS or time.monotonic() < end):
        order = (0, 1) if len(rounds) % 2 else (1, 0)
        rounds.append([_by_turns(kind, i, versions, order) for i in answered])
    refused = {name: sum(pair[k] is None for pair in answers) for k, name in enumerate(NAMES)}
    row: dict[str, Any] = {"name": kind.name, "requests": len(kind.bodies), "rounds": len(rounds), "refused": refused}
    if not answered:
        return row | {"times": None, "time": None, "cost": None, "changed": 0}
    times = np.median(rounds, axis=0)
    costs = np.array([[_cost(kind, i, answer) for answer in answers[i]] for i in answered])
    slowed, grown = _ratios(times), _ratios(costs)
    return row | {
        "times": dict(zip(NAMES, np.median(times, axis=0).tolist(), strict=True)),
        "time": dict(zip(("p50", "p99", "worst"), np.quantile(slowed, (0.5, 0.99, 1.0)).tolist(), strict=True)),
        "cost": dict(zip(("least", "p50", "most"), np.quantile(grown, (0.0, 0.5, 1.0)).tolist(), strict=True)),
        "changed": int((np.abs(grown - 1.0) > CHANGED).sum()),
    }


def _by_turns(kind: Kind, i: int, versions: Sequence[Version], order: tuple[int, int]) -> list[float]:
    times = [0.0, 0.0]
    for k in order:
        times[k] = versions[k].ask(kind.path, kind.bodies[i])[0]
    return times


def _cost(kind: Kind, i: int, answer: bytes | None) -> float:
    return kind.cost(orjson.loads(kind.bodies[i]), orjson.loads(answer or b""))


def _ratios(pairs: FloatArray) -> FloatArray:
    """Return now's values (N,) as multiples of before's, of pairs (N, 2); 1 where both are zero."""
    before, now = pairs.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(before == now, 1.0, now / before)


def _clock_of(pid: int) -> int:
    """Return the clock of the processor time of a process, ns exact (Linux: the inverted id, then the kind, 2)."""
    return (~pid << 3) | 2
