"""What plans the requests of batches: the service's own workers, behind the requests that somebody waits for."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, NamedTuple, Protocol

from api.batches.items import PLAN_ITEM
from api.errors import MEDIA_TYPE, DeadlineExceeded, InternalError, MemoryExceeded, problem_document
from api.messages import Reply, Task
from api.server.costs import Kind

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.database.claims import Claimed
    from api.server.pool import WorkerPool
    from api.settings import Settings


class Chunk(NamedTuple):
    """Requests of one batch that are planned one after the other.

    Attributes:
        items: The requests.
        definitions: The definitions of the added robots that they name, by digest.
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
        """Give up what is under way."""

    async def plan(self, chunk: Chunk) -> list[Reply]:
        """Plan the requests of a chunk; whatever happens to one, it has a reply. Cancelling it gives the rest up."""


class PoolPlanners:
    """The workers of a pool, when no request wants them: one request at a time each."""

    chunk_size = 1

    def __init__(self, pool: WorkerPool, settings: Settings) -> None:
        self._pool = pool
        self._max_deadline = settings.max_deadline

    @property
    def at_once(self) -> int:
        """See `Planners`."""
        return 2 * self._pool.most_behind

    async def start(self) -> None:
        """See `Planners`; the pool is started by whoever made it."""

    async def stop(self) -> None:
        """See `Planners`; what is under way is cancelled by whoever waits for it."""

    async def plan(self, chunk: Chunk) -> list[Reply]:
        """See `Planners`."""
        return [await self._planned(item, chunk.definitions) for item in chunk.items]

    async def _planned(self, item: Claimed, definitions: Mapping[str, bytes]) -> Reply:
        """Plan a request within its deadline, which begins when a worker does."""
        instance = f"/v1/batches/{item.batch_id}"
        arguments = {} if item.robot is None else {"definition": definitions[item.robot]}
        task = Task(PLAN_ITEM, instance, time.monotonic(), math.inf, item.request, arguments)
        seconds = min(item.deadline, self._max_deadline)
        try:
            return await self._pool.run_behind(task, Kind((PLAN_ITEM, item.batch_id), 0), seconds)
        except (DeadlineExceeded, MemoryExceeded, InternalError) as error:
            status, document = problem_document(error, instance)
            return Reply(status, MEDIA_TYPE, document, code=error.code)
