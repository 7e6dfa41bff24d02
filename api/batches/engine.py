"""What works on batches: the service's own workers, behind the requests that somebody waits for."""

from __future__ import annotations

import asyncio
import math
import time
import uuid
from contextlib import suppress
from typing import TYPE_CHECKING

import orjson
import structlog

from api.batches.items import PLAN_ITEM, PLANNED, compressed
from api.database import claims
from api.database.batches import clean_up
from api.database.claims import Claimed, Outcome
from api.errors import DatabaseUnavailable, DeadlineExceeded, InternalError, MemoryExceeded, problem_document
from api.failures import where_from
from api.messages import Task
from api.server.costs import Kind

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from api.database.database import Database
    from api.server.pool import WorkerPool
    from api.settings import Settings
    from api.telemetry.metrics import Metrics

BEAT = 0.5
"""The time between two signs of life, s: a tenth of the time after which a service is taken for dead. What has been
done is written as often, so that results are seen, and no more than that is lost, within it."""

IDLE = 1.0
"""The time between two looks for items while there are none, s; another service may have taken a batch in, or died.
A batch that this service takes in is seen at once."""

AHEAD = 2.0
"""The time for which items are claimed ahead, s: the workers never wait for the database."""

MOST_CLAIMED = 500
"""The most items that are claimed at once."""

GAIN = 0.3
"""The weight of the last beat in the measured rate, without unit: some seconds count."""

CLEANING = 3600.0
"""The time between two looks for batches that have been kept for long enough, s."""

CACHED_DEFINITIONS = 16
"""The number of definitions of added robots that are kept at hand; one has up to some MB."""

log = structlog.get_logger()


class Engine:
    """The work of one service on the batches of its database.

    It claims items, has them planned by the pool, and writes what comes of them, all from the event loop. Whatever
    happens to it, the items that it had claimed are planned: by itself once the database is back, or by another one.

    Attributes:
        id: What it is called in the database.
        arriving: The number of batches that this service takes in.
    """

    def __init__(self, database: Database, pool: WorkerPool, settings: Settings, metrics: Metrics) -> None:
        self.id = uuid.uuid4().hex
        self.arriving = 0
        self._database = database
        self._pool = pool
        self._settings = settings
        self._metrics = metrics
        self._claimed: asyncio.Queue[Claimed] = asyncio.Queue()
        self._done: list[Outcome] = []
        self._under_way: dict[asyncio.Task[Outcome], int] = {}
        self._ended: set[int] = set()
        self._new = asyncio.Event()
        self._rate = 0.0
        self._definitions: dict[str, bytes] = {}
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Begin to work."""
        planners = [self._plan_item] * (2 * self._pool.most_behind)  # so many that the next ones wait at the pool
        steps = [self._claim_items, self._beat, self._clean_up, *planners]
        self._tasks = [asyncio.create_task(_repeatedly(step)) for step in steps]

    async def stop(self) -> None:
        """Stop working: what is done is written, and what has been claimed is free for others."""
        for task in [*self._tasks, *self._under_way]:
            task.cancel()
        await asyncio.gather(*self._tasks, *self._under_way, return_exceptions=True)
        try:
            await self._write_what_is_done()
            await self._database.write(claims.leave, self.id)
        except DatabaseUnavailable:
            log.warning("batches_left", reason="the database does not answer")

    def wake(self) -> None:
        """Look for items at once: there are new ones."""
        self._new.set()

    def forget(self, number: int) -> None:
        """Take a batch that has ended away from the workers."""
        self._ended.add(number)
        for planning, batch in self._under_way.items():
            if batch == number:
                planning.cancel()

    async def _claim_items(self) -> None:
        """Keep enough items at hand."""
        self._new.clear()
        wanted = min(MOST_CLAIMED, max(4 * self._pool.most_behind, math.ceil(AHEAD * self._rate)))
        found: list[Claimed] = []
        if self._claimed.qsize() <= wanted // 2:
            found = await self._database.write(claims.claim, self.id, wanted)
        for item in found:
            self._claimed.put_nowait(item)
        if not found:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._new.wait(), BEAT if self._under_way else IDLE)

    async def _plan_item(self) -> None:
        """Plan the next item."""
        item = await self._claimed.get()
        if self._claimed.qsize() < 2 * self._pool.most_behind:
            self._new.set()
        if item.batch in self._ended:
            return
        planning = asyncio.ensure_future(self._outcome_of(item))
        self._under_way[planning] = item.batch
        try:
            await asyncio.wait([planning])
        finally:
            del self._under_way[planning]
        if not planning.cancelled():
            self._done.append(planning.result())
            self._metrics.count_item(planning.result().outcome)

    async def _outcome_of(self, item: Claimed) -> Outcome:
        """Plan an item; whatever happens, something comes of it."""
        instance = f"/v1/batches/{item.batch_id}"
        arguments = {} if item.robot is None else {"definition": await self._definition(item.robot)}
        task = Task(PLAN_ITEM, instance, time.monotonic(), math.inf, item.request, arguments)
        seconds = min(item.deadline, self._settings.max_deadline)
        try:
            reply = await self._pool.run_behind(task, Kind((PLAN_ITEM, item.batch), 0), seconds)
        except (DeadlineExceeded, MemoryExceeded, InternalError) as error:
            _, document = problem_document(error, instance)
            return Outcome(item.batch, item.position, error.code, compressed(document))
        if reply.failure is not None:
            log.error("task_failed", batch=item.batch_id, position=item.position, failure=reply.failure)
        if reply.result is None:
            return Outcome(item.batch, item.position, orjson.loads(reply.body)["code"], compressed(reply.body))
        if reply.plan is not None:
            self._metrics.count_plan(reply.plan, reply.timings)
        return Outcome(item.batch, item.position, PLANNED, reply.body, *reply.result)

    async def _definition(self, digest: str) -> bytes:
        """Find the definition of an added robot."""
        while digest not in self._definitions:
            try:
                found = await self._database.read(claims.definition_of, digest)
            except DatabaseUnavailable:
                await asyncio.sleep(IDLE)
            else:
                if len(self._definitions) >= CACHED_DEFINITIONS:
                    self._definitions.clear()
                self._definitions[digest] = found
        return self._definitions[digest]

    async def _beat(self) -> None:
        """Say that this service is alive, write what it has done, and drop what others have cancelled."""
        before = time.monotonic()
        done = 0
        if self.arriving or self._under_way or self._done or not self._claimed.empty():
            await self._database.write(claims.beat, self.id)
            done = await self._write_what_is_done()
            numbers = set(self._under_way.values())
            for number in await self._database.read(claims.ended, numbers) if numbers else ():
                self.forget(number)
        await asyncio.sleep(BEAT)
        self._rate += GAIN * (done / (time.monotonic() - before) - self._rate)

    async def _write_what_is_done(self) -> int:
        """Write what has been done since the last time, and give the number of items."""
        done, self._done = self._done, []
        if done:
            try:
                await self._database.write(claims.settle, done)
            except DatabaseUnavailable:
                self._done += done
                raise
        return len(done)

    async def _clean_up(self) -> None:
        """Forget batches that have been kept for long enough."""
        await self._database.write(clean_up, time.time() - 86400.0 * self._settings.batch_retention_days)
        await asyncio.sleep(CLEANING)


async def _repeatedly(step: Callable[[], Awaitable[None]]) -> None:
    """Do a step again and again; whatever happens in one, the work goes on."""
    while True:
        try:
            await step()
        except DatabaseUnavailable:
            log.warning("batches_wait", reason="the database does not answer")
            await asyncio.sleep(IDLE)
        except Exception as error:  # noqa: BLE001 - the boundary of the work on batches
            log.error("batches_failed", failure=where_from(error))
            await asyncio.sleep(IDLE)
