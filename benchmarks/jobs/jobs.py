"""The corpus of real jobs through every back end: plans, refusals, crashes and slow jobs."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import time
import traceback
import warnings
from typing import TYPE_CHECKING, Any

from api.pool.worker import NUMERIC_THREADS
from benchmarks.corpus.checks import keeps_promises
from benchmarks.corpus.corpus import job, plan_job
from planner.errors import PlanningError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from multiprocessing.connection import Connection

MOST_SECONDS = 20.0
"""Processor time, s, after which a plan is given up."""

PATIENCE = 6.0
"""So many times as long, by the clock on the wall, until a worker that does not answer is killed."""

MEMORY = 1024 * 2**20
"""Bytes of private memory that a worker may allocate; the service's default."""


class OutOfTime(BaseException):
    """A plan has taken too much processor time."""


def measure(jobs: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """Return records of jobs by name and back end, from a worker process, replaced when it dies or hangs."""
    worker = Worker()
    records = [worker.plan(name, kind) for name, kinds in jobs.items() for kind in kinds]
    worker.stop()
    return records


class Worker:
    """A process that plans; replaced when it dies or hangs."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._start()

    def plan(self, name: str, kind: str) -> dict[str, Any]:
        """Return the record of one job by one back end."""
        outcome = "died"
        try:
            self._channel.send((name, kind))
            if self._channel.poll(PATIENCE * MOST_SECONDS):
                answer: dict[str, Any] = self._channel.recv()
                return answer
            outcome = "hung"
        except (EOFError, ConnectionError):
            self.process.join()
        self.stop()
        code = self.process.exitcode
        self._start()
        return {"job": name, "backend": kind, "outcome": outcome, "message": f"exit code {code}"}

    def stop(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()

    def _start(self) -> None:
        os.environ.update(dict.fromkeys(NUMERIC_THREADS, "1"))  # the new process inherits them
        self._channel, other = self._context.Pipe()
        self.process = self._context.Process(target=_work, args=(other,), daemon=True)
        self.process.start()
        other.close()


def _work(channel: Connection) -> None:
    signal.signal(signal.SIGPROF, _out_of_time)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    while True:
        channel.send(record(*channel.recv()))


def _out_of_time(*_: object) -> None:
    raise OutOfTime


def record(name: str, kind: str) -> dict[str, Any]:
    """Plan one job by one back end, in this process, and say what came of it."""
    asked = job(name)
    result: dict[str, Any] = {"job": name, "backend": kind, "waypoints": len(asked.problem.waypoints)}
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always")
            plan = plan_job(asked, kind)
    except OutOfTime:
        return result | {"outcome": "out_of_time", "seconds": time.process_time() - start}
    except PlanningError as refusal:
        seconds = time.process_time() - start
        return result | {"outcome": "refused", "code": refusal.code, "message": refusal.message, "seconds": seconds}
    except Exception as error:  # noqa: BLE001 - whatever it is, it is recorded
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({where.filename.rpartition('/')[2]}:{where.lineno})"
        return result | {"outcome": "crashed", "message": message, "seconds": time.process_time() - start}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    result |= {
        "outcome": "planned",
        "seconds": time.process_time() - start,
        "duration": plan.trajectory.duration,
        "pieces": len(plan.trajectory.lengths),
        "warnings": [[warning.code, warning.message] for warning in plan.warnings],
        "raised": [f"{it.category.__name__}: {it.message} ({it.filename}:{it.lineno})" for it in raised],
    }
    try:
        keeps_promises(plan, kind)
    except AssertionError as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        result["broken"] = str(error) or f"{where.name}: {where.line}"
    return result
