"""The work on batches: requests are claimed, planned by workers or by a cluster, and their outcomes are kept."""

from __future__ import annotations

import asyncio
import math
import time
import uuid
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

import structlog

from api.base.errors import DatabaseUnavailable, InternalError
from api.base.logs import where_from
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.batches.planners import Chunk, seconds_of
from api.pool.messages import Reply
from api.store import claims
from api.store.batches import clean_up
from api.store.claims import Claimed, Outcome
from api.store.items import PLANNED, compressed

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from api.base.settings import Settings
    from api.batches.planners import Planners
    from api.store.database import Database
    from api.telemetry.metrics import Metrics

BEAT = 0.5
"""The time between two signs of life, s: a tenth of the time after which a service is taken for dead. Outcomes are
written as often, so that results are visible, and no more than these are lost, within it."""

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

MOST_TURNS = 4096
"""The number of batches of which it is known when they had a turn: many more than can be under way."""

CACHED_DEFINITIONS = 16
"""The number of definitions of added robots that are kept at hand; one has up to some MB."""

log = structlog.get_logger()


class Engine:
    """The work of one service on the batches of its database.

    It claims items, has them planned, and writes their outcomes, all from the event loop. Whatever happens to it,
    the items that it had claimed are planned: by itself once the database is back, or by another one.

    Attributes:
        id: Its name in the database.
        arriving: The number of batches that this service takes in.
    """

    def __init__(self, database: Database, planners: Planners, settings: Settings, metrics: Metrics) -> None:
        self.id = uuid.uuid4().hex
        self.arriving = 0
        self._database = database
        self._planners = planners
        self._settings = settings
        self._metrics = metrics
        self._claimed: deque[Claimed] = deque()
        self._done: list[Outcome] = []
        self._under_way: dict[asyncio.Task[None], int] = {}
        self._new = asyncio.Event()
        self._change = asyncio.Event()
        self._all_done = asyncio.Event()
        self._rate = 0.0
        self._definitions: dict[str, bytes] = {}
        self._turn = 0
        self._turns: dict[int, int] = {}
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Begin to work."""
        await self._planners.start()
        steps = [self._claim_items, self._hand_out_items, self._beat, self._clean_up]
        self._tasks = [asyncio.create_task(_repeatedly(step)) for step in steps]

    async def stop(self) -> None:
        """Stop working: write all outcomes, and release all claims."""
        for task in [*self._tasks, *self._under_way]:
            task.cancel()
        await asyncio.gather(*self._tasks, *self._under_way, return_exceptions=True)
        await self._planners.stop()
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
        self._claimed = deque(item for item in self._claimed if item.batch != number)
        for planning, batch in self._under_way.items():
            if batch == number:
                planning.cancel()

    @property
    def _wanted(self) -> int:
        """The number of items to have at hand."""
        ready = 2 * self._planners.at_once * self._planners.chunk_size
        return min(MOST_CLAIMED, max(ready, math.ceil(AHEAD * self._rate)))

    async def _claim_items(self) -> None:
        """Keep enough items at hand, and not many more: they would keep other batches from their turns."""
        self._new.clear()
        if len(self._claimed) > 2 * self._wanted:
            await self._give_back(len(self._claimed) - self._wanted)
        found: list[Claimed] = []
        if len(self._claimed) <= self._wanted // 2 and await self._database.read(claims.is_work_left):
            # Committed before the claim: who reads in between must not take this service for dead.
            await self._database.write(claims.beat, self.id)
            found = await self._database.write(claims.claim, self.id, self._wanted, self._turns)
            self._note_turns(found)
        self._claimed += found
        self._change.set()
        if not found:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._new.wait(), BEAT if self._under_way else IDLE)

    async def _give_back(self, count: int) -> None:
        """Free the last claimed items: they were claimed while items took less time."""
        surplus = [self._claimed.pop() for _ in range(count)]
        try:
            await self._database.write(claims.give_back, self.id, surplus)
        except DatabaseUnavailable:
            self._claimed.extend(reversed(surplus))
            raise

    def _note_turns(self, found: list[Claimed]) -> None:
        """Note which batches had a turn, and forget batches without a turn for long."""
        if not found:
            return
        self._turn += 1
        self._turns |= dict.fromkeys((item.batch for item in found), self._turn)
        if len(self._turns) > MOST_TURNS:
            self._turns = {number: turn for number, turn in self._turns.items() if turn > self._turn - MOST_TURNS // 2}

    async def _hand_out_items(self) -> None:
        """Hand out the next items, unless enough are under way."""
        self._change.clear()
        chunk = self._next_chunk() if len(self._under_way) < self._planners.at_once else []
        if not chunk:
            await self._change.wait()
            return
        planning = asyncio.create_task(self._plan(chunk))
        self._under_way[planning] = chunk[0].batch
        planning.add_done_callback(self._note_end)
        if len(self._claimed) <= self._wanted // 2:
            self._new.set()

    def _next_chunk(self) -> list[Claimed]:
        """Take items of one batch, as many as a chunk should have."""
        chunk: list[Claimed] = []
        while self._claimed and len(chunk) < self._planners.chunk_size:
            if chunk and self._claimed[0].batch != chunk[0].batch:
                break
            chunk.append(self._claimed.popleft())
        return chunk

    def _note_end(self, planning: asyncio.Task[None]) -> None:
        del self._under_way[planning]
        self._change.set()
        if not self._under_way and not self._claimed:
            self._all_done.set()

    async def _plan(self, items: list[Claimed]) -> None:
        """Plan items; whatever happens, something comes of each, or it is at hand again."""
        needed = {digest for item in items for digest in (item.robot, item.scene, item.roadmap) if digest is not None}
        definitions = {digest: await self._definition(digest) for digest in needed}
        try:
            replies = await self._planners.plan(Chunk(items, definitions))
        except Exception as error:  # noqa: BLE001 - nobody foresaw it
            log.error("batches_failed", failure=where_from(error))
            failed = InternalError()
            status, document = problem_document(failed, f"/v1/batches/{items[0].batch_id}")
            replies = [Reply(status, MEDIA_TYPE, document, code=failed.code)] * len(items)
        self._done += [self._outcome(item, reply) for item, reply in zip(items, replies, strict=False)]
        self._claimed.extendleft(reversed(items[len(replies) :]))

    def _outcome(self, item: Claimed, reply: Reply) -> Outcome:
        """Take note of what came of an item."""
        self._metrics.count_item(reply.code or PLANNED)
        if reply.failure is not None:
            log.error("task_failed", batch=item.batch_id, position=item.position, failure=reply.failure)
        seconds = seconds_of(reply) or None
        if reply.code is not None:
            return Outcome(item.batch, item.position, reply.code, compressed(reply.body), seconds=seconds)
        if reply.plan is not None:
            self._metrics.count_plan(reply.plan, reply.timings)
        duration, ratio = reply.result
        return Outcome(item.batch, item.position, PLANNED, reply.body, duration, ratio, seconds)

    async def _definition(self, digest: str) -> bytes:
        """Find the definition of an added robot or scene, or a roadmap."""
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
        """Write a heartbeat and all outcomes, and drop the items that others have cancelled."""
        before = time.monotonic()
        done = 0
        if self.arriving or self._under_way or self._done or self._claimed:
            await self._database.write(claims.beat, self.id)
            done = await self._write_what_is_done()
            numbers = set(self._under_way.values())
            for number in await self._database.read(claims.ended, numbers) if numbers else ():
                self.forget(number)
        with suppress(TimeoutError):  # the end of a batch need not wait for the next beat
            await asyncio.wait_for(self._all_done.wait(), BEAT)
        self._all_done.clear()
        latest = done / max(BEAT, time.monotonic() - before)
        self._rate = min(latest, self._rate + GAIN * (latest - self._rate))  # slower items keep others waiting at once

    async def _write_what_is_done(self) -> int:
        """Write the outcomes since the last call, and return their number."""
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
