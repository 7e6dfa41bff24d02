"""What plans the requests of batches: the service's own workers, behind the requests that somebody waits for."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from api.base.errors import DeadlineExceeded, InternalError, MemoryExceeded
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.pool.costs import Kind
from api.pool.messages import Reply, Task
from api.store.items import CHUNK_SECONDS, PLAN_ITEMS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.base.settings import Settings
    from api.pool.pool import WorkerPool
    from api.store.claims import Claimed


MOST_CHUNKED = 20
"""The most requests that go to a worker of the service together, however quick they are."""

GAIN = 0.3
"""The weight of the last request, or of the last chunk, in the measured time of a request, without unit."""


class Chunk(NamedTuple):
    """Requests of one batch that are planned one after the other.

    Attributes:
        items: The requests.
        definitions: The definitions of the added robots and scenes that they name, and their roadmaps, by digest.
    """

    items: Sequence[Claimed]
    definitions: Mapping[str, bytes]


class Planners(Protocol):
    """What plans.

    Attributes:
        chunk_size: How many requests a chunk should have.
    """

    chunk_size: int

    @property
    def at_once(self) -> int:
        """How many chunks it should be given at once: enough that it never waits for the next."""

    async def start(self) -> None:
        """Get ready, without waiting for others."""

    async def stop(self) -> None:
        """Give up the chunks under way."""

    async def plan(self, chunk: Chunk) -> list[Reply]:
        """Plan the requests of a chunk; whatever happens to one, it has a reply. Cancelling it gives the rest up.

        There may be fewer replies than requests, at least one: the rest took longer than was expected, and comes again.
        """


class ChunkSize:
    """The number of requests in a chunk, learnt from their durations.

    Args:
        seconds: The time that a chunk should take, s.
        most: The most requests of a chunk, however quick they are.
    """

    def __init__(self, seconds: float, most: int) -> None:
        self._seconds = seconds
        self._most = most
        self._mean: float | None = None

    def learn(self, seconds: float) -> int:
        """Take note of the duration of a request, s, and return the number of requests of the next chunk."""
        before = seconds if self._mean is None else self._mean
        self._mean = before + GAIN * (seconds - before)
        return max(1, min(self._most, round(self._seconds / max(self._mean, 1e-6))))


class PoolPlanners:
    """The workers of a pool, when no request wants them.

    Requests that are quick go to a worker several at a time. Handing one over costs the server a tenth of
    its plan. Where several together do not end well, each is planned by itself, so that it costs only itself.
    """

    def __init__(self, pool: WorkerPool, settings: Settings) -> None:
        self.chunk_size = 1
        self._size = ChunkSize(CHUNK_SECONDS, MOST_CHUNKED)
        self._pool = pool
        self._max_deadline = settings.max_deadline

    @property
    def at_once(self) -> int:
        """See `Planners`."""
        return 2 * self._pool.most_behind

    async def start(self) -> None:
        """See `Planners`; the pool is started by whoever made it."""

    async def stop(self) -> None:
        """See `Planners`; the callers cancel the chunks under way."""

    async def plan(self, chunk: Chunk) -> list[Reply]:
        """See `Planners`."""
        items = chunk.items[: self.chunk_size]
        replies = await self._planned(items, chunk.definitions)
        if not replies:
            return [(await self._planned([item], chunk.definitions))[0] for item in items]
        seconds = sum(map(seconds_of, replies))
        if seconds:
            self.chunk_size = self._size.learn(seconds / len(replies))
        return replies

    async def _planned(self, items: Sequence[Claimed], definitions: Mapping[str, bytes]) -> list[Reply]:
        """Plan requests in one go, within the shortest of their deadlines, which begins when a worker does.

        There may be fewer replies than requests; there are none where several together did not end well.
        """
        instance = f"/v1/batches/{items[0].batch_id}"
        arguments = {"items": [(item.request, _arguments(item, definitions)) for item in items]}
        task = Task(PLAN_ITEMS, instance, time.monotonic(), math.inf, b"", arguments)
        kind = Kind((PLAN_ITEMS,), len(items).bit_length())
        seconds = min(self._max_deadline, *(item.deadline for item in items))
        try:
            reply = await self._pool.run_behind(task, kind, seconds)
        except (DeadlineExceeded, MemoryExceeded, InternalError) as error:
            status, document = problem_document(error, instance)
            reply = Reply(status, MEDIA_TYPE, document, code=error.code)
        if reply.code is None:
            return list(reply.result)
        return [reply] if len(items) == 1 else []


def _arguments(item: Claimed, definitions: Mapping[str, bytes]) -> dict[str, Any]:
    needed = {"definition": item.robot, "scene": item.scene, "roadmap": item.roadmap}
    return {name: definitions[digest] for name, digest in needed.items() if digest is not None}


def seconds_of(reply: Reply) -> float:
    """Add up the time of a worker on a request, s; 0: it did not come to an end."""
    return sum(seconds for stage, seconds in reply.timings.items() if stage != "queue")
